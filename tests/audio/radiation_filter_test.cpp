#include "audio/radiation/radiation_filter.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "audio/dsp/spread_kernel.h"
#include "tests/support/special_functions.h"

namespace carom {

using namespace audio;

namespace {

using std::numbers::pi;
using Complex = std::complex<double>;

// Outgoing spherical wave in the e^{-i w t} convention: h1 = j1 + i y1.
Complex hankel(unsigned order, double x) {
  return {test::sphericalBessel(order, x), test::sphericalNeumann(order, x)};
}

// Pressure over velocity of an oscillating rigid sphere, straight ahead of it: the solution of the
// wave equation whose radial velocity is that of the surface (Morse & Ingard 1968, section 7.1), in
// the e^{+i w t} convention.
Complex pressureOverVelocity(double omega, double radius, double distance) {
  constexpr double kDensity = 1.2;
  constexpr double kSpeed = 343.0;
  const double k = omega / kSpeed;
  const Complex slope = hankel(0, k * radius) - 2.0 / (k * radius) * hankel(1, k * radius);
  const Complex wave = Complex(0.0, 1.0) * omega * kDensity * hankel(1, k * distance) / (k * slope);
  return std::conj(wave);
}

TEST(RadiationResponse, IsTheWaveEquationsOwnSolution) {
  double worst = 0.0;
  for (const double radius : {0.01, 0.03, 0.1}) {
    for (const double distance : {0.05, 0.11, 0.3, 1.0}) {
      if (distance < radius) continue;
      for (double frequency = 100.0; frequency <= 20000.0; frequency *= 1.3) {
        const double omega = 2.0 * pi * frequency;
        const Complex s{0.0, omega};
        const RadiationResponse response = radiationResponse(omega, 343.0 / radius);
        const Complex delay = std::exp(-s * (distance - radius) / 343.0);
        const Complex pressure = 1.2 * std::pow(radius, 3) / (2.0 * 343.0 * distance) * delay *
                                 (response.far + 343.0 / distance * response.near) * s;
        const Complex exact = pressureOverVelocity(omega, radius, distance);
        worst = std::max(worst, std::abs(pressure / exact - 1.0));
      }
    }
  }
  EXPECT_LT(worst, 1e-12);
}

// The expected errors (dB) of the compact formula were computed apart from this code.
TEST(RadiationResponse, CompactIsTooLoudAboveAndTooQuietNearby) {
  const auto excess = [](double radius, double distance, double frequency) {
    const double omega = 2.0 * pi * frequency;
    const RadiationResponse exact = radiationResponse(omega, 343.0 / radius);
    const RadiationResponse compact =
        radiationResponse(omega, std::numeric_limits<double>::infinity());
    const Complex whole = exact.far + 343.0 / distance * exact.near;
    return 20.0 * std::log10(std::abs(compact.far / whole));
  };
  EXPECT_NEAR(excess(0.01, 1.0, 10000.0), 5.8, 0.05);
  EXPECT_NEAR(excess(0.01, 1.0, 20000.0), 16.6, 0.05);
  EXPECT_NEAR(excess(0.10, 0.5, 1000.0), 5.8, 0.2);
  EXPECT_NEAR(excess(0.10, 0.5, 5000.0), 32.0, 0.5);
  EXPECT_NEAR(excess(0.01, 0.05, 100.0), -20.8, 0.05);
}

struct Errors {
  double far = 0.0;
  double near = 0.0;
};

Errors errorsOf(double corner, RadiationFilter::Input input) {
  const RadiationFilter filter(corner, input);
  Errors worst;
  for (int i = 1; i <= 777; ++i) {
    const double frequency = kBand * i / 777.0;
    const double omega = 2.0 * pi * frequency;
    Complex far = 0.0;
    Complex near = 0.0;
    for (std::size_t tap = 0; tap < RadiationFilter::kTaps; ++tap) {
      const auto at = static_cast<double>(tap) + static_cast<double>(RadiationFilter::kFirstTap);
      far += filter.far()[tap] * std::polar(1.0, -omega * at);
      near += filter.near()[tap] * std::polar(1.0, -omega * at);
    }
    const Complex back = std::polar(1.0, -omega);
    const double dimming =
        input == RadiationFilter::Input::spread ? spreadTransform(frequency) : 1.0;
    const Complex rest = dimming / (1.0 - filter.b1() * back - filter.b2() * back * back);
    const RadiationResponse exact = radiationResponse(omega, corner);
    worst.far = std::max(worst.far, std::abs(far * rest / exact.far - 1.0));
    if (std::isfinite(corner))
      worst.near = std::max(worst.near, std::abs(near * rest / exact.near - 1.0));
  }
  return worst;
}

// The corners are those of bodies from 30 m at 192 kHz to 10 um at 8 kHz, and of the compact limit.
TEST(RadiationFilter, FollowsTheResponseToNinetyFiveDecibelsAtEveryFrequencyOfTheBand) {
  constexpr double kBound = 1.78e-5;  // -95 dB
  for (const auto input : {RadiationFilter::Input::spread, RadiationFilter::Input::bare}) {
    const double bound = input == RadiationFilter::Input::spread ? kBound : 1e-6;
    for (double corner = 5e-5; corner < 5e3; corner *= 1.7) {
      const Errors errors = errorsOf(corner, input);
      EXPECT_LT(errors.far, bound) << corner;
      EXPECT_LT(errors.near, bound) << corner;
    }
    EXPECT_LT(errorsOf(std::numeric_limits<double>::infinity(), input).far, bound);
  }
}

TEST(SpreadKernel, TransformIsThatOfItsSamplesAndWhatFoldsBackIsDark) {
  // The transform of the samples, at any offset, is the kernel's own plus the part that folds back.
  double worst = 0.0;
  for (double offset = 0.0; offset < 1.0; offset += 0.0625) {
    for (double frequency = 0.0; frequency <= kBand; frequency += kBand / 50.0) {
      Complex sum = 0.0;
      for (int n = -9; n <= 9; ++n)
        sum += spreadKernel(n - offset) * std::polar(1.0, -2.0 * pi * frequency * (n - offset));
      const double own = spreadTransform(frequency);
      worst = std::max(worst, std::abs(sum - own) / own);
    }
  }
  EXPECT_LT(worst, 3.5e-6);  // -109 dB
  EXPECT_GT(spreadTransform(kBand) / spreadTransform(0.0), std::pow(10.0, -25.5 / 20.0));
}

}  // namespace
}  // namespace carom
