#include "audio/synthesis/noise_bed.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/no_alloc_scope.h"
#include "tests/support/noisy_slides.h"

namespace carom::audio {
namespace {

constexpr std::size_t kChannels = 2;

std::vector<float> powersAt(std::size_t channel, std::size_t band, float power) {
  std::vector<float> powers(kChannels * kThirdOctaves, 0.0F);
  powers[channel * kThirdOctaves + band] = power;
  return powers;
}

/// Returns the samples of both channels, one behind the other, rendered in blocks of that size.
std::vector<double> rendered(NoiseBed& bed, std::size_t frames, std::size_t block) {
  std::vector<double> samples(kChannels * frames, 0.0);
  for (std::size_t at = 0; at < frames; at += block)
    bed.mix(static_cast<std::int64_t>(at),
            {.samples = &samples[at], .stride = frames, .frames = std::min(block, frames - at)});
  return samples;
}

TEST(NoiseBed, HasThePowerOfItsThirdOctave) {
  constexpr std::size_t kFrames = 192000;
  for (const std::size_t band : {5U, 13U, 20U}) {
    NoiseBed bed(48000.0, kChannels, std::nullopt);
    const std::vector<float> powers = powersAt(1, band, 4.0F);
    EXPECT_TRUE(bed.add({.at = 1, .since = 0, .lasting = 1000000000, .powers = powers}));
    const std::vector<double> both = rendered(bed, kFrames, 1000);
    const std::vector<double> quiet(both.begin(), both.begin() + kFrames);
    const std::vector<double> loud(both.begin() + kFrames, both.end());
    for (const double sample : quiet)
      ASSERT_EQ(sample, 0.0);
    const std::vector<double> heard = test::thirdOctavesOf(loud, 0, kFrames);
    EXPECT_NEAR(10.0 * std::log10(heard[band] / 4.0), 0.0, 0.8) << band;
    EXPECT_LT(heard[band - 2] + heard[band + 2], 1e-3);
  }
}

TEST(NoiseBed, BitsDoNotDependOnTheBlocksAndNothingAllocates) {
  const std::vector<float> powers = powersAt(0, 12, 1.0F);
  const auto sound = [&powers](std::size_t block) {
    NoiseBed bed(48000.0, kChannels, 8);
    std::vector<double> samples(kChannels * 6000, 0.0);
    const test::NoAllocScope scope;
    EXPECT_TRUE(bed.add({.at = 900, .since = 100, .lasting = 800, .powers = powers}));
    EXPECT_TRUE(bed.add({.at = 1700, .since = 900, .lasting = 800, .powers = powers}));
    for (std::size_t at = 0; at < 6000; at += block)
      bed.mix(static_cast<std::int64_t>(at), {.samples = &samples[at],
                                              .stride = 6000,
                                              .frames = std::min<std::size_t>(block, 6000 - at)});
    EXPECT_TRUE(bed.isSilent());
    EXPECT_EQ(scope.allocations(), 0U);
    return samples;
  };
  const std::vector<double> whole = sound(6000);
  EXPECT_EQ(sound(37), whole);
  EXPECT_EQ(sound(256), whole);
}

TEST(NoiseBed, FadesWhenNothingFollows) {
  NoiseBed bed(48000.0, kChannels, 8);
  const std::vector<float> powers = powersAt(0, 12, 1.0F);
  EXPECT_TRUE(bed.add({.at = 800, .since = 0, .lasting = 800, .powers = powers}));
  const std::vector<double> samples = rendered(bed, 4800, 480);
  for (std::size_t i = 1800; i < 4800; ++i)
    ASSERT_EQ(samples[i], 0.0) << i;
  for (std::size_t i = 1; i < 4800; ++i)
    ASSERT_LT(std::abs(samples[i] - samples[i - 1]), 1.0) << i;
}

// The listener has jumped towards what slides: its next step is heard before those on their way.
TEST(NoiseBed, WhatIsHeardEarlierTakesThePlaceOfWhatIsStillOnItsWay) {
  const auto energyOf = [](bool hasFar) {
    NoiseBed bed(48000.0, kChannels, 8);
    const std::vector<float> faint = powersAt(0, 12, 1e-9F);
    const std::vector<float> powers = powersAt(0, 12, 1.0F);
    if (hasFar) {
      EXPECT_TRUE(bed.add({.at = 40800, .since = 40000, .lasting = 800, .powers = faint}));
      EXPECT_TRUE(bed.add({.at = 41600, .since = 40800, .lasting = 800, .powers = faint}));
    }
    for (std::int64_t at = 800; at <= 4000; at += 800)
      EXPECT_TRUE(bed.add({.at = at, .since = at - 800, .lasting = 800, .powers = powers}));
    double energy = 0.0;
    for (const double sample : rendered(bed, 4800, 480))
      energy += sample * sample;
    return energy;
  };
  EXPECT_GT(energyOf(false), 0.0);
  EXPECT_EQ(energyOf(true), energyOf(false));
}

TEST(NoiseBed, RefusesWhatItHasNoRoomFor) {
  NoiseBed bed(48000.0, kChannels, 2);
  const std::vector<float> powers = powersAt(0, 12, 1.0F);
  EXPECT_TRUE(bed.add({.at = 10, .since = 0, .lasting = 10, .powers = powers}));
  EXPECT_TRUE(bed.add({.at = 20, .since = 10, .lasting = 10, .powers = powers}));
  EXPECT_FALSE(bed.add({.at = 30, .since = 20, .lasting = 10, .powers = powers}));
  EXPECT_FALSE(bed.add({.at = 30, .since = 20, .lasting = 10, .powers = {}}));
}

}  // namespace
}  // namespace carom::audio
