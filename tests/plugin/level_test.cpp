// Loudness with nothing set: the level of recordings and of what is played, and the listener of a
// world that nobody has placed.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <sndfile.h>

#include "carom/event_sound.h"
#include "carom/sound.h"
#include "tests/bullet_bridge/sphere_world.h"
#include "tests/plugin/offline_sound.h"
#include "tests/support/ordinary_worlds.h"
#include "tests/support/temporary_folder.h"

namespace carom {
namespace {

namespace fs = std::filesystem;
using Channels = std::vector<std::vector<float>>;

constexpr double kRate = 48000.0;

double decibels(double ratio) {
  return 20.0 * std::log10(ratio);
}

double peakOf(const Channels& channels) {
  double peak = 0.0;
  for (const std::vector<float>& channel : channels)
    peak = std::max(peak, test::peakOf(channel));
  return peak;
}

/// A sound file as it was read.
struct ReadFile {
  Channels channels;
  std::string comment;
  int format = 0;
};

ReadFile read(const fs::path& path) {
  SF_INFO info = {};
  SNDFILE* const file = sf_open(path.c_str(), SFM_READ, &info);
  EXPECT_NE(file, nullptr) << path;
  if (file == nullptr) return {};
  std::vector<float> samples(static_cast<std::size_t>(info.frames * info.channels));
  sf_readf_float(file, samples.data(), info.frames);
  const char* const comment = sf_get_string(file, SF_STR_COMMENT);
  ReadFile all{
      .channels = {samples}, .comment = comment != nullptr ? comment : "", .format = info.format};
  sf_close(file);
  return all;
}

/// A limiter far above everything: samples are those in front of the one that would be there.
LimiterSettings highLimiter() {
  LimiterSettings limiter;
  limiter.ceiling = 1e6F;
  return limiter;
}

/// Returns the longest time (s) for which a limiter with its ceiling at -1 dB turns the samples
/// down by more than 6 dB, between samples that tell.
double longestStrongLimiting(const Channels& samples) {
  Limiter limiter = *Limiter::create({.channels = samples.size(), .ceiling = 0.8912509F});
  Channels limited = samples;
  std::vector<float*> pointers;
  for (std::vector<float>& channel : limited)
    pointers.push_back(channel.data());
  limiter.process(pointers, limited[0].size());
  std::size_t longest = 0;
  std::size_t since = 0;  // samples since it turned down by less
  for (std::size_t frame = limiter.latency(); frame < limited[0].size(); ++frame, ++since)
    for (std::size_t channel = 0; channel < samples.size(); ++channel) {
      const float before = std::abs(samples[channel][frame - limiter.latency()]);
      const bool isStrong = std::abs(limited[channel][frame]) < 0.5F * before;
      if (before > 1e-5F && !isStrong) since = 0;
      if (isStrong) longest = std::max(longest, since);
    }
  return static_cast<double>(longest) / kRate;
}

class OrdinaryLevels : public testing::TestWithParam<OrdinaryWorldKind> {};

// The first second of each world, with nothing set but what makes it deterministic.
TEST_P(OrdinaryLevels, AreInRangeWithNothingSet) {
  const test::TemporaryFolder folder;
  const std::unique_ptr<OrdinaryWorld> ordinary = GetParam().make();
  SoundSettings settings;
  settings.record = folder / "world.wav";
  settings.level = Level::automatic;  // of the samples that are pulled, as `play` has it
  settings.limiter = highLimiter();
  Sound sound = test::attachOffline(ordinary->world(), settings,
                                    {.radiators = RadiatorChoice::equivalentSphere});
  Channels played;
  while (ordinary->time() < 1.0) {
    ordinary->step(60.0);
    test::takeReady(sound, played);
  }
  const bool isCalm = sound.statistics().events == 0;  // everything has come to lie without a blow
  ASSERT_TRUE(sound.close());
  const ReadFile file = read(settings.record);
  if (isCalm && peakOf(file.channels) == 0.0) return;
  EXPECT_NEAR(decibels(peakOf(file.channels)), -3.0, 0.01);
  EXPECT_TRUE(file.comment.starts_with("full scale ")) << file.comment;
  EXPECT_TRUE(file.comment.ends_with(" Pa")) << file.comment;
  EXPECT_GT(decibels(peakOf(played)), -18.0);
  EXPECT_LT(longestStrongLimiting(played), 0.05);
}

std::string nameOf(const testing::TestParamInfo<OrdinaryWorldKind>& info) {
  return std::string(info.param.name);
}
INSTANTIATE_TEST_SUITE_P(Worlds, OrdinaryLevels,
                         testing::ValuesIn(ordinaryWorlds().begin(), ordinaryWorlds().end()),
                         nameOf);

/// A steel ball that falls 0.2 m onto a plane.
struct FallingBall {
  SphereBulletWorld bullet{9.81};
  btRigidBody* ball = nullptr;

