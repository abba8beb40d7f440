#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>
#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>
#include <gtest/gtest.h>

#include "carom/audio/rigid_radiator.h"
#include "carom/sound.h"
#include "tests/bullet_bridge/sphere_world.h"
#include "tests/plugin/offline_sound.h"

namespace carom {
namespace {

constexpr double kDistance = 2.0;  // m, distance of the listener
constexpr double kBulletRadius = 2e-3;

btVector3 bt(double x, double y, double z) {
  return {btScalar(x), btScalar(y), btScalar(z)};
}

float peakOf(const std::vector<float>& samples) {
  float peak = 0.0F;
  for (const float sample : samples)
    peak = std::max(peak, std::abs(sample));
  return peak;
}

// A body of 1 kg at rest in the origin, without gravity. Small heavy shot hits it, whose own sound
// is below a thousandth of the body's; the listener is behind the body.
class ShotAtBody : public testing::Test {
 protected:
  ~ShotAtBody() override { clear(); }

  btRigidBody& place(btCollisionShape& shape) {
    body_.emplace(btScalar(1), nullptr, &shape, bt(1e-3, 1e-3, 1e-3));
    body_->setRestitution(1);
    body_->setFriction(0);
    scene_.world.addRigidBody(&*body_);
    return *body_;
  }

  void clear() {
    if (body_) scene_.world.removeRigidBody(&*body_);
    body_.reset();
  }

  // Adds a shot that flies in the unit vector `direction`, starting 1 cm in front of `place`.
  void shoot(const Vec3& place, const Vec3& direction) {
    scene_.addBall({.radius = kBulletRadius,
                    .mass = 1.0,
                    .position = place - (kBulletRadius + 0.01) * direction,
                    .velocity = direction,
                    .restitution = 1.0});
  }

  Sound listening(const Vec3& towards, RadiatorChoice choice = RadiatorChoice::solved) {
    SoundSettings settings;
    settings.listeners = {{"behind", kDistance * towards}};
    return test::attachOffline(scene_.world, settings, {.radiators = choice});
  }

  std::vector<float> play(Sound& sound) {
    std::vector<std::vector<float>> samples(1);
    for (int step = 0; step < 24; ++step) {
      scene_.step(1.0 / 240.0);
      test::takeReady(sound, samples);
    }
    return samples[0];
  }

  // Peak in Pa when a shot hits the body's surface, whose distance from the centre is `surface`
  // (m).
  float peakOfShot(btCollisionShape& shape, const Vec3& direction, double surface,
                   RadiatorChoice choice = RadiatorChoice::solved) {
    btRigidBody& body = place(shape);
    shoot(-surface * direction, direction);
    Sound sound = listening(direction, choice);
    Material steel = *findMaterial("steel");
    EXPECT_TRUE(sound.assign(body, {.material = steel}));
    EXPECT_TRUE(sound.assign(*scene_.bodies.back(), {.material = steel}));
    const float peak = peakOf(play(sound));
    EXPECT_EQ(sound.statistics().events, 2U);
    scene_.remove(*scene_.bodies.back());
    clear();
    return peak;
  }

