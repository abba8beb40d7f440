#include "audio/acceleration_noise.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "tests/audio/ball_drop.h"

namespace carom {
namespace {

using test::BallDrop;

constexpr double kDuration = 80e-6;  // s
const Medium kAir;

Click clickOf(const BallDrop& drop, const Vec3& listener) {
  return makeClick(drop.event(), drop.ball(), kDuration, listener, kAir);
}

TEST(GaussianPulse, HoldsThirteenPointSevenPercentTooMuchImpulse) {
  // Eq. 6 is made for the half-sine, whose integral over u is 2/pi; the Gaussian has more.
  double integral = 0.0;
  constexpr double kStep = 1e-3;
  for (double u = -2.0; u < 3.0; u += kStep)
    integral += kStep * gaussianPulse(u);
  EXPECT_NEAR(integral / (2.0 / std::numbers::pi), 1.137, 5e-4);
}

TEST(GaussianPulse, SlopeIsItsDerivative) {
  constexpr double kStep = 1e-5;
  for (double u = -1.0; u < 2.0; u += 0.0137) {
    const double difference = (gaussianPulse(u + kStep) - gaussianPulse(u - kStep)) / (2 * kStep);
    EXPECT_NEAR(gaussianPulseSlope(u), difference, 1e-8);
  }
}

TEST(GaussianPulse, PeakSlopeBoundsItAndIsReached) {
  double largest = 0.0;
  for (double u = 0.0; u < 1.0; u += 1e-6)
    largest = std::max(largest, std::abs(gaussianPulseSlope(u)));
  EXPECT_NEAR(largest, kPulsePeakSlope, 1e-10);
}

TEST(GaussianPulse, IsCutBelowTheRoundingOfItsPeak) {
  EXPECT_LT(std::abs(gaussianPulseSlope(0.5 + kPulseHalfWidth)),
            kPulsePeakSlope * std::numeric_limits<double>::epsilon() * 4.0);
}

TEST(Click, IsPositiveFirstWhereTheBodyIsPushedTowardsTheListener) {
  const BallDrop drop;  // pushed up
  const Click above = clickOf(drop, {0.0, 0.0, 1.0});
  const Click below = clickOf(drop, {0.0, 0.0, -1.0});
  const double early = above.time + above.delay + 0.2 * kDuration;
  const double late = above.time + above.delay + 0.8 * kDuration;
  EXPECT_GT(above.pressure(early), 0.0);
  EXPECT_LT(above.pressure(late), 0.0);
  EXPECT_LT(below.pressure(early), 0.0);
  EXPECT_EQ(above.amplitude, -below.amplitude);
}

TEST(Click, FallsAsOneOverDistance) {
  const BallDrop drop;
  EXPECT_NEAR(clickOf(drop, {0, 0, 0.5}).peak() / clickOf(drop, {0, 0, 4.0}).peak(), 8.0, 1e-12);
}

TEST(Click, FollowsTheCosineOfTheAngle) {
  const BallDrop drop;
  for (double degrees = 0.0; degrees <= 180.0; degrees += 15.0) {
    const double angle = degrees * std::numbers::pi / 180.0;
    const Click click = clickOf(drop, {2.0 * std::sin(angle), 0.0, 2.0 * std::cos(angle)});
    const Click ahead = clickOf(drop, {0.0, 0.0, 2.0});
    EXPECT_NEAR(click.amplitude / ahead.amplitude, std::cos(angle), 1e-12) << degrees;
  }
}

TEST(Click, GrowsWithTheCubeOfTheRadiatingSphereNotOfTheContact) {
  const BallDrop drop;
  SoundBody large = drop.ball();
  large.radius *= 3.0;
  const Click small = clickOf(drop, {0, 0, 2.0});
  EXPECT_NEAR(makeClick(drop.event(), large, kDuration, {0, 0, 2.0}, kAir).amplitude,
              27.0 * small.amplitude, 1e-12 * small.amplitude * 27.0);
  ImpulseEvent blunt = drop.event();
  blunt.radius *= 3.0;
  EXPECT_EQ(makeClick(blunt, drop.ball(), kDuration, {0, 0, 2.0}, kAir).amplitude, small.amplitude);
}

TEST(Click, ListenerInsideTheBodyHearsItsSurface) {
  const BallDrop drop;
  const Click inside = clickOf(drop, {0, 0, 0.001});
  const Click surface = clickOf(drop, {0, 0, drop.radius});
  EXPECT_EQ(inside.amplitude, surface.amplitude);
  EXPECT_EQ(inside.delay, surface.delay);
  EXPECT_EQ(clickOf(drop, drop.centre).amplitude, 0.0);  // at the centre no side is nearer
}

TEST(SampledClick, IsEmptyWhenItFallsBetweenTwoSamples) {
  const Click click{.time = 0.5 / 48000.0, .delay = 0.0, .duration = 1e-7, .amplitude = 1.0};
  const SampledClick sampled = sampleClick(click, 48000.0, 0);
  EXPECT_EQ(sampled.first, sampled.end);
}

TEST(SampledClick, CannotBePlacedBeyondExactSampleNumbers) {
  Click click{.time = 1e12, .delay = 0.0, .duration = 1e-4, .amplitude = 1.0};
  EXPECT_FALSE(canSample(click, 48000.0));
  click.time = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(canSample(click, 48000.0));
  click.time = 86400.0 * 365.0;
  EXPECT_TRUE(canSample(click, 48000.0));
}

// What point sampling costs. The oracle is the Fourier transform of the Gaussian's derivative,
// i w tau^2 sqrt(pi/6) exp(-(w tau)^2/24), against the transform of the samples, below 20 kHz.

struct InBandError {
  double worst = -1000.0;    // dB, energy of the error over that of the click, worst phase
  double quietest = 1000.0;  // dB, level of the samples over that of the click
  double loudest = -1000.0;
};

constexpr double kRate = 48000.0;

double decibels(double energyRatio) {
  return 10.0 * std::log10(energyRatio + 1e-300);
}

std::complex<double> transformOfSamples(const std::vector<double>& samples, double omega) {
  std::complex<double> sum = 0.0;
  for (std::size_t sample = 0; sample < samples.size(); ++sample)
    sum += samples[sample] * std::polar(1.0, -omega * static_cast<double>(sample) / kRate);
  return sum / kRate;
}

std::complex<double> transformOfClick(double tau, double centre, double omega) {
  const double gaussian =
      std::sqrt(std::numbers::pi / 6.0) * std::exp(-std::pow(omega * tau, 2) / 24.0);
  return std::complex<double>(0.0, omega * tau * tau) * gaussian * std::polar(1.0, -omega * centre);
}

InBandError inBandError(double tau) {
  InBandError result;
  for (int phase = 0; phase < 256; ++phase) {
    const double centre = (200.0 + phase / 256.0) / kRate;
    const Click click{.time = centre - 0.5 * tau, .delay = 0.0, .duration = tau, .amplitude = 1.0};
    std::vector<double> samples(400, 0.0);
    addClick(sampleClick(click, kRate, 0), 0, samples);
    double error = 0.0;
    double rendered = 0.0;
    double exact = 0.0;
    for (double frequency = 125.0; frequency < 20000.0; frequency += 250.0) {
      const double omega = 2.0 * std::numbers::pi * frequency;
      const auto wanted = transformOfClick(tau, centre, omega);
      const auto got = transformOfSamples(samples, omega);
      error += std::norm(got - wanted);
      rendered += std::norm(got);
      exact += std::norm(wanted);
    }
    result.worst = std::max(result.worst, decibels(error / exact));
    result.quietest = std::min(result.quietest, decibels(rendered / exact));
    result.loudest = std::max(result.loudest, decibels(rendered / exact));
  }
  return result;
}

struct AliasingRow {
  double tau;       // s
  double worst;     // dB
  double quietest;  // dB, -100 stands for silence
  double loudest;   // dB
};

TEST(SampledClick, PointSamplingErrorIsThatOfTheDocumentation) {
  // docs/acceleration_noise.md, "What aliasing costs".
  const AliasingRow table[] = {{5e-6, 30.5, -100.0, 30.5},
                               {8e-6, 22.4, -100.0, 22.5},
                               {20e-6, 6.5, -29.7, 7.6},
                               {40e-6, -12.7, -1.8, 1.6},
                               {80e-6, -65.0, 0.0, 0.0}};
  for (const AliasingRow& row : table) {
    const InBandError measured = inBandError(row.tau);
    EXPECT_NEAR(measured.worst, row.worst, 0.1) << row.tau;
    EXPECT_NEAR(std::max(measured.quietest, -100.0), row.quietest, 0.1) << row.tau;
    EXPECT_NEAR(measured.loudest, row.loudest, 0.1) << row.tau;
  }
}

TEST(SampledClick, IsExactInBandFromSixSamplesOn) {
  EXPECT_LT(inBandError(125e-6).worst, -130.0);
}

}  // namespace
}  // namespace carom