  FallingBall() {
    bullet.addPlane(Vec3::UnitY(), 0.0, 1.0);
    ball = &bullet.addBall({.radius = 0.01, .mass = 0.033, .position = {3.0, 0.21, 2.0}});
  }

  /// Steps for so long, and returns what is heard.
  Channels play(Sound& sound, double seconds) {
    Channels channels;
    for (int frame = 0; frame < static_cast<int>(60.0 * seconds); ++frame) {
      bullet.world.stepSimulation(btScalar(1.0 / 60.0), 10, btScalar(1.0 / 240.0));
      test::takeReady(sound, channels);
    }
    return channels;
  }
};

TEST(AutomaticListener, IsThereFromTheFirstBlowUnmovedByWhatFallsOutOfTheWorld) {
  const auto heard = [](bool hasFallen) {
    FallingBall world;
    for (int extra = 0; extra < 3; ++extra)
      world.bullet.addBall(
          {.radius = 0.01, .mass = 0.033, .position = {3.1 + 0.1 * extra, 0.01, 2.0}});
    if (hasFallen)
      world.bullet.addBall({.radius = 0.01, .mass = 0.033, .position = {3.0, -1e6, 2.0}});
    Sound sound = test::attachOffline(world.bullet.world, {});
    return world.play(sound, 0.4);
  };
  const Channels alone = heard(false);
  EXPECT_GT(peakOf(alone), 0.1);
  EXPECT_EQ(alone, heard(true));
}

TEST(AutomaticListener, GivesWayToThatOfTheHost) {
  const Vec3 place(3.0, 0.4, 2.5);
  SoundSettings settings;
  settings.listeners = {SoundSettings::defaultListener()};
  settings.listeners.front().position = place;
  FallingBall first;
  Sound chosen = test::attachOffline(first.bullet.world, settings);
  const Channels expected = first.play(chosen, 0.4);
  FallingBall second;
  Sound sound = test::attachOffline(second.bullet.world, {});
  EXPECT_TRUE(sound.setListener(place));
  EXPECT_EQ(second.play(sound, 0.4), expected);
}

// The same world in centimetres.
TEST(AutomaticListener, StandsWhereItWouldInMetres) {
  const auto reportOf = [](double units) {
    SphereBulletWorld bullet(9.81 * units);
    bullet.addPlane(Vec3::UnitY(), 0.0, 1.0);
    bullet.addBall({.radius = 0.05 * units,
                    .mass = 4.1,
                    .position = {0.0, 0.6 * units, 0.0},
                    .restitution = 0.8});
    Sound sound = test::attachOffline(bullet.world, {}, {.metresPerUnit = 1.0 / units});
    Channels channels;
    for (int step = 0; step < 120; ++step) {
      bullet.step(1.0 / 240.0);
      test::takeReady(sound, channels);
    }
    EXPECT_GT(peakOf(channels), 0.1);
    const std::string words = sound.report();
    return words.substr(words.find("The listener"), words.find("where a camera"));
  };
  EXPECT_EQ(reportOf(100.0), reportOf(1.0));
}

TEST(AutomaticListener, FollowsABodyThatLeavesItsView) {
  const auto peakAfterAJump = [](const Vec3& to) {
    FallingBall world;
    world.ball->forceActivationState(DISABLE_DEACTIVATION);
    Sound sound = test::attachOffline(world.bullet.world, {});
    world.play(sound, 0.5);
    btTransform pose = btTransform::getIdentity();
    pose.setOrigin(SphereBulletWorld::toBullet(to));
    world.ball->setCenterOfMassTransform(pose);
    world.ball->setLinearVelocity(btVector3(0, 0, 0));
    world.ball->setGravity(btVector3(0, 0, 0));
    world.play(sound, 12.0);  // it hangs there, and the listener comes
    world.ball->setGravity(btVector3(0, btScalar(-9.81), 0));
    return peakOf(world.play(sound, 0.5));
  };
  const double here = peakAfterAJump({3.0, 0.21, 2.0});
  EXPECT_NEAR(decibels(peakAfterAJump({9.0, 0.21, -4.0}) / here), 0.0, 1.0);
}

TEST(AutomaticLevel, IsNotThatOfPulledSamplesUnlessAskedFor) {
  FallingBall first;
  SoundSettings settings;
  Sound pascals = test::attachOffline(first.bullet.world, settings);
  const double pressure = peakOf(first.play(pascals, 0.4));
  EXPECT_NEAR(pascals.statistics().peak, pressure, 1e-6 * pressure);
  EXPECT_EQ(pascals.statistics().peakSample, 0.0);
  FallingBall second;
  settings.level = Level::automatic;
  Sound exposed = test::attachOffline(second.bullet.world, settings);
  const double sample = peakOf(second.play(exposed, 0.4));
  EXPECT_GT(decibels(sample), -18.0);
  EXPECT_LE(decibels(sample), -1.0 + 1e-4);
  EXPECT_NEAR(exposed.statistics().peak, pressure, 1e-6 * pressure);
}

TEST(AutomaticLevel, GivesTheSameBitsEachTime) {
  const auto played = [] {
    FallingBall world;
    Sound sound = test::attachOffline(world.bullet.world, {.level = Level::automatic});
    return world.play(sound, 0.5);
  };
  EXPECT_EQ(played(), played());
}

TEST(AutomaticLevel, OfARecordingIsItsPressureOverAFullScaleInTheFile) {
  const test::TemporaryFolder folder;
  const auto recorded = [&](const std::string& name, SoundSettings settings) {
    FallingBall world;
    settings.record = folder / name;
    Sound sound = test::attachOffline(world.bullet.world, settings);
    world.play(sound, 0.4);
    EXPECT_TRUE(sound.close());
    return read(settings.record);
  };
  const ReadFile fixed = recorded("fixed.wav", {.level = Level::fixed});
  const ReadFile automatic = recorded("automatic.wav", {});
  EXPECT_EQ(fixed.comment, "full scale 20 Pa");
  EXPECT_EQ(automatic.format, SF_FORMAT_WAVEX | SF_FORMAT_FLOAT);
  EXPECT_NEAR(decibels(peakOf(automatic.channels)), -3.0, 0.001);
  const double fullScale = std::stod(automatic.comment.substr(std::string("full scale ").size()));
  ASSERT_EQ(automatic.channels[0].size(), fixed.channels[0].size());
  for (std::size_t sample = 0; sample < fixed.channels[0].size(); ++sample) {
    const double pressure = 20.0 * static_cast<double>(fixed.channels[0][sample]);
    EXPECT_NEAR(fullScale * static_cast<double>(automatic.channels[0][sample]), pressure,
                1e-5 * std::abs(pressure) + 1e-12);
  }
}

TEST(Recordings, AreRefusedUnderNamesOfOtherFormats) {
  const test::TemporaryFolder folder;
  EventSound sound = *EventSound::create();
  for (const char* name : {"a.mp3", "a.flac", "a", "a.wav.txt"}) {
    const Status refused = sound.record(folder / name);
    ASSERT_FALSE(refused) << name;
    EXPECT_NE(refused.error().message.find(".wav"), std::string::npos) << refused.error().message;
    EXPECT_FALSE(fs::exists(folder / name));
  }
  EXPECT_TRUE(sound.record(folder / "A.WAV"));
}

TEST(PeakWarning, SaysByHowMuchAFullScaleIsExceeded) {
  FallingBall world;
  Sound sound = test::attachOffline(world.bullet.world, {.fullScale = 1e-3});
  EXPECT_TRUE(sound.statistics().warning.empty());
  world.play(sound, 0.4);
  const SoundStatistics statistics = sound.statistics();
  EXPECT_NEAR(statistics.peakSample, 1e3 * statistics.peak, 1e-3 * statistics.peakSample);
  EXPECT_NE(statistics.warning.find("above full scale, 0.001 Pa"), std::string::npos)
      << statistics.warning;
}

TEST(PeakWarning, IsOnStderrAtTheEndIfNobodyHasSeenIt) {
  for (const bool looks : {false, true}) {
    FallingBall world;
    Sound sound = test::attachOffline(world.bullet.world, {.fullScale = 1e-3});
    world.play(sound, 0.4);
    if (looks) (void)sound.statistics();
    testing::internal::CaptureStderr();
    EXPECT_TRUE(sound.close());
    EXPECT_EQ(testing::internal::GetCapturedStderr().starts_with("carom: the loudest"), !looks);
  }
}

}  // namespace
}  // namespace carom
