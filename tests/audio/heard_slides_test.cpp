#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include <gtest/gtest.h>

#include "audio/model/third_octaves.h"
#include "carom/audio/synth.h"
#include "tests/audio/ball_drop.h"
#include "tests/support/noisy_slides.h"

namespace carom::test {
namespace {

SynthSettings heard(std::size_t voices) {
  SynthSettings settings;
  settings.lasting = LastingDetail::heard;
  settings.slideVoices = voices;
  return settings;
}

double decibels(double power, double of) {
  return 10.0 * std::log10((power + 1e-30) / (of + 1e-30));
}

double sumOf(const std::vector<double>& powers) {
  double sum = 0.0;
  for (const double power : powers)
    sum += power;
  return sum;
}

// The loudest contact has a voice, and a voice is the exact rendering.
TEST(HeardSlides, OneContactIsExact) {
  const NoisySlides slide{.duration = 1.0};
  SynthCounters counters;
  EXPECT_EQ(slide.sound(heard(8), &counters), slide.sound({}, nullptr));
  EXPECT_GT(counters.slides, 0U);
  EXPECT_EQ(counters.slidesInBed, 0U);
}

// The bits depend on the contacts alone.
TEST(HeardSlides, TheSameBitsTwice) {
  const NoisySlides slides{.count = 12, .duration = 0.5};
  EXPECT_EQ(slides.sound(heard(2), nullptr), slides.sound(heard(2), nullptr));
}

// A contact that is left out as below hearing is so in every third octave of the exact rendering,
// all of it together.
TEST(HeardSlides, WhatIsInaudibleIsBelowHearing) {
  SynthSettings exact;
  exact.audibleThreshold = 0.0;
  const NoisySlides slides{.count = 10, .speed = 0.01, .duration = 2.0};
  SynthCounters counters;
  const auto none = slides.sound(heard(8), &counters);
  EXPECT_GT(counters.inaudibleSlides, 0U);
  EXPECT_EQ(counters.slides + counters.slidesInBed, 0U);
  const auto sound = slides.sound(exact, nullptr);
  const std::vector<double> powers = thirdOctavesOf(sound[0], 12000, sound[0].size());
  EXPECT_GT(sumOf(powers), 0.0);
  for (std::size_t band = 0; band < powers.size(); ++band)
    EXPECT_LT(powers[band], audio::hearingThreshold()[band]) << band;
}

/// Largest difference (dB) between the third octaves of two sounds, of those that are heard and
/// within 40 dB of the loudest.
double farthestApart(const std::vector<double>& sound, const std::vector<double>& exact) {
  const std::vector<double> powers = thirdOctavesOf(exact, 12000, exact.size());
  const std::vector<double> heardPowers = thirdOctavesOf(sound, 12000, sound.size());
  const double loudest = *std::ranges::max_element(powers);
  double farthest = 0.0;
  for (std::size_t band = 0; band < powers.size(); ++band)
    if (powers[band] > 1e-4 * loudest && powers[band] > audio::hearingThreshold()[band])
      farthest = std::max(farthest, std::abs(decibels(heardPowers[band], powers[band])));
  return farthest;
}

TEST(HeardSlides, FiftyKeepTheirThirdOctaves) {
  const NoisySlides slides{.count = 50, .duration = 4.0};
  SynthCounters counters;
  const auto sound = slides.sound(heard(4), &counters);
  EXPECT_GT(counters.slidesInBed, counters.slides);
  const auto exact = slides.sound({}, nullptr);
  for (std::size_t channel = 0; channel < sound.size(); ++channel)
    EXPECT_LT(farthestApart(sound[channel], exact[channel]), 1.0);
}

/// Bandwidth (Hz) of noise with these powers by third octaves: that of white noise whose power over
/// a time fluctuates as much.
double bandwidthOf(const std::vector<double>& powers) {
  double squares = 0.0;
  double centre = 50.118723;
  for (const double power : powers) {
    squares += power * power / (0.23 * centre);
    centre *= std::pow(10.0, 0.1);
  }
  return sumOf(powers) * sumOf(powers) / squares;
}

/// Checks that the power in windows of 200 ms is that of the exact rendering, within three standard
/// deviations of the difference of two noises of their bandwidth: sqrt(2 / (B T)).
void expectSameWindows(const std::vector<double>& sound, const std::vector<double>& exact) {
  constexpr std::size_t kWindow = 9600;
  const double bandwidth = bandwidthOf(thirdOctavesOf(exact, 12000, exact.size()));
  const double deviation = std::sqrt(2.0 / (bandwidth * 0.2));
  const auto power = [](const std::vector<double>& samples, std::size_t at) {
    double sum = 0.0;
    for (std::size_t i = at; i < at + kWindow; ++i)
      sum += samples[i] * samples[i];
    return sum;
  };
  for (std::size_t at = kWindow; at + kWindow <= exact.size(); at += kWindow)
    EXPECT_NEAR(power(sound, at) / power(exact, at), 1.0, 3.0 * deviation) << at / kWindow;
}

TEST(HeardSlides, WindowsOfABedAreAsLoud) {
  const NoisySlides slides{.count = 50, .duration = 3.0};
  const auto sound = slides.sound(heard(4), nullptr);
  const auto exact = slides.sound({}, nullptr);
  expectSameWindows(sound[0], exact[0]);
}

// A contact that is pressed less and more by turns loses its voice and has it again.
TEST(HeardSlides, BetweenVoiceAndBedNothingJumps) {
  NoisySlides slides{.count = 12, .duration = 3.0};
  slides.pressed = [](double time) { return std::fmod(time, 1.0) < 0.5 ? 2.0 : 0.3; };
  SynthCounters counters;
  const auto sound = slides.sound(heard(4), &counters);
  EXPECT_GT(counters.slides, 0U);
  const auto exact = slides.sound({}, nullptr);
  expectSameWindows(sound[0], exact[0]);
}

/// The sound of some slides, with another contact of that time in their midst.
std::vector<double> soundWith(double time) {
  const NoisySlides slides{.count = 12, .duration = 0.5};
  SynthSettings settings;
  settings.lasting = LastingDetail::heard;
  Synth synth = slides.synth(settings);
  std::vector<double> all;
  for (std::size_t step = 0; step < 30; ++step) {
    for (std::size_t body = 0; body < slides.count; ++body)
      synth.updateContact(slides.state(body, step));
    if (step == 10 && time != 0.0) {
      ContactState other = slides.state(0, step);
      other.time = time;
      other.body = 998;
      other.other = 999;
      synth.updateContact(other);
    }
    const std::vector<double> part = renderPlanes<double>(synth, 800)[0];
    all.insert(all.end(), part.begin(), part.end());
  }
  return all;
}

TEST(HeardSlides, AContactAtNoTimeChangesNothing) {
  const std::vector<double> right = soundWith(0.0);
  for (const double time : {std::nan(""), HUGE_VAL, -HUGE_VAL, 1e300})
    EXPECT_TRUE(soundWith(time) == right) << time;
}

}  // namespace
}  // namespace carom::test
