#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "tests/native/sphere_worlds.h"

namespace carom {
namespace {

using namespace test;

SphereWorld withForces(SphereWorld world) {
  world.simultaneous = Simultaneous::hertz;
  for (Sphere& sphere : world.spheres)
    sphere.stiffness = 2.2e11;
  for (Plane& plane : world.planes)
    plane.stiffness = 2.2e11;
  return world;
}

double kineticEnergyOf(const SphereWorld& world) {
  double energy = 0.0;
  for (const Sphere& sphere : world.spheres)
    energy += 0.5 * sphere.mass * sphere.velocity.squaredNorm();
  return energy;
}

/// A triangle of touching balls with `rows` rows, whose apex is at the origin and points to -x, and
/// a cue ball that comes along x. Ball `mirrored[k]` is the mirror image of the k-th across the x
/// axis.
struct Rack {
  SphereWorld world;
  std::vector<std::size_t> mirrored;
};

Rack rackOf(int rows) {
  Rack rack;
  const double pitch = 0.1;
  for (int row = 0; row < rows; ++row) {
    const std::size_t first = rack.world.spheres.size();
    for (int place = 0; place <= row; ++place) {
      const Vec3 position(pitch * std::sqrt(0.75) * row, pitch * (place - 0.5 * row), 0.0);
      rack.mirrored.push_back(first + static_cast<std::size_t>(row - place));
      rack.world.spheres.push_back(sphereAt(static_cast<BodyId>(first) + 1U, position));
      rack.world.spheres.back().id = static_cast<BodyId>(rack.world.spheres.size());
    }
  }
  rack.mirrored.push_back(rack.world.spheres.size());
  rack.world.spheres.push_back(sphereAt(100, {-0.5, 0.0, 0.0}, {3.0, 0.0, 0.0}));
  return rack;
}

class Break : public ::testing::TestWithParam<int> {};

TEST_P(Break, OfATouchingTriangleIsSymmetricAboutTheAxis) {
  const Rack rack = rackOf(GetParam());
  for (const bool forces : {false, true}) {
    SphereStepper stepper = stepperOf(forces ? withForces(rack.world) : rack.world);
    const double time = 0.4 / 3.0 + 1e-6;
    EXPECT_GT(eventsUntil(stepper, time).size(), 4U);
    for (std::size_t ball = 0; ball < rack.mirrored.size(); ++ball) {
      const Vec3 velocity = stepper.state(ball).velocity;
      const Vec3 across = stepper.state(rack.mirrored[ball]).velocity;
      EXPECT_NEAR(velocity.x(), across.x(), forces ? 1e-11 : 1e-12) << ball;
      EXPECT_NEAR(velocity.y(), -across.y(), forces ? 1e-11 : 1e-12) << ball;
      EXPECT_EQ(velocity.z(), 0.0);
    }
    EXPECT_NEAR(stepper.kineticEnergy() / kineticEnergyOf(rack.world), 1.0, 1e-10);
  }
}

TEST_P(Break, DoesNotDependOnIdsOrOnTheOrderOfTheList) {
  const Rack rack = rackOf(GetParam());
  SphereWorld renamed = rack.world;
  const std::size_t count = renamed.spheres.size();
  for (std::size_t ball = 0; ball < count; ++ball)
    renamed.spheres[ball].id = static_cast<BodyId>((ball * 7 + 3) % 101);
  std::reverse(renamed.spheres.begin(), renamed.spheres.end());
  SphereStepper stepper = stepperOf(rack.world);
  SphereStepper other = stepperOf(renamed);
  const double time = 0.4 / 3.0 + 1e-6;
  eventsUntil(stepper, time);
  eventsUntil(other, time);
  for (std::size_t ball = 0; ball < count; ++ball) {
    const Vec3 difference = stepper.state(ball).velocity - other.state(count - 1 - ball).velocity;
    EXPECT_LT(difference.norm(), 1e-12) << ball;
  }
}

INSTANTIATE_TEST_SUITE_P(Rows, Break, ::testing::Values(2, 3, 4, 5));

TEST(Simultaneous, ABallThatHitsTwoAtSixtyDegreesComesBackWithAFifth) {
  SphereWorld world;
  world.spheres = {sphereAt(7, {0.0, 0.05, 0.0}), sphereAt(3, {0.0, -0.05, 0.0}),
                   sphereAt(5, {-1.0, 0.0, 0.0}, {2.0, 0.0, 0.0})};
  SphereStepper stepper = stepperOf(world);
  const std::vector<ImpulseEvent> events = eventsUntil(stepper, 1.0);
  const double side = 2.0 * std::sqrt(3.0) * 2.0 / 5.0;  // derived in cluster_test.cpp
  ASSERT_EQ(events.size(), 4U) << "one collision each";
  EXPECT_EQ(events[0].body, 3U) << "in order of ids";
  EXPECT_EQ(events[1].body, 5U);
  EXPECT_EQ(events[2].body, 5U);
  EXPECT_EQ(events[3].body, 7U);
  EXPECT_EQ(events[0].time, events[3].time);
  for (const ImpulseEvent& event : events) {
    EXPECT_NEAR(event.impulse.norm(), 0.2 * side, 1e-13);
    EXPECT_NEAR(event.approachSpeed, std::sqrt(3.0), 1e-13);
  }
  EXPECT_NEAR(stepper.state(2).velocity.x(), -0.4, 1e-13);
  EXPECT_NEAR(stepper.state(2).velocity.y(), 0.0, 1e-13);
  EXPECT_NEAR(stepper.state(0).velocity.y(), 0.5 * side, 1e-13);
}

TEST(Simultaneous, ABallIntoTheEdgeOfTwoSlantedWallsComesStraightBack) {
  const double s = std::sqrt(0.75);  // the walls are at 120 degrees
  for (const bool forces : {false, true}) {
    SphereWorld world;
    world.spheres = {sphereAt(1, {0.0, 1.0, 0.0}, {0.0, -2.0, 0.0})};
    world.planes = {{10, {0.5, s, 0.0}, 0.0, 1.0}, {11, {-0.5, s, 0.0}, 0.0, 1.0}};
    SphereStepper stepper = stepperOf(forces ? withForces(world) : world);
    EXPECT_EQ(eventsUntil(stepper, 1.0).size(), 4U);
    EXPECT_NEAR(stepper.state(0).velocity.y(), 2.0, 1e-10);
    EXPECT_NEAR(stepper.state(0).velocity.x(), 0.0, 1e-10);
  }
}

TEST(Simultaneous, TwoBallsThatHitOneFromBothSidesAreResolvedTogether) {
  SphereWorld world;
  world.spheres = {sphereAt(1, {-0.6, 0.0, 0.0}, {1.0, 0.0, 0.0}), sphereAt(2, Vec3::Zero()),
                   sphereAt(3, {0.6, 0.0, 0.0}, {-1.0, 0.0, 0.0})};
  world.spheres[1].mass = 0.05;
  SphereStepper stepper = stepperOf(world);
  EXPECT_EQ(eventsUntil(stepper, 0.6).size(), 4U);
  EXPECT_NEAR(stepper.state(1).velocity.norm(), 0.0, 1e-14) << "it stays in the middle";
  EXPECT_NEAR(stepper.state(0).velocity.x(), -1.0, 1e-14);
  EXPECT_NEAR(stepper.state(2).velocity.x(), 1.0, 1e-14);
}

/// The expected speeds are those of cluster_test.cpp, from another integrator.
TEST(Simultaneous, ATouchingCradleOfElasticBallsFansOutAndOneWithGapsDoesNot) {
  const std::vector<double> touching{-0.07108501708, -0.03027376410, -0.01446362903, 0.12704498608,
                                     0.98877742413};
  for (const double gap : {0.0, 1e-6, 0.01}) {
    SphereWorld world = withForces(cradle(5, gap, 1.5));
    SphereStepper stepper = stepperOf(world);
    const std::vector<ImpulseEvent> events = eventsUntil(stepper, gap > 0.0 ? 1.0 : 1e-9);
    EXPECT_EQ(events.size(), 8U);
    Vec3 first = Vec3::Zero();
    for (const ImpulseEvent& event : events) {
      if (event.body == 1) first += event.impulse;
      EXPECT_GT(event.approachSpeed, 0.0);
    }
    EXPECT_LT((first - 0.2 * (stepper.state(0).velocity - Vec3(1.5, 0.0, 0.0))).norm(), 1e-14);
    for (std::size_t ball = 0; ball < 5; ++ball) {
      const double paired = ball == 4 ? 1.0 : 0.0;
      EXPECT_NEAR(stepper.state(ball).velocity.x() / 1.5, gap > 0.0 ? paired : touching[ball],
                  1e-10);
    }
  }
}

TEST(Simultaneous, ForcesNeedAStiffnessOfEveryBody) {
  SphereWorld world = withForces(cradle(2, 0.0, 1.0));
  world.planes = {floorPlane()};
  world.planes[0].offset = -1.0;
  Result<SphereStepper> stepper = SphereStepper::create(world);
  ASSERT_FALSE(stepper);
  EXPECT_NE(stepper.error().message.find("plane 1000000: stiffness is 0 Pa"), std::string::npos);
  world.planes.clear();
  world.spheres[1].stiffness = std::numeric_limits<double>::quiet_NaN();
  stepper = SphereStepper::create(world);
  ASSERT_FALSE(stepper);
  EXPECT_NE(stepper.error().message.find("sphere 2: stiffness is nan"), std::string::npos);
}

TEST(Simultaneous, WhereAdvanceToStopsChangesNoBitOfABreakOnAFloor) {
  SphereWorld world = rackOf(4).world;
  world.gravity = kEarthGravity;
  for (Sphere& sphere : world.spheres) {
    sphere.position = {sphere.position.x(), 0.05, sphere.position.y()};
    sphere.restitution = 0.9;
  }
  world.planes = {floorPlane(0.5)};
  SphereStepper big = stepperOf(world);
  SphereStepper small = stepperOf(world);
  const std::size_t count = eventsUntil(big, 1.0).size();
  std::size_t events = 0;
  for (int step = 1; step <= 1024; ++step)
    events += small.advanceTo(step / 1024.0).size();
  EXPECT_EQ(events, count);
  for (std::size_t ball = 0; ball < big.sphereCount(); ++ball) {
    EXPECT_EQ(big.state(ball).position, small.state(ball).position);
    EXPECT_EQ(big.state(ball).velocity, small.state(ball).velocity);
  }
}

}  // namespace
}  // namespace carom
