#include "carom/audio/absorption.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "carom/audio/material.h"
#include "tests/support/random.h"

namespace carom {
namespace {

constexpr double kRates[] = {8000.0, 44100.0, 48000.0, 192000.0};

Absorption uniform(double alpha) {
  Absorption absorption;
  absorption.coefficients.fill(alpha);
  return absorption;
}

Absorption randomAbsorption(Random& random) {
  Absorption absorption;
  const double high = random.chance(0.5) ? 1.0 : 0.2;
  for (double& alpha : absorption.coefficients) {
    alpha = random.chance(0.1) ? high * random.below(2) : random.between(0.0, high);
  }
  return absorption;
}

/// Returns |H|, measured by running the filter on a sine, in the steady state.
double measuredGain(const ReflectionFilter& filter, double frequency, double sampleRate) {
  const double step = 2.0 * std::numbers::pi * frequency / sampleRate;
  const int period = static_cast<int>(sampleRate);  // whole periods for whole Hz
  double lastIn = 0.0;
  double out = 0.0;
  std::complex<double> sum = 0.0;
  for (int sample = 0; sample < 2 * period; ++sample) {
    const double in = std::sin(step * sample);
    out = filter.b0 * in + filter.b1 * lastIn - filter.a1 * out;
    lastIn = in;
    if (sample >= period) sum += out * std::polar(1.0, -step * sample);
  }
  return 2.0 * std::abs(sum) / period;
}

TEST(Absorption, EveryRowIsValidNamedOnceAndSaysItsSource) {
  const auto table = surfaceTable();
  for (const Surface& surface : table) {
    EXPECT_TRUE(isValid(surface.absorption)) << surface.name;
    EXPECT_FALSE(surface.source.empty()) << surface.name;
    EXPECT_EQ(findSurface(surface.name), &surface);
  }
  EXPECT_EQ(findSurface("vacuum"), nullptr);
}

TEST(Absorption, EveryBuiltInMaterialHasADefaultSurface) {
  for (const Material& material : materialTable()) {
    EXPECT_NE(defaultSurface(material.name), nullptr) << material.name;
  }
  EXPECT_EQ(defaultSurface("cheese"), nullptr);
}

TEST(Absorption, IsInterpolatedOverTheLogarithmOfFrequencyAndHeldOutside) {
  Absorption absorption;
  absorption.coefficients = {0.1, 0.2, 0.4, 0.4, 0.8, 0.3, 0.5};
  for (std::size_t band = 0; band < kBandCount; ++band) {
    EXPECT_DOUBLE_EQ(absorptionAt(absorption, kOctaveBands[band]), absorption.coefficients[band]);
  }
  EXPECT_DOUBLE_EQ(absorptionAt(absorption, 20.0), 0.1);
  EXPECT_DOUBLE_EQ(absorptionAt(absorption, 20000.0), 0.5);
  EXPECT_NEAR(absorptionAt(absorption, std::sqrt(250.0 * 500.0)), 0.3, 1e-15);
  EXPECT_NEAR(reflectionMagnitude(absorption, 1000.0), std::sqrt(0.6), 1e-15);
}

TEST(Absorption, RefusesCoefficientsThatAreNoShareOfEnergy) {
  EXPECT_TRUE(isValid(uniform(0.0)));
  EXPECT_TRUE(isValid(uniform(1.0)));
  EXPECT_FALSE(isValid(uniform(-0.001)));
  EXPECT_FALSE(isValid(uniform(1.001)));
  EXPECT_FALSE(isValid(uniform(std::nan(""))));
}

TEST(ReflectionFilter, IsStablePassiveAndMinimumPhaseForAnyAbsorption) {
  Random random(1);
  for (int trial = 0; trial < 400; ++trial) {
    const Absorption absorption = randomAbsorption(random);
    const double rate = kRates[trial % 4];
    const ReflectionFilter filter = reflectionFilter(absorption, rate);
    EXPECT_LT(std::abs(filter.a1), 1.0);
    EXPECT_LE(std::abs(filter.b1), std::abs(filter.b0) + 1e-15);
    for (int point = 0; point <= 100; ++point) {
      const double gain = std::abs(frequencyResponse(filter, rate / 2.0 * point / 100.0, rate));
      ASSERT_LE(gain, 1.0 + 1e-12);
    }
  }
}

TEST(ReflectionFilter, HasTheGainThatASineMeasures) {
  const ReflectionFilter filter = reflectionFilter(findSurface("carpet")->absorption, 48000.0);
  for (const double frequency : {100.0, 1000.0, 3000.0, 12000.0}) {
    EXPECT_NEAR(measuredGain(filter, frequency, 48000.0),
                std::abs(frequencyResponse(filter, frequency, 48000.0)), 1e-4);
  }
}

TEST(ReflectionFilter, IsExactForAnAbsorptionThatIsTheSameInAllBands) {
  for (const double alpha : {0.0, 0.02, 0.5, 0.97, 1.0}) {
    const ReflectionFilter filter = reflectionFilter(uniform(alpha), 48000.0);
    for (const double frequency : {0.0, 200.0, 5000.0, 24000.0}) {
      EXPECT_NEAR(std::abs(frequencyResponse(filter, frequency, 48000.0)), std::sqrt(1.0 - alpha),
                  1e-7);
    }
  }
}

/// The fit finds a first-order shelf from its bands: alpha(f) = 0.6 - 0.5 / (1 + (f/f0)^2), with f
/// warped.
TEST(ReflectionFilter, FindsTheFirstOrderWallBehindTheBands) {
  const double rate = 48000.0;
  const double corner = std::tan(std::numbers::pi * 700.0 / rate);
  Absorption absorption;
  for (std::size_t band = 0; band < kBandCount; ++band) {
    const double x = std::tan(std::numbers::pi * kOctaveBands[band] / rate) / corner;
    absorption.coefficients[band] = 0.6 - 0.5 / (1.0 + x * x);
  }
  const ReflectionFilter filter = reflectionFilter(absorption, rate);
  EXPECT_LT(reflectionFitError(absorption, filter, rate), 0.03);
}

/// The single gain whose largest error is smallest is off by half the span of the bands.
TEST(ReflectionFilter, IsHardlyEverFartherOffThanOneGainWouldBe) {
  for (const Surface& surface : surfaceTable()) {
    const auto [least, most] = std::ranges::minmax(surface.absorption.coefficients);
    const double halfSpan =
        5.0 * std::log10(std::max(1.0 - least, 0.01) / std::max(1.0 - most, 0.01));
    const ReflectionFilter filter = reflectionFilter(surface.absorption, 48000.0);
    EXPECT_LE(reflectionFitError(surface.absorption, filter, 48000.0), halfSpan + 0.05)
        << surface.name;
  }
}

/// The bounds are those of the recorded errors. Where a surface absorbs nearly everything, the
/// reflected part falls faster than a first order can follow, from -3 to -20 dB: only there is the
/// error several decibels.
TEST(ReflectionFilter, MissesReflectiveSurfacesByLessThanAFifthOfADecibel) {
  for (const Surface& surface : surfaceTable()) {
    const ReflectionFilter filter = reflectionFilter(surface.absorption, 48000.0);
    const double error = reflectionFitError(surface.absorption, filter, 48000.0);
    RecordProperty(std::string(surface.name), std::to_string(error));
    const double most = std::ranges::max(surface.absorption.coefficients);
    EXPECT_LT(error, most <= 0.3 ? 0.2 : most <= 0.8 ? 1.2 : 6.0) << surface.name;
  }
}

}  // namespace
}  // namespace carom
