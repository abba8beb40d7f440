#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include <gtest/gtest.h>

#include "audio/model/third_octaves.h"
#include "carom/audio/synth.h"
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

// What is left out as below hearing is so in every third octave of the exact rendering, all of it
// together.
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

}  // namespace
}  // namespace carom::test
