#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "carom/audio/surface_texture.h"
#include "carom/sound.h"
#include "tests/audio/ringing_box.h"
#include "tests/bullet_bridge/sphere_world.h"
#include "tests/plugin/offline_sound.h"

// Tests the materials of bodies by their sound: contacts last as the materials' stiffness demands.

namespace carom {
namespace {

using testing::HasSubstr;
using Samples = std::vector<std::vector<float>>;

/// A ball that falls on a floor.
struct Scene {
  SphereBulletWorld bullet{9.81};
  btRigidBody& floor = bullet.addPlane(Vec3::UnitY(), 0.0, 1.0);
  btRigidBody& ball =
      bullet.addBall({.radius = 0.01, .mass = 0.03, .position = {0, 0.1, 0}, .restitution = 0.8});
};

/// Returns the sound of the scene after `prepare` has changed it.
template <class Prepare>
Samples heard(Prepare prepare) {
  Scene scene;
  SoundSettings settings;
  settings.listeners = {{"near", {0.1, 0.3, 0.2}}};
  Sound sound = test::attachOffline(scene.bullet.world, settings);
  prepare(scene, sound);
  Samples samples(1);
  for (int step = 0; step < 80; ++step) {
    scene.bullet.step(1.0 / 240.0);
    test::takeReady(sound, samples);
  }
  return samples;
}

void require(const Status& status) {
  EXPECT_TRUE(status) << status.error().message;
}

Samples ofBody(const std::string& name) {
  return heard(
      [&](Scene& scene, Sound& sound) { require(sound.assign(scene.ball, {.material = name})); });
}

TEST(Materials, AreThoseOfTheBodyOfItsShapeOrOfItsUserIndex) {
  const Samples rubber = ofBody("rubber");
  const Samples untold = heard([](Scene&, Sound&) {});
  ASSERT_NE(rubber, untold);
  EXPECT_EQ(heard([](Scene& scene, Sound& sound) {
              require(sound.assign(*scene.ball.getCollisionShape(), {.material = "rubber"}));
            }),
            rubber);
  EXPECT_EQ(heard([](Scene& scene, Sound& sound) {
              scene.ball.setUserIndex(7);
              require(sound.assign(UserIndex{7}, {.material = "rubber"}));
              require(sound.assign(UserIndex{8}, {.material = "steel"}));
            }),
            rubber);
}

TEST(Materials, OfTheBodyGoBeforeThoseOfTheShapeAndThoseBeforeTheUserIndexs) {
  EXPECT_EQ(heard([](Scene& scene, Sound& sound) {
              scene.ball.setUserIndex(7);
              require(sound.assign(scene.ball, {.material = "rubber"}));
              require(sound.assign(*scene.ball.getCollisionShape(), {.material = "glass"}));
              require(sound.assign(UserIndex{7}, {.material = "steel"}));
            }),
            ofBody("rubber"));
  EXPECT_EQ(heard([](Scene& scene, Sound& sound) {
              scene.ball.setUserIndex(7);
              require(sound.assign(*scene.ball.getCollisionShape(), {.material = "glass"}));
              require(sound.assign(UserIndex{7}, {.material = "steel"}));
            }),
            ofBody("glass"));
}

// Bullet has not stepped with the new body, so that the bridge has no number for it yet.
TEST(Materials, CanBeSetForABodyThatHasJustComeIn) {
  const auto fall = [](bool sets) {
    return heard([sets](Scene& scene, Sound& sound) {
      scene.bullet.remove(scene.ball);
      btRigidBody& late = scene.bullet.addBall(
          {.radius = 0.01, .mass = 0.03, .position = {0, 0.1, 0}, .restitution = 0.8});
      if (sets) require(sound.assign(late, {.material = "rubber"}));
    });
  };
  EXPECT_EQ(fall(true), ofBody("rubber"));
  EXPECT_NE(fall(false), ofBody("rubber"));
}

// A body is removed before it hits anything, and another one comes to its address.
TEST(Materials, GoWithTheirBody) {
  alignas(btRigidBody) std::array<std::byte, sizeof(btRigidBody)> place{};
  btSphereShape shape(0.01F);
  const auto fall = [&](const std::string& first) {
    return heard([&](Scene& scene, Sound& sound) {
      scene.bullet.remove(scene.ball);
      for (const std::string& material : {first, std::string()}) {
        auto* const body = new (place.data()) btRigidBody(0.03F, nullptr, &shape);
        body->setWorldTransform(btTransform(btQuaternion::getIdentity(), {0, 0.1F, 0}));
        body->setRestitution(0.8F);
        scene.bullet.world.addRigidBody(body);
        if (material.empty()) break;
        require(sound.assign(*body, {.material = material}));
        scene.bullet.step(1.0 / 240.0);
        scene.bullet.world.removeRigidBody(body);
        body->~btRigidBody();
      }
    });
  };
  EXPECT_EQ(fall("rubber"), fall("steel"));
}

TEST(Materials, StayThroughPrepare) {
  EXPECT_EQ(heard([](Scene& scene, Sound& sound) {
              require(sound.assign(scene.ball, {.material = "rubber"}));
              sound.prepare();
            }),
            ofBody("rubber"));
}

TEST(Materials, AreRefusedByNameWithTheNamesThereAre) {
  Scene scene;
  Sound sound = test::attachOffline(scene.bullet.world, {});
  const Status refused = sound.assign(scene.ball, {.material = "unobtainium"});
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("'unobtainium'"));
  EXPECT_THAT(refused.error().message, HasSubstr("steel"));
  EXPECT_THAT(refused.error().message, HasSubstr("brass"));  // a less common one
  EXPECT_FALSE(sound.assign(*scene.ball.getCollisionShape(), {.material = ""}));
  EXPECT_FALSE(sound.assign(UserIndex{1}, {.material = "Steel "}));
  Material broken = *findMaterial("steel");
  broken.youngsModulus = std::nan("");
  EXPECT_FALSE(sound.assign(UserIndex{1}, {.material = broken}));
  require(sound.close());
  const Status late = sound.assign(scene.ball, {.material = "steel"});
  ASSERT_FALSE(late);
  EXPECT_THAT(late.error().message, HasSubstr("closed"));
  require(sound.close());
}

double loudest(const Samples& samples) {
  double peak = 0.0;
  for (const float sample : samples[0])
    peak = std::max(peak, std::abs(static_cast<double>(sample)));
  return peak;
}

/// Peak (Pa) of the click of a ball of 2 cm of that density (kg/m^3), which falls by 2 cm.
double clickOfDensity(double density) {
  SphereBulletWorld bullet{9.81};
  bullet.addPlane(Vec3::UnitY(), 0.0, 1.0);
  const double mass = density * 4.0 / 3.0 * 3.141592653589793 * 8e-6;
  bullet.addBall({.radius = 0.02, .mass = mass, .position = {0, 0.04, 0}, .restitution = 0.5});
  SoundSettings settings;
  settings.listeners = {{"near", {0.3, 0.3, 0.2}}};
  Sound sound = test::attachOffline(bullet.world, settings);
  Samples samples(1);
  for (int step = 0; step < 24; ++step) {
    bullet.step(1.0 / 240.0);
    test::takeReady(sound, samples);
  }
  return loudest(samples);
}

// The blow is the same, so that the level rises with the stiffness that is guessed and nothing
// else: an acceleration does not depend on the mass.
TEST(Materials, ThatAreGuessedHaveALevelThatNeverJumpsWithDensity) {
  constexpr int kSteps = 200;
  double before = 0.0;
  for (int step = 0; step <= kSteps; ++step) {
    const double density = 100.0 * std::pow(200.0, static_cast<double>(step) / kSteps);
    const double peak = clickOfDensity(density);
    ASSERT_GT(peak, 0.0) << density;
    if (step > 0) {
      EXPECT_LT(std::abs(20.0 * std::log10(peak / before)), 3.0) << density;
    }
    before = peak;
  }
}

TEST(Materials, ThatAreGuessedAreNeverSoft) {
  // 1000 kg/m^3, which many applications use, lies between wood and plastic, as does its level.
  const double level = clickOfDensity(1000.0);
  EXPECT_LT(std::abs(20.0 * std::log10(level / clickOfDensity(700.0))), 12.0);
  EXPECT_LT(std::abs(20.0 * std::log10(level / clickOfDensity(1200.0))), 12.0);
}

/// A model that rings louder than any click here.
std::shared_ptr<const ModalModel> bell() {
  return test::boxOf({{440.0, 2.0, 0.2}, {1300.0, 5.0, 0.2}}, Vec3::UnitY());
}

TEST(Modes, RingInTheBodyOfItsShapeOrOfItsUserIndex) {
  const Samples rings = heard(
      [](Scene& scene, Sound& sound) { require(sound.assign(scene.ball, {.modes = bell()})); });
  EXPECT_GT(loudest(rings), 3.0 * loudest(heard([](Scene&, Sound&) {})));
  EXPECT_EQ(heard([](Scene& scene, Sound& sound) {
              require(sound.assign(*scene.ball.getCollisionShape(), {.modes = bell()}));
            }),
            rings);
  EXPECT_EQ(heard([](Scene& scene, Sound& sound) {
              scene.ball.setUserIndex(7);
              require(sound.assign(UserIndex{7}, {.modes = bell()}));
            }),
            rings);
}

TEST(Modes, OfTheBodyGoBeforeThoseOfItsShapeAndNoneAreModesToo) {
  EXPECT_EQ(heard([](Scene& scene, Sound& sound) {
              require(sound.assign(*scene.ball.getCollisionShape(), {.modes = bell()}));
              require(sound.assign(scene.ball, {.modes = nullptr}));
              require(sound.assign(scene.ball, {.material = "glass"}));
            }),
            ofBody("glass"));
}

TEST(Modes, BringTheirMaterialAlongUnlessThereIsOne) {
  const auto statistics = [](auto prepare) {
    return heard([&](Scene& scene, Sound& sound) { prepare(scene, sound); });
  };
  const Samples steel = statistics([](Scene& scene, Sound& sound) {
    require(sound.assign(scene.ball, {.material = "steel"}));
    require(sound.assign(scene.ball, {.modes = bell()}));
  });
  EXPECT_EQ(bell()->material.name, "steel");
  EXPECT_EQ(statistics([](Scene& scene, Sound& sound) {
              require(sound.assign(scene.ball, {.modes = bell()}));
            }),
            steel);
  EXPECT_NE(statistics([](Scene& scene, Sound& sound) {
              require(sound.assign(scene.ball, {.material = "rubber"}));
              require(sound.assign(scene.ball, {.modes = bell()}));
            }),
            steel);
}

TEST(Modes, OfAFloorRingThoughItDoesNotMove) {
  EXPECT_GT(loudest(heard([](Scene& scene, Sound& sound) {
              require(sound.assign(scene.floor, {.modes = bell()}));
            })),
            3.0 * loudest(heard([](Scene&, Sound&) {})));
}

TEST(Modes, ThatCannotBeAreRefused) {
  Scene scene;
  Sound sound = test::attachOffline(scene.bullet.world, {});
  auto broken = std::make_shared<ModalModel>(*bell());
  broken->shapes.pop_back();
  const Status refused = sound.assign(scene.ball, {.modes = broken});
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("modal model: shapes must have three numbers"));
}

