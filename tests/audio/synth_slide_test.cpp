#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <memory>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "carom/audio/material.h"
#include "carom/audio/surface_texture.h"
#include "carom/audio/synth.h"
#include "tests/audio/ball_drop.h"
#include "tests/audio/ringing_box.h"
#include "tests/support/random.h"
#include "tests/support/wavy_slide.h"

namespace carom::test {
namespace {

TEST(SynthSlide, SoundsAtSpeedOverWavelength) {
  for (const double speed : {0.5, 1.0, 2.0}) {
    const std::vector<double> sound = soundOf({.speed = speed});
    const double heard = loudestFrequency(sound, 100.0, 4000.0);
    EXPECT_NEAR(heard, speed / WavySlide::kWave, 0.005 * speed / WavySlide::kWave);
  }
}

// A small sphere moved by a force m v s w has the pressure p = rho a^3 / (2 c r) w^2 v s
// cos(elevation).
TEST(SynthSlide, IsAsLoudAsTheBallThatFollowsTheFloor) {
  for (const double speed : {0.5, 1.0, 2.0}) {
    const WavySlide slide{.speed = speed};
    const double frequency = speed / WavySlide::kWave;
    const double w = 2.0 * std::numbers::pi * frequency;
    const Vec3 way = slide.listener - Vec3(0.25, 0.0, slide.radius);
    const double a = slide.radius;
    const double expected = 1.20 * a * a * a / (2.0 * 343.0 * way.norm()) * w * w * speed *
                            static_cast<double>(WavySlide::kSteepness) * way.z() / way.norm();
    // Near field and size are negligible: (k r)^2 is over 700, (k a)^2 below 0.01. The spline
    // averages the floor's 16 texels to a wave to 0.981 of its slope.
    EXPECT_NEAR(amplitudeAt(soundOf(slide), frequency), expected * 0.981, 0.03 * expected);
  }
}

TEST(SynthSlide, SoundsAlikeAtAnyStepOfTheMechanics) {
  const std::vector<double> reference = soundOf({.step = 1.0 / 1000.0});
  for (const double step : {1.0 / 60.0, 1.0 / 240.0}) {
    const std::vector<double> sound = soundOf({.step = step});
    std::vector<double> difference;
    for (std::size_t n = 0; n < sound.size(); ++n)
      difference.push_back(sound[n] - reference[n]);
    EXPECT_LT(rms(difference), 0.01 * rms(reference)) << step;
  }
}

TEST(SynthSlide, AtRestThereIsSilence) {
  EXPECT_EQ(rms(soundOf({.speed = 0.0})), 0.0);
}

// The reaction to the same impulses drives the floor's mode: where the floor's waves come at its
// frequency, it is far louder than beside it.
TEST(SynthSlide, DrivesTheModesOfWhatIsSlidOn) {
  const auto level = [](double speed) {
    const WavySlide slide{.speed = speed};
    Synth synth = synthOf(slide);
    SoundBody floor = BallDrop().floor();
    floor.texture = wavyFloor();
    floor.modal = boxOf({{.frequency = 500.0, .decayRate = 10.0}});
    EXPECT_TRUE(synth.setBody(kFloor, floor));
    play(synth, slide);
    return rms(rendered(synth, static_cast<std::size_t>(WavySlide::kDuration * WavySlide::kRate)));
  };
  EXPECT_GT(level(1.0), 10.0 * level(1.3));
}

TEST(SynthSlide, BitsDoNotDependOnTheBlocks) {
  const WavySlide slide{.speed = 1.0, .load = 0.05};
  Synth whole = synthOf(slide);
  play(whole, slide);
  const std::vector<double> expected = rendered(whole, 12000);
  Synth parts = synthOf(slide);
  play(parts, slide);
  std::vector<double> sound;
  for (std::size_t frames = 1; sound.size() < expected.size(); frames = frames * 3 % 509 + 1) {
    const auto part = rendered(parts, std::min(frames, expected.size() - sound.size()));
    sound.insert(sound.end(), part.begin(), part.end());
  }
  EXPECT_EQ(sound, expected);
  EXPECT_GT(rms(sound), 0.0);
}

/// Balls and floors of every size and weight, with textures of every resolution.
struct Crowd {
  static constexpr BodyId kCount = 12;
  std::array<double, kCount> radii{};   // m
  std::array<double, kCount> masses{};  // kg

