#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <btBulletDynamicsCommon.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "carom/sound.h"
#include "tests/audio/ringing_box.h"
#include "tests/bullet_bridge/sphere_world.h"
#include "tests/plugin/offline_sound.h"

// Tests what a host asks of a sound: materials, a report, listeners in Bullet's types, and worlds
// whose unit is not the metre.

namespace carom {
namespace {

using testing::HasSubstr;
using testing::Not;
using Channels = std::vector<std::vector<float>>;

/// A ball of 1 cm and 30 g, 7162 kg/m^3, that falls by 9 cm on a floor. Lengths are in units of
/// which `perMetre` make a metre.
struct FallingBall {
  explicit FallingBall(double perMetre = 1.0, double mass = 0.03)
      : bullet(9.81 * perMetre),
        ball(bullet.addBall({.radius = 0.01 * perMetre,
                             .mass = mass,
                             .position = {0, 0.1 * perMetre, 0},
                             .restitution = 0.8})) {}
  void fall(Sound& sound, Channels& channels) {
    for (int step = 0; step < 48; ++step) {
      bullet.step(1.0 / 240.0);
      test::takeReady(sound, channels);
    }
  }
  SphereBulletWorld bullet;
  btRigidBody& floor = bullet.addPlane(Vec3::UnitY(), 0.0, 1.0);
  btRigidBody& ball;
};

SoundSettings nearby() {
  SoundSettings settings;
  settings.listeners = {{"near", {0.1, 0.3, 0.2}}};
  return settings;
}

TEST(MaterialOf, ABodyIsGuessedUnlessItIsAssigned) {
  FallingBall world;
  Sound sound = test::attachOffline(world.bullet.world, nearby());
  const Result<BodyMaterial> guessed = sound.materialOf(world.ball);
  ASSERT_TRUE(guessed) << guessed.error().message;
  EXPECT_TRUE(guessed->isGuessed);
  EXPECT_EQ(guessed->material.name, "steel");
  EXPECT_NEAR(guessed->density, 0.03 / (4.0 / 3.0 * 3.141592653589793e-6), 0.1);
  ASSERT_TRUE(sound.assign(world.ball, {.material = "glass"}));
  const Result<BodyMaterial> given = sound.materialOf(world.ball);
  ASSERT_TRUE(given);
  EXPECT_FALSE(given->isGuessed);
  EXPECT_EQ(given->material.name, "glass");
  EXPECT_EQ(sound.materialOf(world.floor)->density, 0.0);
  EXPECT_EQ(sound.materialOf(world.floor)->material.name, "concrete");
}

TEST(MaterialOf, ABodyElsewhereIsRefused) {
  FallingBall world;
  FallingBall elsewhere;
  Sound sound = test::attachOffline(world.bullet.world, nearby());
  EXPECT_FALSE(sound.materialOf(elsewhere.ball));
  ASSERT_TRUE(sound.close());
  EXPECT_THAT(sound.materialOf(world.ball).error().message, HasSubstr("closed"));
}

TEST(Report, SaysWhatIsThereAndHowLoudItIs) {
  FallingBall world;
  Sound sound = test::attachOffline(world.bullet.world, nearby());
  EXPECT_THAT(sound.report(), HasSubstr("No collision has been faster than the rest speed"));
  Channels channels(1);
  world.fall(sound, channels);
  const std::string report = sound.report();
  EXPECT_THAT(report, HasSubstr("1 body can move, 1 cannot"));
  EXPECT_THAT(report, HasSubstr("1 steel (guessed)"));
  EXPECT_THAT(report, HasSubstr("The listener was set at (0.1, 0.3, 0.2) m"));
  EXPECT_THAT(report, HasSubstr("1 click,"));
  EXPECT_THAT(report, HasSubstr("The loudest so far has"));
  EXPECT_THAT(report, Not(HasSubstr("less than 20 kg/m^3")));
}

TEST(Report, SaysWhyNothingIsHeard) {
  FallingBall world;
  Result<Sound> sound = Sound::attach(world.bullet.world);
  ASSERT_TRUE(sound);
  EXPECT_THAT(sound->report(), HasSubstr("Nothing plays, records or pulls this sound"));
  EXPECT_THAT(sound->report(), HasSubstr("where a camera would"));
}

TEST(Report, OfASoundThatIsClosedHasItsCountsAndLevel) {
  FallingBall world;
  SoundSettings settings = nearby();
  settings.record = testing::TempDir() + "closed_report.wav";
  Result<Sound> sound = Sound::attach(world.bullet.world, settings);
  ASSERT_TRUE(sound);
  for (int step = 0; step < 48; ++step)
    world.bullet.step(1.0 / 240.0);
  ASSERT_TRUE(sound->close());
  const std::string report = sound->report();
  EXPECT_THAT(report, HasSubstr("1 body can move, 1 cannot"));
  EXPECT_THAT(report, HasSubstr("1 click,"));
  EXPECT_THAT(report, HasSubstr("The loudest so far has"));
  EXPECT_THAT(report, HasSubstr("The sound is closed"));
  EXPECT_THAT(report, Not(HasSubstr("gone")));
  EXPECT_THAT(report, Not(HasSubstr("Nothing plays")));
}

TEST(Report, SaysThatARunIsRecordedInsteadOfSound) {
  FallingBall world;
  Result<Sound> sound = Sound::attach(world.bullet.world);
  ASSERT_TRUE(sound);
  ASSERT_TRUE(sound->keepRun(1.0));
  for (int step = 0; step < 48; ++step)
    world.bullet.step(1.0 / 240.0);
  const std::string report = sound->report();
  EXPECT_THAT(report, HasSubstr("recorded as a run"));
  EXPECT_THAT(report, HasSubstr("Left out: 2 as there is no output for sound"));
  EXPECT_THAT(report, Not(HasSubstr("Nothing plays")));
}

TEST(Report, SaysThatABodyIsTooLightToBeMeantSo) {
  FallingBall world(1.0, 1e-5);  // 2.4 kg/m^3
  Sound sound = test::attachOffline(world.bullet.world, nearby());
  EXPECT_THAT(sound.report(), HasSubstr("1 body has less than 20 kg/m^3"));
}

TEST(Report, SaysThatABodyDoesNotWeighWhatItsModelDoes) {
  const auto model = test::boxOf({{440.0, 2.0, 0.2}});  // of 40 g
  for (const double mass : {0.033, 0.049}) {
    FallingBall world(1.0, mass);
    Sound sound = test::attachOffline(world.bullet.world, nearby());
    ASSERT_TRUE(sound.assign(world.ball, {.modes = model}));
    EXPECT_THAT(sound.report(), Not(HasSubstr("modal model"))) << mass;
  }
  for (const double mass : {0.03, 0.06}) {
    FallingBall world(1.0, mass);
    Sound sound = test::attachOffline(world.bullet.world, nearby());
    EXPECT_THAT(sound.report(), Not(HasSubstr("modal model")));
    ASSERT_TRUE(sound.assign(world.ball, {.modes = model}));
    EXPECT_THAT(sound.report(),
                HasSubstr("1 body does not weigh what the modal model does: one has " +
                          std::string(mass < 0.04 ? "0.03" : "0.06") + " kg, its model 0.04 kg"));
  }
}

TEST(Report, DoesNotCallASilencedCollisionSlow) {
  FallingBall world;
  Sound sound = test::attachOffline(world.bullet.world, nearby());
  ASSERT_TRUE(sound.assign(world.ball, {.silent = true}));
  Channels channels(1);
  world.fall(sound, channels);
  EXPECT_THAT(sound.report(), HasSubstr("Left out: 2 silenced"));
  EXPECT_THAT(sound.report(), Not(HasSubstr("No collision has been faster")));
}

TEST(Listener, InBulletsTypesIsThatInCaromsOwn) {
  const auto heard = [](auto set) {
    FallingBall world;
    SoundSettings settings;
    settings.listeners = {SoundSettings::defaultListener()};
    Sound sound = test::attachOffline(world.bullet.world, settings);
    EXPECT_TRUE(set(sound));
    Channels channels;
    world.fall(sound, channels);
    return channels;
  };
  const Vec3 place(0.25, 0.5, -0.125);
  const Quat turn(Eigen::AngleAxisd(0.5 * 3.141592653589793, Vec3::UnitY()));
  const btVector3 bulletPlace(btScalar(0.25), btScalar(0.5), btScalar(-0.125));
  const btQuaternion bulletTurn(btScalar(turn.x()), btScalar(turn.y()), btScalar(turn.z()),
                                btScalar(turn.w()));
  const Channels unturned = heard([&](Sound& sound) { return sound.setListener(place); });
  EXPECT_EQ(heard([&](Sound& sound) { return sound.setListener(bulletPlace); }), unturned);
  const Channels turned = heard([&](Sound& sound) { return sound.setListener(place, turn); });
  EXPECT_NE(turned, unturned);
  const auto isNearly = [&](const Channels& channels) {
    return std::abs(test::peakOf(channels.front()) / test::peakOf(turned.front()) - 1.0) < 1e-4;
  };
  EXPECT_TRUE(
      isNearly(heard([&](Sound& sound) { return sound.setListener(bulletPlace, bulletTurn); })));
  EXPECT_TRUE(isNearly(heard(
      [&](Sound& sound) { return sound.setListener(btTransform(bulletTurn, bulletPlace)); })));
}

// The same blow in centimetres: Bullet's own numbers are a hundred times as large.
TEST(WorldUnits, AreTurnedIntoMetres) {
  const auto heard = [](double perMetre) {
    FallingBall world(perMetre);
    Sound sound =
        test::attachOffline(world.bullet.world, nearby(), {.metresPerUnit = 1.0 / perMetre});
    EXPECT_EQ(sound.materialOf(world.ball)->material.name, "steel");
    Channels channels(1);
    world.fall(sound, channels);
    EXPECT_EQ(sound.statistics().events, 1U);
    return test::peakOf(channels.front());
  };
  const double metres = heard(1.0);
  ASSERT_GT(metres, 0.0);
  EXPECT_NEAR(heard(100.0), metres, 1e-3 * metres);
}

TEST(WorldUnits, ThatAreNoLengthAreRefused) {
  FallingBall world;
  for (const double unit : {0.0, -1.0, std::nan(""), 1e-320}) {
    const Result<Sound> refused = Sound::attach(world.bullet.world, {}, {.metresPerUnit = unit});
    ASSERT_FALSE(refused) << unit;
    EXPECT_THAT(refused.error().message, HasSubstr("metresPerUnit"));
  }
}

}  // namespace
}  // namespace carom
