// Tests Sound::onCollision, and the reasons why events are not heard.

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "carom/carom.h"
#include "carom/sound.h"
#include "tests/bullet_bridge/any_world.h"
#include "tests/plugin/offline_sound.h"

namespace carom {
namespace {

constexpr double kStep = 1.0 / 240.0;  // s
constexpr double kRadius = 0.02;       // m
constexpr double kMass = 0.3;          // kg
constexpr double kDrop = 0.1;          // m

/// Steel balls above a box whose top is at 0.
struct Balls : AnyWorld {
  Balls() : AnyWorld(9.81) { ground = &addGround(box({2.0, 1.0, 2.0}), 0.0, -1.0); }

  btRigidBody& addBall(double x, double height = kDrop) {
    return add(sphere(kRadius), {.mass = kMass, .position = {x, kRadius + height, 0.0}});
  }
  Sound sound(std::vector<Listener> listeners = {{"near", {0.0, 0.5, 0.0}}},
              ImpulseChoice impulse = ImpulseChoice::physical) {
    SoundSettings settings;
    settings.listeners = std::move(listeners);
    settings.synth.impulse = impulse;
    return test::attachOffline(*world, settings);
  }

  btRigidBody* ground = nullptr;
};

/// A copy of what is told, with the levels, which last for the call only.
struct Told {
  SoundCollision collision;
  std::vector<HeardCollision> heard;
};

void keep(Sound& sound, std::vector<Told>& all) {
  ASSERT_TRUE(sound.onCollision([&all](const SoundCollision& collision) {
    all.push_back({collision, {collision.heard.begin(), collision.heard.end()}});
  }));
}

TEST(Collisions, AreToldOnceWithWhatHappened) {
  Balls balls;
  btRigidBody& ball = balls.addBall(0.0);
  Sound sound = balls.sound();
  std::vector<Told> told;
  keep(sound, told);
  balls.step(kStep, 60);
  ASSERT_EQ(told.size(), 1U);
  const SoundCollision& collision = told[0].collision;
  const double speed = std::sqrt(2.0 * 9.81 * kDrop);
  EXPECT_NEAR(collision.time, std::sqrt(2.0 * kDrop / 9.81), kStep);
  EXPECT_TRUE((collision.body == &ball && collision.other == balls.ground) ||
              (collision.body == balls.ground && collision.other == &ball));
  EXPECT_NEAR(collision.position.norm(), 0.0, 1e-3);
  EXPECT_NEAR(collision.normal.y(), collision.body == &ball ? 1.0 : -1.0, 1e-6);
  EXPECT_NEAR(collision.approachSpeed, speed, 0.03 * speed);
  EXPECT_NEAR(collision.impulse, 2.0 * kMass * collision.approachSpeed, 1e-3);
}

// The rendered samples are the oracle: at no listener above the bound, and within 12 dB of it.
TEST(Collisions, HaveABoundOfTheirPressureAtEachListener) {
  Balls balls;
  balls.addBall(0.0);
  Sound sound = balls.sound({{"near", {0.0, 0.5, 0.0}}, {"far", {0.0, 4.0, 1.0}}});
  std::vector<Told> told;
  keep(sound, told);
  std::vector<std::vector<float>> samples;
  balls.step(kStep, 60);
  test::takeReady(sound, samples);
  ASSERT_EQ(told.size(), 1U);
  ASSERT_EQ(told[0].heard.size(), 2U);
  for (std::size_t listener = 0; listener < 2; ++listener) {
    const HeardCollision& heard = told[0].heard[listener];
    const double peak = test::peakOf(samples[listener]);
    EXPECT_LE(peak, heard.peak) << listener;
    EXPECT_GT(peak, 0.25 * heard.peak) << listener;
    EXPECT_NEAR(heard.level, 20.0 * std::log10(heard.peak / 20e-6), 1e-9);
  }
  EXPECT_EQ(told[0].collision.peak, told[0].heard[0].peak);
  EXPECT_GT(told[0].heard[0].peak, 4.0 * told[0].heard[1].peak);
}

// The second ball falls 5 mm some 30 ms after the first, far louder one, which masks it.
TEST(Collisions, HaveABoundThoughLouderOnesMaskThem) {
  const auto quietOne = [](bool isMasked) {
    Balls balls;
    balls.addBall(0.0, 0.005).setLinearVelocity(btVector3(0, 0, 0));
    if (isMasked)
      balls.add(balls.sphere(kRadius),
                {.mass = kMass, .position = {0.5, kRadius + 0.001, 0}, .velocity = {0, -3, 0}});
    Sound sound = balls.sound();
    std::vector<Told> told;
    keep(sound, told);
    balls.step(kStep, 14);
    EXPECT_EQ(told.size(), isMasked ? 2U : 1U);
    return told.empty() ? 0.0 : told.back().collision.peak;
  };
  const double alone = quietOne(false);
  EXPECT_GT(alone, 1e-3);
  EXPECT_NEAR(quietOne(true), alone, 1e-9 * alone);
}

TEST(Collisions, OfBodiesThatTheHostHasRemovedHaveNone) {
  Balls balls;
  btRigidBody& first = balls.addBall(-0.5);
  btRigidBody& second = balls.addBall(0.5);
  Sound sound = balls.sound();
  std::vector<Told> told;
  ASSERT_TRUE(sound.onCollision([&](const SoundCollision& collision) {
    told.push_back({collision, {}});
    if (told.size() > 1) return;
    balls.remove(first);
    balls.remove(second);
  }));
  balls.step(kStep, 60);
  ASSERT_EQ(told.size(), 2U) << "both land in the same substep";
  EXPECT_TRUE(told[0].collision.body == balls.ground || told[0].collision.other == balls.ground);
  EXPECT_NE(told[0].collision.body, nullptr);
  EXPECT_NE(told[0].collision.other, nullptr);
  const SoundCollision& later = told[1].collision;
  EXPECT_TRUE((later.body == nullptr && later.other == balls.ground) ||
              (later.other == nullptr && later.body == balls.ground));
}

TEST(Collisions, MayChangeTheSoundFromWithin) {
  Balls balls;
  btRigidBody& ball = balls.addBall(0.0);
  Sound sound = balls.sound();
  int told = 0;
  ASSERT_TRUE(sound.onCollision([&](const SoundCollision& collision) {
    EXPECT_TRUE(sound.setListener(collision.position + Vec3(0.0, 1.0, 0.0)));
    EXPECT_TRUE(sound.assign(ball, {.material = "glass"}));
    EXPECT_TRUE(sound.onCollision([&told](const SoundCollision&) { ++told; }));
  }));
  balls.step(kStep, 240);
  EXPECT_GE(told, 1) << "the function that took its place was not called";
  EXPECT_EQ(sound.statistics().events, static_cast<std::uint64_t>(told) + 1U);
}

TEST(Collisions, ThatAreSilencedAreNotTold) {
  Balls balls;
  btRigidBody& ball = balls.addBall(0.0);
  Sound sound = balls.sound();
  std::vector<Told> told;
  keep(sound, told);
  ASSERT_TRUE(sound.assign(ball, {.silent = true}));
  balls.step(kStep, 60);
  EXPECT_TRUE(told.empty());
  EXPECT_EQ(sound.statistics().silenced, 2U);
}

// Bullet solves the contact of two spheres in the substep after they have met.
TEST(Collisions, UnderWayAreToldByClose) {
  Balls balls;
  balls.add(balls.sphere(kRadius), {.mass = 0.0, .position = {0.0, kRadius, 0.0}});
  balls.addBall(0.0, 2.0 * kRadius + kDrop);
  Sound sound = balls.sound({{"near", {0.0, 0.5, 0.0}}}, ImpulseChoice::applied);
  std::vector<Told> told;
  keep(sound, told);
  int landing = 0;  // Bullet falls by g dt^2 n (n + 1) / 2 in n substeps
  for (double fall = 0.0; fall < kDrop; fall += 9.81 * kStep * kStep * landing)
    ++landing;
  balls.step(kStep, landing);
  ASSERT_TRUE(told.empty()) << "Bullet has yet to solve it";
  ASSERT_TRUE(sound.close());
  ASSERT_EQ(told.size(), 1U);
  EXPECT_GT(told[0].collision.time, (landing - 1) * kStep);
  EXPECT_LT(told[0].collision.time, landing * kStep);
}

/// The record of what the C function was told.
struct CTold {
  int calls = 0;
  carom_collision latest = {};
  std::vector<double> peaks;
  carom_sound* destroyed = nullptr;
};

void tellC(void* user, const carom_collision* collision) {
  auto& told = *static_cast<CTold*>(user);
  ++told.calls;
  told.latest = *collision;
  told.peaks.assign(collision->peaks, collision->peaks + collision->listener_count);
  EXPECT_NEAR(collision->levels[0], 20.0 * std::log10(collision->peaks[0] / 20e-6), 1e-9);
  if (told.destroyed != nullptr) carom_destroy(std::exchange(told.destroyed, nullptr));
}

TEST(Collisions, AreToldToC) {
  Balls balls;
  btRigidBody& ball = balls.addBall(0.0);
  CTold told;
  carom_sound* sound = nullptr;
  ASSERT_EQ(carom_attach(balls.world.get(), nullptr, &sound), CAROM_OK);
  EXPECT_EQ(carom_is_playing(sound), 0);
  told.destroyed = sound;
  ASSERT_EQ(carom_on_collision(sound, &tellC, &told), CAROM_OK);
  balls.step(kStep, 240);
  EXPECT_EQ(told.calls, 1) << "it has destroyed its sound";
  EXPECT_EQ(told.latest.size, sizeof(carom_collision));
  EXPECT_TRUE(told.latest.body == &ball || told.latest.other == &ball);
  EXPECT_NEAR(told.latest.impulse, 2.0 * kMass * told.latest.approach_speed, 1e-3);
  EXPECT_NEAR(std::abs(told.latest.normal[1]), 1.0, 1e-6);
  ASSERT_EQ(told.peaks.size(), 1U);
  EXPECT_EQ(told.peaks[0], told.latest.peak);
  EXPECT_TRUE(Sound::attach(*balls.world));
  EXPECT_EQ(carom_on_collision(nullptr, nullptr, nullptr), CAROM_ERROR_ARGUMENT);
}

TEST(Bodies, ThatCannotSoundAreCountedAndToldOf) {
  Balls balls;
  btRigidBody& broken = balls.add(balls.box({0.1, 0.1, 0.1}), {.position = {0.0, 3.0, 0.0}});
  const btScalar infinity = std::numeric_limits<btScalar>::infinity();
  broken.setInvInertiaDiagLocal(btVector3(infinity, infinity, infinity));
  std::vector<std::string> told;
  SoundSettings settings;
  settings.onMessage = [&told](const std::string& sentence) { told.push_back(sentence); };
  Result<Sound> sound = Sound::attach(*balls.world, settings);
  ASSERT_TRUE(sound);
  sound->prepare();  // before its shape is solved, it is a sphere, which does not turn
  EXPECT_EQ(sound->statistics().refusedBodies, 1U);
  EXPECT_NE(sound->statistics().unsolvedReason.find("inverse inertia"), std::string::npos);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0], sound->statistics().unsolvedReason);
}