TEST(Assign, ReplacesOnlyThePartsThatItSets) {
  EXPECT_EQ(heard([](Scene& scene, Sound& sound) {
              require(sound.assign(scene.ball, {.material = "rubber", .modes = bell()}));
              require(sound.assign(scene.ball, {.modes = nullptr}));
            }),
            ofBody("rubber"));
  EXPECT_EQ(heard([](Scene& scene, Sound& sound) {
              require(sound.assign(scene.ball, {.material = "rubber"}));
              require(sound.assign(scene.ball, {}));
            }),
            ofBody("rubber"));
}

TEST(Assign, FillsEachPartFromTheBodyThenItsShapeThenItsUserIndex) {
  EXPECT_EQ(heard([](Scene& scene, Sound& sound) {
              scene.ball.setUserIndex(7);
              require(sound.assign(UserIndex{7}, {.material = "glass", .modes = bell()}));
              require(sound.assign(*scene.ball.getCollisionShape(), {.material = "rubber"}));
              require(sound.assign(scene.ball, {.modes = nullptr}));
            }),
            ofBody("rubber"));
}

TEST(Assign, IsTakenBackByUnassign) {
  const Samples guessed = heard([](Scene&, Sound&) {});
  EXPECT_EQ(heard([](Scene& scene, Sound& sound) {
              require(sound.assign(scene.ball, {.material = "rubber", .modes = bell()}));
              require(sound.unassign(scene.ball));
            }),
            guessed);
  EXPECT_EQ(heard([](Scene& scene, Sound& sound) {
              scene.ball.setUserIndex(7);
              require(sound.assign(UserIndex{7}, {.material = "rubber"}));
              require(sound.assign(*scene.ball.getCollisionShape(), {.silent = true}));
              require(sound.unassign(UserIndex{7}));
              require(sound.unassign(*scene.ball.getCollisionShape()));
            }),
            guessed);
  EXPECT_EQ(heard([](Scene& scene, Sound& sound) {
              require(sound.assign(scene.ball, {.material = "glass"}));
              require(sound.assign(*scene.ball.getCollisionShape(), {.material = "rubber"}));
              scene.bullet.step(1.0 / 240.0);  // the body gets its number
              require(sound.unassign(scene.ball));
            }),
            heard([](Scene& scene, Sound& sound) {
              require(sound.assign(scene.ball, {.material = "rubber"}));
              scene.bullet.step(1.0 / 240.0);
            }));
}

