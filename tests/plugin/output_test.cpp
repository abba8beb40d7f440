#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "carom/sound.h"
#include "tests/bullet_bridge/sphere_world.h"
#include "tests/plugin/offline_sound.h"
#include "tests/support/constants.h"
#include "tests/support/no_alloc_scope.h"

namespace carom {
namespace {

using namespace test;

constexpr double kSpeedOfSound = 343.0;  // m/s
constexpr double kRadius = 0.01;         // m
constexpr double kHeight = 0.5;          // m, height of the listener
constexpr std::size_t kBlock = 512;

using Channels = std::vector<std::vector<float>>;

// A steel ball that falls 0.2 m onto a floor and bounces there, heard from right above it.
struct BouncingBall {
  SphereBulletWorld bullet{9.81};

  explicit BouncingBall(double restitution = 0.8) {
    bullet.addPlane(Vec3::UnitY(), 0.0, 1.0);
    bullet.addBall({.radius = kRadius,
                    .mass = 8940.0 * 4.0 / 3.0 * std::numbers::pi * std::pow(kRadius, 3),
                    .position = {0.0, kRadius + 0.2, 0.0},
                    .restitution = restitution});
  }

  Sound attach(SoundSettings settings = {}) {
    if (settings.listeners.empty()) settings.listeners = {{"above", {0.0, kHeight, 0.0}}};
    return test::attachOffline(bullet.world, settings);
  }

