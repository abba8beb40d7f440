#include "tests/support/ordinary_worlds.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "carom/sound.h"
#include "tests/plugin/offline_sound.h"

// Tests sound over worlds as applications have them, with nothing set.

namespace carom {
namespace {

constexpr double kFrameRate = 60.0;  // Hz
constexpr int kFrames = 45;          // until most of what falls has hit something

class OrdinaryWorlds : public testing::TestWithParam<OrdinaryWorldKind> {};

/// Returns the transforms and velocities of all bodies, bit for bit as Bullet has them.
std::vector<btScalar> statesOf(OrdinaryWorld& world) {
  std::vector<btScalar> states;
  const auto& objects = world.world().getCollisionObjectArray();
  const auto add = [&states](const btVector3& vector) {
    states.insert(states.end(), {vector.x(), vector.y(), vector.z()});
  };
  for (int i = 0; i < objects.size(); ++i) {
    add(objects[i]->getWorldTransform().getOrigin());
    for (int row = 0; row < 3; ++row)
      add(objects[i]->getWorldTransform().getBasis()[row]);
    if (const btRigidBody* const body = btRigidBody::upcast(objects[i])) {
      add(body->getLinearVelocity());
      add(body->getAngularVelocity());
    }
  }
  return states;
}

TEST_P(OrdinaryWorlds, MoveAsWithoutSoundAndSoundIsANumber) {
  const std::unique_ptr<OrdinaryWorld> silent = GetParam().make();
  const std::unique_ptr<OrdinaryWorld> sounding = GetParam().make();
  Sound sound = test::attachOffline(sounding->world(), {});
  std::vector<std::vector<float>> samples(2);
  for (int frame = 0; frame < kFrames; ++frame) {
    silent->step(kFrameRate);
    sounding->step(kFrameRate);
    test::takeReady(sound, samples);
  }
  EXPECT_EQ(statesOf(*silent), statesOf(*sounding));
  for (const std::vector<float>& channel : samples)
    EXPECT_TRUE(std::ranges::all_of(channel, [](float sample) { return std::isfinite(sample); }));
  const SoundStatistics heard = sound.statistics();
  EXPECT_EQ(heard.rejected, 0U);
  EXPECT_EQ(heard.unsupportedContacts, 0U);
  EXPECT_TRUE(sound.close());
}

INSTANTIATE_TEST_SUITE_P(Of, OrdinaryWorlds,
                         testing::ValuesIn(ordinaryWorlds().begin(), ordinaryWorlds().end()),
                         [](const auto& world) { return std::string(world.param.name); });

}  // namespace
}  // namespace carom