TEST(Assign, ThatIsRefusedChangesNothing) {
  EXPECT_EQ(heard([](Scene& scene, Sound& sound) {
              require(sound.assign(scene.ball, {.material = "rubber"}));
              EXPECT_FALSE(sound.assign(scene.ball, {.material = "cheese", .silent = true}));
            }),
            ofBody("rubber"));
}

bool isSilent(const Samples& samples) {
  return loudest(samples) == 0.0;
}

TEST(Silence, LeavesOutContactsWithTheBodyWhicheverOfTheTwoItIs) {
  EXPECT_TRUE(isSilent(heard(
      [](Scene& scene, Sound& sound) { require(sound.assign(scene.ball, {.silent = true})); })));
  EXPECT_TRUE(isSilent(heard(
      [](Scene& scene, Sound& sound) { require(sound.assign(scene.floor, {.silent = true})); })));
  EXPECT_TRUE(isSilent(heard([](Scene& scene, Sound& sound) {
    require(sound.assign(scene.floor, {.modes = bell()}));
    require(sound.assign(*scene.ball.getCollisionShape(), {.silent = true}));
  })));
}

TEST(Silence, OfAShapeIsTakenBackForOneBody) {
  EXPECT_EQ(heard([](Scene& scene, Sound& sound) {
              require(sound.assign(*scene.ball.getCollisionShape(), {.silent = true}));
              require(sound.assign(scene.ball, {.silent = false}));
            }),
            heard([](Scene&, Sound&) {}));
}

