#include "lab/fit/mode_match.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace carom::test {
namespace {

using namespace lab;

/// Frequencies of a bar that bends, twists and stretches, more or less.
std::vector<double> barFrequencies() {
  std::vector<double> all;
  for (int order = 1; order <= 14; ++order)
    all.push_back(100.0 * (order + 0.5) * (order + 0.5));
  for (int order = 1; order <= 9; ++order)
    all.push_back(1510.0 * order);
  std::ranges::sort(all);
  return all;
}

std::vector<ComputedLine> linesOf(const std::vector<double>& frequencies, double error = 0.01) {
  std::vector<ComputedLine> lines;
  for (const double frequency : frequencies)
    lines.push_back({frequency, error});
  return lines;
}

TapMode tapMode(double frequency, double confidence = 1.0) {
  TapMode mode;
  mode.frequency = frequency;
  mode.decayRate = 1e-3 * frequency;
  mode.frequencyError = 1e-5 * frequency;
  mode.confidence = confidence;
  return mode;
}

TEST(ModeMatch, FindsTheFactorAmongMissingAndSpuriousModes) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const std::vector<double> computed = barFrequencies();
  constexpr double kFactor = 0.7312;
  std::vector<TapMode> measured;
  for (std::size_t mode = 0; mode < computed.size(); ++mode) {
    if (mode % 3 == 1) continue;  // the blow was on a node
    measured.push_back(tapMode(kFactor * computed[mode] * (1.0 + 0.003 * uniform(random))));
  }
  for (const double spurious : {777.0, 2901.0, 6543.0})
    measured.push_back(tapMode(spurious, 0.5));
  std::ranges::sort(measured, {}, &TapMode::frequency);
  const ModeMatch match = matchModes(measured, linesOf(computed));
  EXPECT_TRUE(match.accepted) << match.reason;
  EXPECT_NEAR(match.factor / kFactor, 1.0, 2e-3);
  EXPECT_GT(match.explained, 0.85);
  EXPECT_GT(match.chanceDistance, 5.0);
}

TEST(ModeMatch, RefusesAnotherBody) {
  const std::vector<double> computed = barFrequencies();
  std::mt19937 random(11);
  std::uniform_real_distribution<double> uniform(std::log(150.0), std::log(15000.0));
  std::size_t accepted = 0;
  for (int body = 0; body < 30; ++body) {
    std::vector<TapMode> measured;
    for (int mode = 0; mode < 14; ++mode)
      measured.push_back(tapMode(std::exp(uniform(random))));
    std::ranges::sort(measured, {}, &TapMode::frequency);
    const ModeMatch match = matchModes(measured, linesOf(computed));
    accepted += match.accepted ? 1U : 0U;
    EXPECT_EQ(match.accepted, match.reason.empty());
  }
  EXPECT_LE(accepted, 1u);
}

TEST(ModeMatch, TooFewModesAreNoMatch) {
  const std::vector<TapMode> measured = {tapMode(500.0), tapMode(900.0)};
  const ModeMatch match = matchModes(measured, linesOf(barFrequencies()));
  EXPECT_FALSE(match.accepted);
  EXPECT_THAT(match.reason, testing::HasSubstr("expected at least 3"));
}

TEST(ModeMatch, NothingIsRefusedWithAReason) {
  EXPECT_FALSE(matchModes({}, linesOf(barFrequencies())).reason.empty());
  EXPECT_FALSE(matchModes(std::vector<TapMode>{tapMode(500.0)}, {}).reason.empty());
}

}  // namespace
}  // namespace carom::test