  /// Body `kCount + i` is the floor whose texels are 1 um times 10^i.
  Synth synth() {
    SynthSettings settings;
    settings.audibleThreshold = 0.0;
    Synth made = *Synth::create(settings, {{"seat", Vec3(0.0, 0.0, 5.0)}});
    Random random(11);
    const Material steel = *findMaterial("steel");
    const auto textureOf = [](double texel) {
      return std::make_shared<const SurfaceTexture>(
          *SurfaceTexture::rough({8.0 * texel, 8.0 * texel, 0.5}, 5));
    };
    for (BodyId id = 0; id < kCount; ++id) {
      const double texel = std::pow(10.0, -6.0 + static_cast<double>(id % 7));
      radii[id] = random.logBetween(1e-3, 1.0);
      masses[id] = random.logBetween(1e-4, 1e4);
      EXPECT_TRUE(made.setBody(id, {.material = steel,
                                    .mass = masses[id],
                                    .radius = radii[id],
                                    .texture = textureOf(texel)}));
      EXPECT_TRUE(made.setBody(kCount + id, {.material = steel, .texture = textureOf(texel)}));
    }
    return made;
  }
};

/// For speeds to 100 m/s, loads to 1e6 N, maps of 1 um to 1 m and teleports the sound is finite,
/// and no louder than a ball whose whole surface moves at the highest speed that the ball can have
/// been given.
TEST(SynthSlide, NoHistoryBursts) {
  constexpr double kPause = 0.04;  // s, time for a history to fade
  constexpr double kSteepest = 15.0;
  Crowd crowd;
  Synth synth = crowd.synth();
  Random random(12);
  double before = 0.0;  // Pa, the bound of the previous history
  double loudest = 0.0;
  for (int history = 0; history < 10000; ++history) {
    const auto ball = static_cast<BodyId>(random.below(Crowd::kCount));
    const BodyId floor = Crowd::kCount + static_cast<BodyId>(random.below(Crowd::kCount));
    const double mass = crowd.masses[ball];
    const double radius = crowd.radii[ball];
    double time = kPause * history + 0.01;
    double fastest = 0.0;
    double heaviest = 0.0;
    double longest = 0.0;
    Vec3 floorPlace = random.inCube();
    Vec3 ballPlace = radius * random.direction();
    for (int index = 0; index < 4; ++index) {
      ContactState state;
      state.time = time;
      state.duration = random.logBetween(1e-4, 5e-3);
      state.phase = index == 0   ? ContactPhase::begin
                    : index == 3 ? ContactPhase::end
                                 : ContactPhase::during;
      state.body = ball;
      state.other = floor;
      state.normal = random.direction();
      state.position = random.inCube();
      state.normalLoad = random.chance(0.2) ? 0.0 : random.logBetween(1e-6, 1e6);
      state.appliedImpulse = state.normalLoad * state.duration * (state.normal + random.inCube());
      state.slipVelocity = random.logBetween(1e-4, 100.0) * random.direction();
      state.bodyPosition = state.position + radius * state.normal;
      state.bodyVelocity = state.slipVelocity;
      if (random.chance(0.1)) floorPlace = 1e6 * random.inCube();
      state.otherPathStart = floorPlace;
      floorPlace += state.duration * state.slipVelocity;
      state.otherPathEnd = floorPlace;
      state.pathStart = ballPlace;
      ballPlace = radius * (ballPlace + state.duration * state.slipVelocity).normalized();
      state.pathEnd = ballPlace;
      fastest +=
          state.slipVelocity.norm() + (state.pathEnd - state.pathStart).norm() / state.duration;
      heaviest = std::max(heaviest, state.normalLoad);
      longest = std::max(longest, state.duration);
      time += state.duration;
      synth.updateContact(state);
    }
    // Highest speed: the steepest slopes of both surfaces throw the ball up, it falls the largest
    // possible distance (1 m), and the load presses it for the longest step.
    const double slope = kSteepest * fastest;
    const double fallen = std::sqrt(2.0 * heaviest * 1.1 / mass + 4.0 * slope * slope);
    const double speed = 2.0 * (slope + fallen + heaviest / mass * longest);
    const double away = 5.0 - std::sqrt(3.0) - radius;  // m, least distance of its surface
    // The bound is a sphere whose whole surface moves at that speed; twice, for the band's
    // overshoot.
    const double bound = 2.0 * 1.2 * 343.0 * speed * std::min(1.0, radius / away);
    for (const double pressure : rendered(synth, static_cast<std::size_t>(kPause * 48000.0))) {
      ASSERT_TRUE(std::isfinite(pressure)) << history;
      ASSERT_LE(std::abs(pressure), std::max(bound, before)) << history;
      loudest = std::max(loudest, std::abs(pressure));
    }
    before = bound;
  }
  EXPECT_GT(synth.counters().slides, 5000U);
  EXPECT_GT(loudest, 1.0);
}

}  // namespace
}  // namespace carom::test