  void frame() { bullet.world.stepSimulation(btScalar(1.0 / 60.0), 10, btScalar(1.0 / 240.0)); }
};

Channels play(BouncingBall& ball, Sound& sound, double seconds = 0.35) {
  Channels channels;
  for (int frame = 0; frame < static_cast<int>(seconds * 60.0); ++frame) {
    ball.frame();
    test::takeReady(sound, channels);
  }
  return channels;
}

std::size_t loudestAt(const std::vector<float>& samples) {
  const auto loudest = std::max_element(samples.begin(), samples.end(),
                                        [](float a, float b) { return std::abs(a) < std::abs(b); });
  return static_cast<std::size_t>(loudest - samples.begin());
}

double loudest(const std::vector<float>& samples) {
  return std::abs(static_cast<double>(samples[loudestAt(samples)]));
}

double samplesBetween(const std::vector<float>& earlier, const std::vector<float>& later) {
  return static_cast<double>(loudestAt(later)) - static_cast<double>(loudestAt(earlier));
}

// Sound at a listener that walks from kHeight to `height` (m above the floor) before the ball
// lands, 0.2 s after the begin.
std::vector<float> heardAfterAWalkTo(double height) {
  BouncingBall ball;
  Sound sound = ball.attach();
  Channels channels;
  for (int frame = 0; frame < 21; ++frame) {
    ball.frame();
    const double share = std::min(1.0, sound.time() / 0.15);
    const Vec3 place(0.0, kHeight + share * (height - kHeight), 0.0);
    EXPECT_TRUE(sound.setListener(place));
    test::takeReady(sound, channels);
  }
  return channels[0];
}

TEST(SoundListeners, AreHeardWhereTheyHaveMovedTo) {
  const std::vector<float> stayed = heardAfterAWalkTo(kHeight);
  for (const double height : {0.25, 2.0}) {
    const std::vector<float> moved = heardAfterAWalkTo(height);
    // The sound comes later if the listener is farther away, and earlier if nearer.
    EXPECT_NEAR(samplesBetween(stayed, moved), (height - kHeight) / kSpeedOfSound * kRate, 1.5);
    // The level goes with 1/r from the ball's centre; the near field adds a few percent at the
    // nearer place.
    const double ratio = (kHeight - kRadius) / (height - kRadius);
    EXPECT_NEAR(loudest(moved) / loudest(stayed), ratio, 0.06 * ratio) << height;
  }
}

TEST(SoundListeners, AreRefusedWhereThereIsNoneAndWithoutAPose) {
  BouncingBall ball;
  Sound sound = ball.attach();
  EXPECT_EQ(sound.time(), 0.0);
  ball.bullet.step(1.0 / 60.0);
  EXPECT_NEAR(sound.time(), 1.0 / 60.0, 1e-8);
  EXPECT_FALSE(sound.setListener({0.0, kHeight, 0.0}, Quat::Identity(), 1));
  EXPECT_FALSE(sound.setListener({0.0, std::nan(""), 0.0}));
  EXPECT_FALSE(sound.setListener({0.0, kHeight, 0.0}, Quat(0.0, 0.0, 0.0, 0.0)));
  EXPECT_TRUE(sound.setListener({0.0, kHeight, 0.0}));
  EXPECT_FALSE(sound.setListener({0.0, 1e300, 0.0}));   // so far off that it hears nothing
  EXPECT_TRUE(sound.setListener({0.0, kHeight, 1e6}));  // for the same time the last call counts
  ball.bullet.step(1.0 / 60.0);
  EXPECT_TRUE(sound.setListener({0.0, kHeight, 1e6}));  // too fast for a motion: the listener jumps
}

TEST(SoundListeners, AreWhereTheyWereLastToldToBe) {
  const auto heard = [](const std::vector<Vec3>& places) {
    BouncingBall ball;
    Sound sound = ball.attach();
    for (const Vec3& place : places)
      EXPECT_TRUE(sound.setListener(place));
    return play(ball, sound)[0];
  };
  const Vec3 near(0.0, 0.5 * kHeight, 0.0);
  const Vec3 far(0.0, 50.0, 0.0);
  ASSERT_NE(heard({near}), heard({far}));
  EXPECT_EQ(heard({far, near}), heard({near}));
  EXPECT_EQ(heard({near, near, far}), heard({far}));
}

TEST(SoundListeners, OfTwoFormatsFillTheirChannels) {
  BouncingBall ball;
  SoundSettings settings;
  Listener pair{"pair", {0.0, kHeight, 0.0}};
  pair.format = ListenerFormat::spacedPair;
  pair.spacing = 0.4;
  // The pair's right is down: that microphone is 0.2 m nearer to the ball, and the left one 0.2 m
  // farther.
  pair.orientation = Quat(Eigen::AngleAxisd(-0.5 * std::numbers::pi, Vec3::UnitZ()));
  settings.listeners = {{"above", {0.0, kHeight, 0.0}}, pair};
  Sound sound = ball.attach(settings);
  ASSERT_EQ(sound.channelCount(), 3U);
  const Channels channels = play(ball, sound);
  EXPECT_NEAR(samplesBetween(channels[0], channels[1]), 0.2 / kSpeedOfSound * kRate, 1.5);
  EXPECT_NEAR(samplesBetween(channels[2], channels[0]), 0.2 / kSpeedOfSound * kRate, 1.5);
}

// A wall is beside the ball: its echo comes later, as its way is longer.
TEST(SoundSettings, OfTheSynthAreHandedOn) {
  constexpr double kWall = 1.0;  // m from the ball
  BouncingBall open;
  Sound inOpenAir = open.attach();
  const std::vector<float> direct = play(open, inOpenAir)[0];
  BouncingBall beside;
  SoundSettings settings;
  settings.synth.room.reflectors = {{.normal = Vec3::UnitX(), .offset = -kWall, .absorption = {}}};
  Sound inRoom = beside.attach(settings);
  const std::vector<float> both = play(beside, inRoom)[0];
  ASSERT_EQ(both.size(), direct.size());
  std::vector<float> echo = both;
  for (std::size_t sample = 0; sample < echo.size(); ++sample)
    echo[sample] -= direct[sample];
  const double up = kHeight - kRadius;
  const double longer = std::hypot(2.0 * kWall, up) - up;
  EXPECT_NEAR(samplesBetween(direct, echo), longer / kSpeedOfSound * kRate, 1.5);
  EXPECT_GT(loudest(echo), 0.01 * loudest(direct));
}

TEST(SoundOutput, FullScaleIsThePressureOfASampleOfOne) {
  BouncingBall first;
  BouncingBall second;
  SoundSettings settings;
  settings.fullScale = 20.0;
  Sound inPascals = first.attach();
  Sound ofFullScale = second.attach(settings);
  const std::vector<float> pressure = play(first, inPascals)[0];
  const std::vector<float> samples = play(second, ofFullScale)[0];
  ASSERT_EQ(samples.size(), pressure.size());
  for (std::size_t sample = 0; sample < samples.size(); ++sample)
    EXPECT_FLOAT_EQ(samples[sample], pressure[sample] / 20.0F);
  EXPECT_EQ(ofFullScale.outputDelay(), 0U);
  EXPECT_EQ(ofFullScale.statistics().gainReduction, 0.0);
}

// The landing's peak is 3.8 Pa.
TEST(SoundOutput, TheLimiterKeepsSamplesAtOrBelowFullScale) {
  BouncingBall ball;
  SoundSettings settings;
  settings.fullScale = 0.5;
  settings.limiter.emplace();
  Sound sound = ball.attach(settings);
  const std::vector<float> samples = play(ball, sound)[0];
  EXPECT_LE(loudest(samples), 1.0);
  EXPECT_GT(loudest(samples), 0.9);
  EXPECT_NEAR(sound.statistics().gainReduction, 20.0 * std::log10(3.8 / 0.5), 1.0);
}

TEST(SoundOutput, TheLimiterOnlyDelaysWhatIsBelowFullScale) {
  BouncingBall first;
  BouncingBall second;
  SoundSettings settings;
  settings.limiter.emplace();
  settings.limiter->ceiling = 10.0F;
  Sound plain = first.attach();
  Sound limited = second.attach(settings);
  ASSERT_NEAR(static_cast<double>(limited.outputDelay()), 2e-3 * kRate, 1.0);
  std::vector<float> expected = play(first, plain)[0];
  const std::vector<float> samples = play(second, limited)[0];
  expected.insert(expected.begin(), limited.outputDelay(), 0.0F);
  expected.resize(samples.size());
  EXPECT_EQ(samples, expected);
}

TEST(SoundOutput, RefusesWhatNoScaleAndNoLimiterCanBe) {
  BouncingBall ball;
  for (const double fullScale : {0.0, -1.0, 1e-320, std::nan(""), HUGE_VAL})
    EXPECT_FALSE(Sound::attach(ball.bullet.world, {.fullScale = fullScale})) << fullScale;
  SoundSettings settings;
  settings.limiter.emplace();
  settings.limiter->ceiling = 0.0F;
  EXPECT_FALSE(Sound::attach(ball.bullet.world, settings));
}

// Full scale and limiter are on, so that the samples pass every stage.
TEST(SoundOutput, RenderingAllocatesNothing) {
  BouncingBall ball(1.0);
  SoundSettings settings;
  settings.fullScale = 0.5;
  settings.limiter.emplace();
  Sound sound = ball.attach(settings);
  std::array<float, kBlock> block{};
  float* const channel = block.data();
  std::size_t allocations = 0;
  for (int frame = 0; frame < 120; ++frame) {
    ball.frame();
    const test::NoAllocScope scope;
    while (sound.framesReady() > 0)
      sound.render(std::span<float* const>(&channel, 1), std::min(sound.framesReady(), kBlock));
    allocations += scope.allocations();
  }
  EXPECT_GT(sound.statistics().events, 2U);
  EXPECT_EQ(allocations, 0U);
}

}  // namespace
}  // namespace carom
