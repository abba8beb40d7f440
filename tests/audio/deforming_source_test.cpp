#include "audio/radiation/deforming_source.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/constants.h"

namespace carom {

using namespace audio;

namespace {

using namespace test;

constexpr double kDuration = 0.3;  // s

/// The rendered sound is compared from the frame `kSkipped` on, after the beginning.
constexpr std::size_t kSkipped = 4800;
template <typename At>
std::vector<double> soundOf(double step, const Vec3& listener, At at) {
  auto source = DeformingSource::create({.step = step});
  EXPECT_TRUE(source);
  // States are added just ahead of the time at which the sound is asked for, as a run does it.
  std::vector<double> sound;
  int states = 0;
  for (int n = 0; n < static_cast<int>(kDuration * 48000.0); ++n) {
    const double time = n / 48000.0;
    for (; states * step <= time + source->lookahead(); ++states)
      source->add(at(states * step));
    source->forgetBefore(time - 0.15);
    sound.push_back(source->at(listener, time).pressure);
  }
  return sound;
}

double largest(const std::vector<double>& sound) {
  double most = 0.0;
  for (std::size_t n = kSkipped; n < sound.size(); ++n)
    most = std::max(most, std::abs(sound[n]));
  return most;
}

// p is proportional to V'' = -w^2 A sin w (t - r/c); the steps are coarser and finer than samples.
TEST(DeformingSource, AVolumeThatSwingsIsAMonopole) {
  const Medium medium;
  const Vec3 listener(0.0, 1.2, 0.9);
  for (const double step : {1e-3, 1.7e-4, 1.0 / 48000.0, 5e-6}) {
    const double w = 2.0 * kPi * std::min(220.0, 0.1 / step);
    const auto sound = soundOf(step, listener, [&](double t) {
      return DeformingState{.volume = 1.0 + 1e-4 * std::sin(w * t)};
    });
    const double scale = medium.density / (4.0 * kPi * 1.5) * 1e-4 * w * w;
    double farthest = 0.0;
    for (std::size_t n = kSkipped; n < sound.size(); ++n) {
      const double t = static_cast<double>(n) / 48000.0 - 1.5 / medium.speedOfSound;
      farthest = std::max(farthest, std::abs(sound[n] + scale * std::sin(w * t)));
    }
    EXPECT_LT(farthest, 3e-4 * scale) << step;
  }
}

// p = rho / (4 pi) (n . D'' / (r c) + n . D' / r^2), along and across.
TEST(DeformingSource, ABodyThatSwingsIsADipole) {
  const Medium medium;
  const double w = 2.0 * kPi * 90.0;
  const auto swinging = [&](double t) {
    return DeformingState{.volume = 1.0, .dipole = {0.0, 0.02 * std::sin(w * t), 0.0}};
  };
  const double r = 0.7;
  const auto along = soundOf(1e-3, {0.0, r, 0.0}, swinging);
  const double far = 0.02 * w * w / (r * medium.speedOfSound);
  const double near = 0.02 * w / (r * r);
  EXPECT_NEAR(largest(along), medium.density / (4.0 * kPi) * std::hypot(far, near),
              1e-3 * largest(along));
  EXPECT_LT(largest(soundOf(1e-3, {r, 0.0, 0.0}, swinging)), 1e-10 * largest(along));
}

TEST(DeformingSource, WhatStandsStillOrMovesEvenlyIsSilent) {
  const auto sound = soundOf(1e-3, {2.0, 0.0, 0.0}, [](double t) {
    return DeformingState{
        .volume = 0.3, .position = {0.1 * t, 0.0, 0.0}, .dipole = {0.05, 0.0, 0.0}};
  });
  EXPECT_EQ(largest(sound), 0.0);
}

// A tone of the mechanics above the audio's Nyquist frequency is not heard below it, nor are the
// images of coarse steps.
TEST(DeformingSource, NothingAliases) {
  const auto tone = [](double frequency) {
    return [frequency](double t) {
      return DeformingState{.volume = 1.0 + 1e-6 * std::sin(2.0 * kPi * frequency * t)};
    };
  };
  const double heard = largest(soundOf(1e-5, {1.0, 0.0, 0.0}, tone(10000.0)));
  EXPECT_LT(largest(soundOf(1e-5, {1.0, 0.0, 0.0}, tone(30000.0))), 1e-3 * heard);
  // A tone of 220 Hz at steps of 1 ms has nothing at 780 Hz, where it would fold to. 300 ms hold
  // whole periods of both.
  const auto coarse = soundOf(1e-3, {1.0, 0.0, 0.0}, tone(220.0));
  const auto levelAt = [&](double frequency) {
    double cosine = 0.0;
    double sine = 0.0;
    for (std::size_t n = kSkipped; n < coarse.size(); ++n) {
      const double angle = 2.0 * kPi * frequency * static_cast<double>(n) / 48000.0;
      cosine += coarse[n] * std::cos(angle);
      sine += coarse[n] * std::sin(angle);
    }
    return std::hypot(cosine, sine);
  };
  EXPECT_LT(levelAt(780.0), 1e-3 * levelAt(220.0));
  EXPECT_LT(levelAt(1220.0), 1e-3 * levelAt(220.0));
}

TEST(DeformingSource, ComesLaterFromFartherAway) {
  // The volume jumps, smoothly, at 0.15 s; 34.3 m away the jump is heard 0.1 s later.
  const auto sound = soundOf(1e-4, {34.3, 0.0, 0.0}, [](double t) {
    return DeformingState{.volume = 1.0 + 1e-3 * std::tanh((t - 0.15) / 1e-3)};
  });
  const auto loudest = std::ranges::max_element(sound) - sound.begin();
  const Medium medium;
  EXPECT_NEAR(static_cast<double>(loudest) / 48000.0, 0.15 + 34.3 / medium.speedOfSound, 1e-3);
}

TEST(DeformingSource, IsHeardFromWhereItWas) {
  auto source = DeformingSource::create({.step = 1e-3});
  for (int index = 0; index < 400; ++index)
    source->add({.volume = 1.0, .position = {10.0 * index * 1e-3, 0.0, 0.0}});
  const Medium medium;
  // The source moves at 10 m/s and is heard from 34 m aside.
  const Vec3 towards = source->at({0.0, 34.0, 0.0}, 0.3).towardsSource;
  EXPECT_NEAR(towards.x(), 10.0 * (0.3 - towards.norm() / medium.speedOfSound), 1e-9);
  EXPECT_NEAR(towards.y(), -34.0, 1e-12);
}

TEST(DeformingSource, WhatIsNoneIsRefused) {
  EXPECT_FALSE(DeformingSource::create({.step = 0.0}));
  EXPECT_FALSE(DeformingSource::create({.step = 1e-3, .sampleRate = NAN}));
  EXPECT_FALSE(DeformingSource::create({.step = 1e-3, .medium = {.density = -1.0}}));
  const auto source = DeformingSource::create({.step = 1e-3});
  ASSERT_TRUE(source);
  EXPECT_EQ(source->at(Vec3::Zero(), 0.0).pressure, 0.0);
}

}  // namespace
}  // namespace carom
