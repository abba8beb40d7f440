#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <random>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "audio/model/third_octaves.h"
#include "carom/audio/material.h"
#include "carom/audio/synth.h"
#include "tests/audio/ball_drop.h"
#include "tests/support/noisy_slides.h"

namespace carom::test {
namespace {

constexpr double kRate = 48000.0;  // Hz
constexpr double kDuration = 3.0;  // s

/// Balls of wood that tap on a floor, at speeds between two, evenly by their logarithms.
struct Taps {
  double radius = 0.05;  // m
  double slowest = 0.0;  // m/s
  double fastest = 0.0;  // m/s
  double each = 2e-3;    // s, mean between two taps

  std::vector<double> sound(LastingDetail detail, SynthCounters& counters) const {
    SynthSettings settings;
    settings.lasting = detail;
    settings.audibleThreshold = detail == LastingDetail::exact ? 0.0 : settings.audibleThreshold;
    Synth synth = *Synth::create(settings, {Listener{"ear", {0.0, -2.0, 1.0}}});
    const Material wood = *findMaterial("wood");
    const double mass = wood.density * 4.0 / 3.0 * std::numbers::pi * std::pow(radius, 3);
    EXPECT_TRUE(synth.setBody(0, {.material = wood}));
    EXPECT_TRUE(synth.setBody(1, {.material = wood, .mass = mass, .radius = radius}));
    std::mt19937 random(3);
    std::uniform_real_distribution<double> share(0.0, 1.0);
    for (double time = 0.1; time < kDuration - 0.1; time += 2.0 * each * share(random)) {
      ImpulseEvent tap;
      tap.time = time;
      tap.body = 1;
      tap.other = 0;
      tap.normal = Vec3::UnitZ();
      tap.approachSpeed = slowest * std::pow(fastest / slowest, share(random));
      tap.effectiveMass = mass;
      tap.impulse = 1.5 * mass * tap.approachSpeed * Vec3::UnitZ();
      tap.radius = radius;
      tap.bodyPosition = radius * Vec3::UnitZ();
      synth.schedule(tap);
    }
    std::vector<double> samples(static_cast<std::size_t>(kDuration * kRate));
    double* const channel = samples.data();
    synth.render<double>(std::span(&channel, 1), samples.size());
    counters = synth.counters();
    return samples;
  }
};

std::vector<double> octavesOf(const std::vector<double>& sound) {
  return thirdOctavesOf(sound, 4800, sound.size() - 4800);
}

TEST(HeardClicks, WhatIsInaudibleIsBelowHearing) {
  for (const double radius : {0.005, 0.05, 0.3, 1.0}) {
    const Taps taps{.radius = radius, .slowest = 1e-7, .fastest = 1e-3};
    SynthCounters exact;
    SynthCounters counters;
    std::vector<double> missing = taps.sound(LastingDetail::exact, exact);
    const std::vector<double> heard = taps.sound(LastingDetail::heard, counters);
    EXPECT_GT(counters.inaudible, 100U) << radius;
    for (std::size_t i = 0; i < missing.size(); ++i)
      missing[i] -= heard[i];
    const std::vector<double> powers = octavesOf(missing);
    const std::vector<double> all = octavesOf(heard);
    for (std::size_t band = 0; band < powers.size(); ++band)
      EXPECT_LT(powers[band], audio::hearingThreshold()[band] + 1e-2 * all[band])
          << radius << " m, band " << band;
  }
}

TEST(HeardClicks, WhatIsMaskedLeavesTheWholeAsItIs) {
  const Taps taps{.radius = 0.02, .slowest = 1e-3, .fastest = 3.0, .each = 1e-3};
  SynthCounters exact;
  SynthCounters counters;
  const std::vector<double> all = octavesOf(taps.sound(LastingDetail::exact, exact));
  const std::vector<double> heard = octavesOf(taps.sound(LastingDetail::heard, counters));
  EXPECT_EQ(exact.masked, 0U);
  EXPECT_GT(counters.masked, 500U);
  for (std::size_t band = 0; band < all.size(); ++band) {
    if (all[band] <= audio::hearingThreshold()[band]) continue;
    // Left out is 1/1000 of the energy, whose pressure adds up with the rest: by 0.27 dB at most.
    EXPECT_NEAR(10.0 * std::log10(heard[band] / all[band]), 0.0, 0.28) << band;
  }
}

// A loud event far ahead, as of a clock that was wrong, masks nothing that comes before it.
TEST(HeardClicks, OfATimeFarAheadMaskNothingBefore) {
  const auto heardAfter = [](double time) {
    SynthSettings settings;
    settings.lasting = LastingDetail::heard;
    const BallDrop loud{.radius = 0.05, .speed = 10.0, .time = time};
    Synth synth = makeSynth(loud, {Listener{"ear", {0.0, -2.0, 1.0}}}, settings);
    synth.schedule(loud.event());
    for (int i = 0; i < 200; ++i) {
      ImpulseEvent tap = loud.event();
      tap.time = 0.01 * i;
      tap.impulse *= 3e-3;
      synth.schedule(tap);
    }
    return synth.counters().masked;
  };
  EXPECT_EQ(heardAfter(1e6), heardAfter(-1e6));
}

}  // namespace
}  // namespace carom::test