TEST(Silence, IsCountedAndLeavesOtherBodiesAlone) {
  Scene scene;
  btRigidBody& other = scene.bullet.addBall(
      {.radius = 0.01, .mass = 0.03, .position = {1, 0.1, 0}, .restitution = 0.8});
  Sound sound = test::attachOffline(scene.bullet.world, {});
  require(sound.assign(scene.ball, {.silent = true}));
  Samples samples;
  for (int step = 0; step < 60; ++step) {  // each lands once, after 0.14 s
    scene.bullet.step(1.0 / 240.0);
    test::takeReady(sound, samples);
  }
  EXPECT_EQ(sound.statistics().silenced, 2U);
  EXPECT_EQ(sound.statistics().events, 1U);
  EXPECT_EQ(sound.statistics().immovable, 1U);
  EXPECT_FALSE(isSilent(samples));
  scene.bullet.remove(other);
}

/// Returns the steps that are heard of a smooth ball that slides, without turning, on a smooth
/// floor, after `prepare` has changed something.
template <class Prepare>
std::uint64_t slides(Prepare prepare) {
  SphereBulletWorld world(9.81);
  btRigidBody& floor = world.addPlane(Vec3::UnitY(), 0.0, 0.0);
  world.addBall({.radius = 0.01,
                 .mass = 0.03,
                 .position = {0, 0.01, 0},
                 .velocity = {1, 0, 0},
                 .restitution = 0.0});
  SoundSettings settings;
  settings.listeners = {{"near", {0.1, 0.1, 0.1}}};
  Sound sound = test::attachOffline(world.world, settings);
  Material smooth = *findMaterial("steel");
  smooth.roughness = {};
  require(sound.assign(UserIndex{-1}, {.material = smooth}));
  prepare(sound, floor);
  Samples samples;
  for (int step = 0; step < 60; ++step) {
    world.step(1.0 / 240.0);
    test::takeReady(sound, samples);
  }
  return sound.statistics().slides;
}

TEST(Textures, SoundWhereABodySlidesAndNullIsTheMaterialsRoughness) {
  Result<SurfaceTexture> rough = SurfaceTexture::rough({2e-5, 1e-3, 0.8}, 1);
  ASSERT_TRUE(rough);
  const auto texture = std::make_shared<const SurfaceTexture>(*std::move(rough));
  EXPECT_EQ(slides([](Sound&, btRigidBody&) {}), 0U);
  EXPECT_GT(slides([&](Sound& sound, btRigidBody& floor) {
              require(sound.assign(floor, {.texture = texture}));
            }),
            0U);
  EXPECT_EQ(slides([&](Sound& sound, btRigidBody& floor) {
              require(sound.assign(*floor.getCollisionShape(), {.texture = texture}));
              require(sound.assign(floor, {.texture = nullptr}));
            }),
            0U);
  EXPECT_EQ(slides([&](Sound& sound, btRigidBody& floor) {
              require(sound.assign(floor, {.texture = texture, .silent = true}));
            }),
            0U);
}

}  // namespace
}  // namespace carom