  SphereBulletWorld scene_;
  std::optional<btRigidBody> body_;
};

// The expected ratio does not depend on panels. Hit flat, a thin square plate has the added mass
// 0.579 pi/4 a^3 (DNV-RP-C205, appendix D) and moves the air in its own place as well; a plate that
// is not thin adds a little more. Hit on edge, it has that of the ellipsoid of its extents, per
// volume, in Lamb's closed form.
TEST_F(ShotAtBody, APlateIsLouderWhereItIsHitFlat) {
  constexpr double kSide = 0.1;        // m
  constexpr double kThickness = 5e-3;  // m
  btBoxShape plate(bt(kSide / 2, kSide / 2, kThickness / 2));
  const float flat = peakOfShot(plate, Vec3::UnitZ(), kThickness / 2);
  const float edge = peakOfShot(plate, Vec3::UnitX(), kSide / 2);

  const double volume = kSide * kSide * kThickness;
  const RigidRadiator ellipsoid = ellipsoidRadiator({kSide / 2, kSide / 2, kThickness / 2});
  const double pushedFlat = volume + 0.579 * std::numbers::pi / 4.0 * std::pow(kSide, 3);
  const double pushedOnEdge = volume * (1.0 + ellipsoid.addedVolume(0, 0) / ellipsoid.volume);
  const double expected = pushedFlat / pushedOnEdge;
  EXPECT_NEAR(static_cast<double>(flat / edge), expected, 0.12 * expected);

  // As an equivalent sphere the plate sounds alike in both directions, at a level between the two.
  const float sphereFlat =
      peakOfShot(plate, Vec3::UnitZ(), kThickness / 2, RadiatorChoice::equivalentSphere);
  const float sphereEdge =
      peakOfShot(plate, Vec3::UnitX(), kSide / 2, RadiatorChoice::equivalentSphere);
  EXPECT_NEAR(sphereFlat, sphereEdge, 5e-3F * sphereEdge);
  EXPECT_LT(sphereFlat, 0.5F * flat);
  EXPECT_GT(sphereFlat, edge);
}

// Box and hull are two triangulations of one solid, with equal volumes: the panel method gives
// 0.636 to 0.640 of the volume as the added mass of a cube.
TEST_F(ShotAtBody, AHullOfACubeSoundsAsABox) {
  btBoxShape box(bt(0.05, 0.05, 0.05));
  btConvexHullShape hull;
  for (const double x : {-0.05, 0.05}) {
    for (const double y : {-0.05, 0.05}) {
      for (const double z : {-0.05, 0.05})
        hull.addPoint(bt(x, y, z));
    }
  }
  hull.setMargin(0);
  const float asBox = peakOfShot(box, Vec3::UnitY(), 0.05);
  const float asHull = peakOfShot(hull, Vec3::UnitY(), 0.05);
  EXPECT_NEAR(asHull, asBox, 5e-3F * asBox);
}

// A sphere moves 1.5 of its volume of air and a cube 1.64 (see above), so that between two cubes
// only the volume counts. The larger cube's response is slower, too, so that the peaks' ratio is
// less than 8.
TEST_F(ShotAtBody, ScalingCountsAsSize) {
  btBoxShape large(bt(0.04, 0.04, 0.04));
  btBoxShape scaled(bt(0.02, 0.02, 0.02));
  const float small = peakOfShot(scaled, Vec3::UnitY(), 0.02);
  scaled.setLocalScaling(bt(2, 2, 2));
  const float asLarge = peakOfShot(scaled, Vec3::UnitY(), 0.04);
  EXPECT_NEAR(asLarge, peakOfShot(large, Vec3::UnitY(), 0.04), 1e-3F * asLarge);
  EXPECT_GT(asLarge, 2.0F * small);
}

TEST_F(ShotAtBody, EqualShapesAreSolvedOnceWhoeverOwnsThem) {
  btBoxShape first(bt(0.05, 0.04, 0.03));
  btBoxShape second(bt(0.05, 0.04, 0.03));
  btRigidBody other(1, nullptr, &second, bt(1e-3, 1e-3, 1e-3));
  other.setWorldTransform(btTransform(btQuaternion::getIdentity(), bt(1, 0, 0)));
  scene_.world.addRigidBody(&other);
  const btRigidBody& body = place(first);
  Sound sound = listening(Vec3::UnitX());
  EXPECT_EQ(sound.statistics().solvedShapes + sound.statistics().shapesPending, 1U);
  EXPECT_TRUE(sound.assign(body, {.material = *findMaterial("steel")}));
  sound.prepare();
  EXPECT_EQ(sound.statistics().solvedShapes, 1U);
  EXPECT_EQ(sound.statistics().shapesSolvedInStep, 0U);
  EXPECT_EQ(sound.statistics().unsolvedBodies, 0U);
  scene_.world.removeRigidBody(&other);
}

TEST_F(ShotAtBody, SpheresNeedNoSolution) {
  shoot(Vec3::Zero(), Vec3::UnitX());
  Sound sound = listening(Vec3::UnitX());
  EXPECT_EQ(sound.statistics().solvedShapes, 0U);
  EXPECT_EQ(sound.statistics().unsolvedBodies, 0U);
}

TEST_F(ShotAtBody, EquivalentSpheresNeedNoSolution) {
  btBoxShape box(bt(0.05, 0.05, 0.05));
  place(box);
  Sound sound = listening(Vec3::UnitX(), RadiatorChoice::equivalentSphere);
  EXPECT_EQ(sound.statistics().solvedShapes, 0U);
}

// Two shapes occupy one address after each other: an address does not identify a shape.
TEST_F(ShotAtBody, AShapeAtTheAddressOfAnotherIsItself) {
  std::optional<btBoxShape> shape(bt(0.05, 0.05, 0.05));
  place(*shape);
  Sound sound = listening(Vec3::UnitX());
  scene_.step(1.0 / 240.0);
  clear();
  shape.emplace(bt(0.05, 0.05, 2e-3));
  place(*shape);
  scene_.step(1.0 / 240.0);
  sound.prepare();
  EXPECT_EQ(sound.statistics().solvedShapes, 2U);
  clear();
}

TEST_F(ShotAtBody, PrepareTakesAChangeOfScaleIntoAccount) {
  btBoxShape box(bt(0.02, 0.02, 0.02));
  const float large = [&] {
    btBoxShape twice(bt(0.04, 0.04, 0.04));
    return peakOfShot(twice, Vec3::UnitY(), 0.04);
  }();
  const btRigidBody& body = place(box);
  Sound sound = listening(Vec3::UnitY());
  EXPECT_TRUE(sound.assign(body, {.material = *findMaterial("steel")}));
  box.setLocalScaling(bt(2, 2, 2));
  scene_.world.updateSingleAabb(&*body_);
  shoot({0.0, -0.04, 0.0}, Vec3::UnitY());
  scene_.step(1.0 / 240.0);  // from now on the world knows the shot
  EXPECT_TRUE(sound.assign(*scene_.bodies.back(), {.material = *findMaterial("steel")}));
  sound.prepare();
  EXPECT_NEAR(peakOf(play(sound)), large, 1e-3F * large);
  clear();
}

TEST_F(ShotAtBody, ABodyThatComesLaterIsSolvedWhenItCollidesUnlessPrepared) {
  for (const bool prepared : {false, true}) {
    btBoxShape box(bt(0.02, 0.02, 0.02));
    Sound sound = listening(Vec3::UnitY());
    place(box);
    shoot({0.0, -0.02, 0.0}, Vec3::UnitY());
    if (prepared) sound.prepare();
    EXPECT_GT(peakOf(play(sound)), 0.0F);
    EXPECT_EQ(sound.statistics().solvedShapes, 1U);
    // The solver's thread may come first, where a step is held up for long enough.
    EXPECT_LE(sound.statistics().shapesSolvedInStep, prepared ? 0U : 1U);
    scene_.remove(*scene_.bodies.back());
    clear();
  }
}

// A box of triangles without a lid is no solid, so that it sounds as a sphere of half its bounding
// box.
TEST_F(ShotAtBody, AnOpenMeshFallsBackToASphereAndIsCounted) {
  btTriangleMesh triangles;
  const auto quad = [&](const Vec3& centre, const Vec3& u, const Vec3& v) {
    const auto corner = [&](double s, double t) {
      return SphereBulletWorld::toBullet(0.05 * (centre + s * u + t * v));
    };
    triangles.addTriangle(corner(-1, -1), corner(1, -1), corner(1, 1));
    triangles.addTriangle(corner(-1, -1), corner(1, 1), corner(-1, 1));
  };
  quad(-Vec3::UnitY(), Vec3::UnitX(), Vec3::UnitZ());
  quad(Vec3::UnitX(), Vec3::UnitY(), Vec3::UnitZ());
  quad(-Vec3::UnitX(), Vec3::UnitZ(), Vec3::UnitY());
  quad(Vec3::UnitZ(), Vec3::UnitX(), Vec3::UnitY());
  quad(-Vec3::UnitZ(), Vec3::UnitY(), Vec3::UnitX());
  btBvhTriangleMeshShape open(&triangles, true);
  open.setMargin(0);
  place(open);
  // Bullet lets shot through a sheet that is on one side of it in one step, on the other in the
  // next.
  shoot({0.0, -0.051, 0.0}, Vec3::UnitY());
  Sound sound = listening(Vec3::UnitY());
  EXPECT_EQ(sound.statistics().unsolvedBodies, 1U);
  EXPECT_FALSE(sound.statistics().unsolvedReason.empty());
  EXPECT_EQ(sound.statistics().solvedShapes, 0U);
  sound.prepare();
  EXPECT_EQ(sound.statistics().unsolvedBodies, 1U);  // counts bodies, not attempts
  EXPECT_GT(peakOf(play(sound)), 0.0F);
  clear();
}

// A box whose centre of mass is beside it is hit towards the middle of the box, where it moves the
// air. The middle starts with j (1/m + d^2 / I), of which 1/m belongs to the centre of mass; the
// impulse is j = 2 v / (1/m + d^2 / I + 1/m_shot). With compact radiation the first moment of the
// pressure over time is that impulse times the motion, however long the contact.
TEST_F(ShotAtBody, ABodyTurnsAboutItsCentreOfMass) {
  constexpr double kBeside = 0.1;    // m
  constexpr double kInertia = 3e-3;  // kg m^2
  btBoxShape box(bt(0.02, 0.01, 0.03));
  const auto momentOfShot = [&](double beside, const btVector3& angularFactor) {
    btCompoundShape shape;
    shape.addChildShape(btTransform(btQuaternion::getIdentity(), bt(beside, 0, 0)), &box);
    btRigidBody& body = place(shape);
    body.setMassProps(1, bt(kInertia, kInertia, kInertia));
    body.setAngularFactor(angularFactor);
    shoot({beside, -0.01, 0.0}, Vec3::UnitY());
    SoundSettings settings;
    settings.synth.comparison.radiation = Radiation::compact;
    settings.listeners = {{"behind", kDistance * Vec3::UnitY()}};
    Sound sound = test::attachOffline(scene_.world, settings);
    const std::vector<float> samples = play(sound);
    double moment = 0.0;
    for (std::size_t sample = 0; sample < samples.size(); ++sample)
      moment += static_cast<double>(sample) * static_cast<double>(samples[sample]);
    scene_.remove(*scene_.bodies.back());
    clear();
    return moment;
  };
  const double turn = kBeside * kBeside / kInertia;
  const double expected = (2.0 / (2.0 + turn)) * (1.0 + turn);
  const double central = momentOfShot(0.0, bt(1, 1, 1));
  EXPECT_NEAR(momentOfShot(kBeside, bt(1, 1, 1)) / central, expected, 5e-3 * expected);
  EXPECT_NEAR(momentOfShot(kBeside, bt(0, 0, 1)) / central, expected, 5e-3 * expected);
  EXPECT_NEAR(momentOfShot(kBeside, bt(1, 1, 0)) / central, 1.0, 5e-3);  // it may not turn about z
}

TEST(Links, RadiateAsSpheresAndAreCounted) {
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btMultiBodyConstraintSolver solver;
  btMultiBodyDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
  world.setGravity(bt(0, -9.81, 0));
  btBoxShape box(bt(0.05, 0.05, 0.05));
  btBoxShape ground(bt(1, 1, 1));
  btRigidBody floor(0, nullptr, &ground);
  floor.setWorldTransform(btTransform(btQuaternion::getIdentity(), bt(0, -1, 0)));
  world.addRigidBody(&floor);
  btMultiBody multibody(0, btScalar(1), bt(1e-3, 1e-3, 1e-3), false, false);
  multibody.setBasePos(bt(0, 0.06, 0));
  multibody.finalizeMultiDof();
  btMultiBodyLinkCollider collider(&multibody, -1);
  collider.setCollisionShape(&box);
  collider.setWorldTransform(btTransform(btQuaternion::getIdentity(), bt(0, 0.06, 0)));
  multibody.setBaseCollider(&collider);
  world.addCollisionObject(&collider, 1, -1);
  world.addMultiBody(&multibody);
  {
    SoundSettings settings;
    settings.listeners = {{"above", {0.0, 1.0, 0.0}}};
    Sound sound = test::attachOffline(world, settings);
    EXPECT_EQ(sound.statistics().links, 1U);
    EXPECT_EQ(sound.statistics().solvedShapes, 0U);
    std::vector<std::vector<float>> samples(1);
    for (int step = 0; step < 60; ++step) {
      world.stepSimulation(btScalar(1.0 / 240.0), 0);
      test::takeReady(sound, samples);
    }
    EXPECT_GT(peakOf(samples[0]), 0.0F);
  }
  world.removeMultiBody(&multibody);
  world.removeCollisionObject(&collider);
  world.removeRigidBody(&floor);
}

}  // namespace
}  // namespace carom
