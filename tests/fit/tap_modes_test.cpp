#include "lab/fit/tap_modes.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "lab/fit/tap_recording.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/fit/synthetic_tap.h"

namespace carom::test {
namespace {

using namespace lab;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

TapModes modesOf(const std::vector<TapPartial>& partials, const SyntheticTap& settings) {
  const auto tap = findTap(synthesised(partials, settings), settings.sampleRate);
  EXPECT_TRUE(bool(tap)) << tap.error().message;
  if (!tap) return {};
  const auto modes = tapModes({*tap});
  EXPECT_TRUE(bool(modes)) << modes.error().message;
  return modes ? *modes : TapModes{};
}

/// The mode nearest to a frequency; one far away if there are none.
TapMode nearestMode(const TapModes& found, double frequency) {
  TapMode nearest;
  nearest.frequency = 1e9;
  for (const TapMode& mode : found.modes) {
    if (std::abs(mode.frequency - frequency) < std::abs(nearest.frequency - frequency))
      nearest = mode;
  }
  return nearest;
}

const std::vector<TapPartial>& bell() {
  static const std::vector<TapPartial> partials = {{440.0, 3.0, 0.5},   {1210.0, 8.0, 0.3},
                                                   {2300.0, 15.0, 0.4}, {3333.3, 25.0, 0.3},
                                                   {5000.0, 60.0, 0.5}, {7100.0, 120.0, 0.4}};
  return partials;
}

TEST(TapModes, FrequencyWithin1e4AndDecayWithin5PercentAmongNoiseHumAndClipping) {
  const TapModes found = modesOf(bell(), {.seconds = 3.0, .noise = 1e-3, .hum = 0.02, .clip = 1.5});
  for (const TapPartial& partial : bell()) {
    const TapMode mode = nearestMode(found, partial.frequency);
    EXPECT_GT(mode.overNoise, 30.0) << partial.frequency;
    EXPECT_NEAR(mode.frequency / partial.frequency, 1.0, 1e-4);
    EXPECT_NEAR(mode.decayRate / partial.decay, 1.0, 0.05) << partial.frequency;
    EXPECT_GT(mode.confidence, 0.4) << partial.frequency;
  }
}

TEST(TapModes, LevelsAreThoseAtTheOnset) {
  const TapModes found = modesOf(bell(), {.seconds = 3.0, .noise = 1e-3});
  for (const TapPartial& partial : bell())
    EXPECT_NEAR(nearestMode(found, partial.frequency).level,
                20.0 * std::log10(partial.amplitude / 0.5), 1.0)
        << partial.frequency;
}

TEST(TapModes, TellsAPairThatBeatsApart) {
  const TapModes found =
      modesOf({{812.0, 3.0, 0.5}, {813.5, 3.5, 0.4, 1.2}}, {.seconds = 3.0, .noise = 5e-4});
  const TapMode low = nearestMode(found, 812.0);
  const TapMode high = nearestMode(found, 813.5);
  EXPECT_NEAR(low.frequency, 812.0, 0.02);
  EXPECT_NEAR(high.frequency, 813.5, 0.02);
  EXPECT_NEAR(low.decayRate, 3.0, 0.15);
  EXPECT_NEAR(high.decayRate, 3.5, 0.18);
}

TEST(TapModes, LeavesOutHumThatWasThereBefore) {
  const TapModes found = modesOf(bell(), {.seconds = 3.0, .noise = 1e-3, .hum = 0.05});
  EXPECT_THAT(found.hum, SizeIs(testing::Ge(3u)));
  for (const TapMode& mode : found.modes)
    EXPECT_GT(mode.frequency, 400.0);
}

TEST(TapModes, TwoTapsGiveTheModesOfBoth) {
  const auto one = findTap(synthesised({{700.0, 5.0, 0.5}, {1500.0, 9.0, 1e-5}},
                                       {.seconds = 2.0, .noise = 1e-3, .seed = 1}),
                           48000.0);
  const auto other = findTap(synthesised({{700.0, 5.0, 1e-5}, {1500.0, 9.0, 0.5}},
                                         {.seconds = 2.0, .noise = 1e-3, .seed = 2}),
                             48000.0);
  ASSERT_TRUE(one && other);
  const auto found = tapModes({*one, *other});
  ASSERT_TRUE(bool(found));
  EXPECT_NEAR(nearestMode(*found, 700.0).decayRate, 5.0, 0.2);
  EXPECT_NEAR(nearestMode(*found, 1500.0).decayRate, 9.0, 0.4);
}

TEST(TapModes, FindsNextToNothingInNoise) {
  SyntheticTap settings{.seconds = 2.0, .noise = 1e-3};
  std::vector<double> samples = synthesised({{1000.0, 900.0, 0.2}}, settings);
  const auto tap = findTap(samples, settings.sampleRate);
  ASSERT_TRUE(bool(tap));
  const auto found = tapModes({*tap});
  if (!found) return;  // nothing rings: as well
  const auto sure = std::ranges::count_if(found->modes, [](const TapMode& mode) {
    return mode.confidence > 0.3 && std::abs(mode.frequency - 1000.0) > 300.0;
  });
  EXPECT_EQ(sure, 0);
}

TEST(TapModes, RefusesTapsOfDifferentRates) {
  TapSegment one;
  one.sampleRate = 48000.0;
  TapSegment other;
  other.sampleRate = 44100.0;
  const auto found = tapModes({one, other});
  ASSERT_FALSE(bool(found));
  EXPECT_THAT(found.error().message, HasSubstr("different sampling rates"));
}

TEST(TapRecording, FindsTheOnsetWithinTwoMilliseconds) {
  const auto tap =
      findTap(synthesised(bell(), {.seconds = 2.0, .onset = 0.737, .noise = 1e-3}), 48000.0);
  ASSERT_TRUE(bool(tap));
  EXPECT_NEAR(tap->onset, 0.737, 2e-3);
}

TEST(TapRecording, BeginsAfterTheClipping) {
  const SyntheticTap settings{.seconds = 2.0, .clip = 1.0};
  const auto tap = findTap(synthesised(bell(), settings), 48000.0);
  ASSERT_TRUE(bool(tap));
  EXPECT_GT(tap->clipped, 0u);
  for (const double sample : tap->free())
    EXPECT_LT(std::abs(sample), 1.001);
}

TEST(TapRecording, ASecondBlowEndsTheRing) {
  std::vector<double> samples = synthesised(bell(), {.seconds = 2.0, .onset = 0.3, .noise = 1e-3});
  const std::vector<double> second =
      synthesised(bell(), {.seconds = 2.0, .onset = 1.2, .noise = 1e-3, .seed = 3});
  for (std::size_t at = 0; at < samples.size(); ++at)
    samples[at] += 0.8 * second[at];
  const auto tap = findTap(samples, 48000.0);
  ASSERT_TRUE(bool(tap));
  EXPECT_NEAR(tap->onset, 0.3, 3e-3);
  EXPECT_LT(static_cast<double>(tap->ring.size()) / 48000.0, 0.91);
}

TEST(TapRecording, ASteadyToneHasNoOnset) {
  const auto tap =
      findTap(synthesised({{1000.0, 0.0, 0.5}}, {.seconds = 1.0, .onset = -1.0}), 48000.0);
  ASSERT_FALSE(bool(tap));
  EXPECT_THAT(tap.error().message, HasSubstr("no onset"));
}

}  // namespace
}  // namespace carom::test
