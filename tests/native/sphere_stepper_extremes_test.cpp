// Tests stiff and extreme cases, each against a closed form.

#include <algorithm>
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "tests/native/sphere_worlds.h"

namespace carom {
namespace {

using namespace test;

/// A cube of `side`^3 equal spheres of 1 mm around `middle`, 4 mm apart, in random motion.
SphereWorld cloudAt(const Vec3& middle, int side) {
  SplitMix random(5);
  SphereWorld world;
  world.restSpeed = 0.0;
  for (int place = 0; place < side * side * side; ++place) {
    const int row = place / side;
    const int layer = row / side;
    const Vec3 corner(place % side, row % side, layer);
    Sphere sphere = sphereAt(static_cast<BodyId>(place), middle + 0.00390625 * corner);
    sphere.velocity = random.inCube(1.0);
    sphere.radius = 0.001;
    world.spheres.push_back(sphere);
  }
  return world;
}

// All positions are multiples of 2^-8 m, so that at 2^33 m (8.6e9 m) none is rounded.
TEST(SphereStepperExtremes, FarFromTheOriginTheSameSpheresMeet) {
  SphereStepper near = stepperOf(cloudAt(Vec3::Zero(), 4));
  SphereStepper far = stepperOf(cloudAt(Vec3::Constant(0x1p33), 4));
  const auto expected = near.advanceTo(0.005);
  const auto events = far.advanceTo(0.005);
  ASSERT_GT(expected.size(), 20U);
  ASSERT_GE(events.size(), 4U);
  // At that distance a position is good to 1 um, a thousandth of a radius.
  EXPECT_EQ(events[0].body, expected[0].body);
  EXPECT_EQ(events[0].other, expected[0].other);
  EXPECT_NEAR(events[0].time, expected[0].time, 1e-5);
}

TEST(SphereStepperExtremes, AMillionMillionMetresAwayNothingHangsAndEnergyStays) {
  SphereWorld world = cloudAt({1e12, -1e12, 1e12}, 4);
  for (Sphere& sphere : world.spheres)
    sphere.position += 10.0 * (sphere.position - world.spheres[0].position);
  SphereStepper stepper = stepperOf(world);
  const double energy = stepper.kineticEnergy();
  stepper.advanceTo(10.0);
  EXPECT_NEAR(stepper.kineticEnergy() / energy, 1.0, 1e-12);
}

// After 10^6 cells the sphere has left the last one; from then on its speed costs nothing.
TEST(SphereStepperExtremes, WhatFliesAtTenKilometresPerSecondForADayEndsWhereItShould) {
  SphereWorld world = cloudAt(Vec3::Zero(), 3);
  for (Sphere& sphere : world.spheres)
    sphere.velocity.setZero();
  world.spheres[0].velocity = {-1e4, -1e4, -1e4};
  SphereStepper stepper = stepperOf(world);
  stepper.advanceTo(86400.0);
  EXPECT_EQ(stepper.state(0).position, Vec3::Constant(-8.64e8));
  EXPECT_EQ(stepper.state(26).position, world.spheres[26].position);
  EXPECT_TRUE(stepper.validate());
}

// A pair that has left the cells together still meets: 10^7 m away, after half an hour.
TEST(SphereStepperExtremes, SpheresMeetBeyondTheLastCell) {
  SphereWorld world = cloudAt(Vec3::Zero(), 3);
  for (Sphere& sphere : world.spheres)
    sphere.velocity.setZero();
  world.spheres[0].position = {-1.0, 0.0, 0.0};
  world.spheres[0].velocity = {-4096.0, 0.0, 0.0};
  world.spheres[1].position = {-3.002, 0.0, 0.0};
  world.spheres[1].velocity = {-4095.0, 0.0, 0.0};  // 2 m ahead, 1 m/s slower
  world.spheres[2].position = {0.0, -1.0, 0.0};
  world.spheres[2].velocity = {0.0, -4096.0, 0.0};
  SphereStepper stepper = stepperOf(world);
  stepper.advanceTo(1.0);
  world.spheres[1].position.x() = -2000.002 + 0.998;
  SphereStepper late = stepperOf(world);  // 1998.004 - 0.002 m ahead
  const auto events = late.advanceTo(2500.0);
  ASSERT_EQ(events.size(), 2U);
  EXPECT_NEAR(events[0].time, 1998.002, 1e-5);
  EXPECT_NEAR(events[0].position.x(), -1.0 - 4096.0 * 1998.002, 0.1);
}

// A heavy sphere hardly moves, and the light one between it and the wall changes its speed by twice
// the heavy one's at each meeting, at a mass ratio of 1e9. Energy is kept all the same.
TEST(SphereStepperExtremes, MassRatioOfABillionKeepsEnergyOverManyMeetings) {
  SphereWorld world = cradle(2, 0.5, 0.0);
  world.restSpeed = 0.0;
  world.spheres[0].mass = 1.0;
  world.spheres[1].mass = 1e9;
  world.spheres[0].velocity.x() = 1.0;
  world.spheres[1].velocity.x() = -1e-5;
  world.planes = {{100, Vec3::UnitX(), -0.05, 1.0}};
  SphereStepper stepper = stepperOf(world);
  const double energy = stepper.kineticEnergy();
  const double product = 0.5;  // the gap times the light one's speed, an adiabatic invariant
  stepper.advanceTo(4e4);
  EXPECT_GT(stepper.counters().collisions, 10'000U);
  const auto collisions = static_cast<double>(stepper.counters().collisions);
  EXPECT_NEAR(stepper.kineticEnergy() / energy, 1.0, 0x1p-53 * collisions);
  const double gap = stepper.state(1).position.x() - 0.1;
  EXPECT_NEAR(gap * stepper.state(0).velocity.norm() / product, 1.0, 1e-3);
}

// Spheres that do not bounce at all leave at the velocity of their common centre of mass.
TEST(SphereStepperExtremes, PlasticSpheresGoOnTogether) {
  SphereWorld world = cradle(2, 0.5, 3.0);
  world.spheres[1].mass = 0.4;
  for (Sphere& sphere : world.spheres)
    sphere.restitution = 0.0;
  SphereStepper stepper = stepperOf(world);
  EXPECT_EQ(stepper.advanceTo(1.0).size(), 2U);
  EXPECT_NEAR(stepper.state(0).velocity.x(), 1.0, 1e-15);
  EXPECT_NEAR(stepper.state(1).velocity.x(), 1.0, 1e-15);
}

// Speeds from 1 nm/s to 10 km/s in one world span thirteen decades.
TEST(SphereStepperExtremes, SpeedsThirteenDecadesApartMeetOnTime) {
  SphereWorld world;
  world.restSpeed = 0.0;
  world.spheres = {sphereAt(1, {0.0, 0.0, 0.0}, {1e-9, 0.0, 0.0}),
                   sphereAt(2, {1e4 + 0.1, 0.0, 0.0}, {-1e4, 0.0, 0.0})};
  SphereStepper stepper = stepperOf(world);
  const auto events = stepper.advanceTo(2.0);
  ASSERT_EQ(events.size(), 2U);
  EXPECT_NEAR(events[0].time, 1.0, 1e-12);
  EXPECT_NEAR(stepper.state(0).velocity.x(), -1e4, 1e-9);
  EXPECT_NEAR(stepper.state(1).velocity.x(), 1e-9, 1e-11);
}

// Light, fast spheres among heavy, slow ones cross many cells between two contacts of the slow
// ones. A missed contact would be found too late, when the two overlap.
TEST(SphereStepperExtremes, NoContactIsMissedAmongSpheresOfVeryDifferentSpeeds) {
  for (const std::uint64_t seed : {1U, 6U, 8U}) {
    SphereWorld world = gasInBox(6, 1.0, seed);
    for (Sphere& sphere : world.spheres) {
      const bool fast = sphere.id % 8 == 0;
      sphere.radius = 0.03;
      sphere.mass = fast ? 1e-4 : 1.0;
      sphere.velocity *= fast ? 30.0 : 0.3;
    }
    SphereStepper stepper = stepperOf(world);
    const auto events = stepper.advanceTo(0.5);
    for (std::size_t first = 0; first < events.size(); first += 2) {
      if (events[first + 1].body >= kFirstPlane) continue;
      const Vec3 apart = events[first].bodyPosition - events[first + 1].bodyPosition;
      ASSERT_NEAR(apart.norm(), 0.06, 1e-12) << "at " << events[first].time;
    }
  }
}

// A lattice of touching spheres is hit at a corner, at 1 m/s: nothing gets lost in 27 exact
// contacts.
TEST(SphereStepperExtremes, StartingInExactContactKeepsMomentumAndEnergy) {
  SphereWorld world = cradle(1, 0.0, 0.0);
  world.spheres.clear();
  for (int place = 0; place < 27; ++place) {
    const int row = place / 3;
    const int layer = row / 3;
    const Vec3 corner(place % 3, row % 3, layer);
    Sphere sphere = sphereAt(static_cast<BodyId>(place), 0.125 * corner);
    sphere.radius = 0.0625;
    world.spheres.push_back(sphere);
  }
  world.spheres[0].velocity = {1.0, 0.5, 0.25};
  SphereStepper stepper = stepperOf(world);
  const auto events = stepper.advanceTo(2.0);
  EXPECT_GE(events.size(), 12U);
  Vec3 velocity = Vec3::Zero();
  for (std::size_t sphere = 0; sphere < 27; ++sphere)
    velocity += stepper.state(sphere).velocity;
  EXPECT_LT((velocity - Vec3(1.0, 0.5, 0.25)).norm(), 1e-14);
  EXPECT_NEAR(stepper.kineticEnergy() / (0.1 * 1.3125), 1.0, 1e-14);
}

// ---- Cases that cannot end well must end all the same

/// `count` balls in a row on a floor, between a wall and one that approaches at 1 m/s and would
/// need their room after 0.2 s.
SphereWorld press(int count, double restitution) {
  SphereWorld world;
  world.gravity = kEarthGravity;
  for (int ball = 0; ball < count; ++ball) {
    world.spheres.push_back(sphereAt(static_cast<BodyId>(ball), {0.05 + 0.1 * ball, 0.05, 0.0}));
    world.spheres.back().restitution = restitution;
  }
  world.planes = {floorPlane(restitution),
                  {kFirstPlane + 1, Vec3::UnitX(), 0.0, restitution},
                  {kFirstPlane + 2, -Vec3::UnitX(), -(0.1 * count + 0.2), restitution}};
  world.planes[2].velocity = {-1.0, 0.0, 0.0};
  return world;
}

class Press : public testing::TestWithParam<double> {};

TEST_P(Press, CrushesOneBallWhichStaysWhereItIs) {
  SphereStepper stepper = stepperOf(press(1, GetParam()));
  stepper.advanceTo(0.1999);
  EXPECT_EQ(stepper.counters().jammed, 0U);
  stepper.advanceTo(0.3);
  EXPECT_EQ(stepper.counters().jammed, 1U);
  EXPECT_NEAR(stepper.state(0).position.x(), 0.05, 1e-4);
  EXPECT_EQ(stepper.state(0).velocity, Vec3::Zero());
  EXPECT_TRUE(valid(stepper));
  const Vec3 before = stepper.state(0).position;
  stepper.push(0, {0.0, 1.0, 0.0});
  stepper.advanceTo(1.0);
  EXPECT_EQ(stepper.state(0).position, before);
}

INSTANTIATE_TEST_SUITE_P(Restitution, Press, testing::Values(0.0, 0.5, 0.9, 1.0));

// Elastic balls would keep all the energy of the first impact.
TEST(SphereStepperExtremes, AMovingWallCrushesARowAndPassesOn) {
  SphereStepper stepper = stepperOf(press(5, 0.9));
  for (int step = 1; step <= 40; ++step) {
    stepper.advanceTo(0.05 * step);
    ASSERT_TRUE(valid(stepper));
  }
  EXPECT_EQ(stepper.counters().jammed, 5U);
}

// The box comes down on one ball at 1 m/s; the ball beside it is not touched.
TEST(SphereStepperExtremes, ABoxCrushesABallOnTheFloor) {
  SphereWorld world;
  world.gravity = kEarthGravity;
  world.spheres = {sphereAt(1, {0.0, 0.05, 0.0}), sphereAt(2, {0.5, 0.05, 0.0})};
  for (Sphere& sphere : world.spheres)
    sphere.restitution = 0.5;
  world.planes = {floorPlane(0.5)};
  Box box{kFirstPlane + 1, {0.0, 0.4, 0.0}, {0.1, 0.1, 0.1}};
  box.restitution = 0.5;
  box.velocity = {0.0, -1.0, 0.0};
  world.boxes = {box};
  SphereStepper stepper = stepperOf(world);
  stepper.advanceTo(1.0);
  EXPECT_EQ(stepper.counters().jammed, 1U);
  EXPECT_EQ(stepper.state(1).position, world.spheres[1].position);
  EXPECT_TRUE(valid(stepper));
}

TEST(SphereStepperExtremes, AMovingWallCrushesWhatHangsOnARod) {
  SphereWorld world = press(1, 0.5);
  world.rods = {{0, kAnchor, {0.05, 0.3, 0.0}}};
  SphereStepper stepper = stepperOf(world);
  stepper.advanceTo(0.5);
  EXPECT_EQ(stepper.counters().jammed, 1U);
  EXPECT_NEAR((stepper.state(0).position - Vec3(0.05, 0.3, 0.0)).norm(), 0.25, 1e-9);
}

}  // namespace
}  // namespace carom