TEST(Assignments, ThatNoBodyUsesAreCounted) {
  Balls balls;
  btRigidBody& ball = balls.addBall(0.0);
  btCollisionShape& spare = balls.sphere(0.1);
  ball.setUserIndex(3);
  Sound sound = balls.sound();
  ASSERT_TRUE(sound.assign(UserIndex{3}, {.material = "steel"}));
  ASSERT_TRUE(sound.assign(*ball.getCollisionShape(), {.material = "steel"}));
  EXPECT_EQ(sound.statistics().unusedAssignments, 0U);
  ASSERT_TRUE(sound.assign(UserIndex{4}, {.material = "steel"}));
  ASSERT_TRUE(sound.assign(spare, {.material = "steel"}));
  EXPECT_EQ(sound.statistics().unusedAssignments, 2U);
  balls.add(spare, {.position = {0.0, 3.0, 0.0}});
  EXPECT_EQ(sound.statistics().unusedAssignments, 1U) << "a body has come";
  balls.remove(ball);
  EXPECT_EQ(sound.statistics().unusedAssignments, 1U) << "used once is used";
  ASSERT_TRUE(sound.unassign(UserIndex{4}));
  EXPECT_EQ(sound.statistics().unusedAssignments, 0U);
}

}  // namespace
}  // namespace carom
