#include "lab/fit/damping_law.h"

#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

namespace carom::test {
namespace {

using namespace lab;

std::vector<MeasuredDecay> decaysOf(const std::vector<double>& frequencies, auto rate) {
  std::vector<MeasuredDecay> decays;
  for (const double frequency : frequencies)
    decays.push_back({frequency, rate(frequency), 1.0});
  return decays;
}

const std::vector<double> kFrequencies = {210.0, 480.0, 900.0, 1700.0, 3100.0, 5200.0, 8800.0};

TEST(DampingLaw, FindsRayleighsNumbersThoughOneModeIsFarOff) {
  auto decays = decaysOf(kFrequencies, [](double frequency) {
    const double w = 2.0 * std::numbers::pi * frequency;
    return 0.5 * (8.0 + 3e-8 * w * w);
  });
  decays[3].decayRate *= 2.0;
  const DampingFit fit = fitDamping(decays);
  EXPECT_TRUE(fit.isRayleigh);
  EXPECT_NEAR(fit.law.alpha, 8.0, 0.4);
  EXPECT_NEAR(fit.law.beta, 3e-8, 2e-9);
}

TEST(DampingLaw, FindsALossFactor) {
  const auto decays = decaysOf(kFrequencies, [](double frequency) {
    return std::numbers::pi * frequency * 1.5e-3 * std::pow(frequency / 1000.0, 0.25);
  });
  const DampingFit fit = fitDamping(decays);
  EXPECT_LT(fit.lossFactorResidual, 1e-3);
  EXPECT_GT(fit.rayleighResidual, 0.1);
  EXPECT_FALSE(fit.isRayleigh);
  EXPECT_NEAR(fit.law.lossFactor, 1.5e-3, 1e-5);
  EXPECT_NEAR(fit.law.lossExponent, 0.25, 1e-2);
}

TEST(DampingLaw, OneModeGivesOneNumber) {
  const DampingFit fit = fitDamping(std::vector<MeasuredDecay>{{1000.0, 5.0, 1.0}});
  EXPECT_NEAR(fit.law.decayRate(1000.0), 5.0, 0.1);
  EXPECT_EQ(fitDamping({}).modes, 0u);
}

}  // namespace
}  // namespace carom::test
