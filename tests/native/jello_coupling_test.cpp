#include "native/jello/jello_coupling.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/native/sphere_worlds.h"

namespace carom::test {

using namespace native;

namespace {

constexpr BodyId kJelloId = 77;

/// A floating jello, a quarter of a metre wide, with its lower face 0.1 m above the origin.
JelloWorld floating(double damping = 0.0, double push = 300.0) {
  JelloWorld world;
  world.id = kJelloId;
  world.lattice = {.count = 4,
                   .size = Vec3::Constant(0.25),
                   .pointMass = 0.02,
                   .stiffness = 200.0,
                   .damping = damping};
  world.contact = {.stiffness = push, .damping = damping};
  world.positions = restingPoints(world.lattice, {0.0, 0.225, 0.0});
  world.velocities.assign(world.pointCount(), Vec3::Zero());
  return world;
}

/// A sphere that flies at the lower face of `floating`, off its middle and between its points, and
/// reaches it at 20 ms.
SphereWorld thrown() {
  SphereWorld world;
  world.spheres.push_back(sphereAt(3, {0.03, -0.01, 0.04}, {0.1, 3.0, -0.05}));
  return world;
}

JelloCoupling couplingOf(const JelloWorld& jello, const SphereWorld& spheres,
                         JelloIntegrator integrator = JelloIntegrator::rungeKutta4,
                         double step = 2e-4) {
  return *JelloCoupling::create(jello, spheres, {integrator, step});
}

Vec3 momentumOf(const JelloCoupling& coupling) {
  return coupling.jello().jelloMomentum() + 0.2 * coupling.spheres().state(0).velocity;
}

void run(JelloCoupling& coupling, double seconds) {
  while (coupling.time() < seconds - 1e-9)
    ASSERT_TRUE(coupling.advance());
}

TEST(JelloCoupling, MomentumIsKeptToRoundingByEveryIntegrator) {
  for (std::size_t which = 0; which < kJelloIntegrators; ++which) {
    const auto integrator = static_cast<JelloIntegrator>(which);
    JelloCoupling coupling = couplingOf(floating(0.05), thrown(), integrator);
    const Vec3 before = momentumOf(coupling);
    run(coupling, 0.15);
    ASSERT_GT(coupling.jello().jelloMomentum().norm(), 0.1) << nameOf(integrator);
    // The implicit integrator solves to 1e-12.
    EXPECT_LT((momentumOf(coupling) - before).norm(), 1e-11 * before.norm()) << nameOf(integrator);
  }
}

// The skin consists of triangles, over whose edges the push turns, so that no integrator keeps its
// order there.
TEST(JelloCoupling, EnergyIsKeptTheBetterTheFinerWhereNothingDamps) {
  const auto errorAt = [](double step) {
    JelloCoupling coupling = couplingOf(floating(), thrown(), JelloIntegrator::rungeKutta4, step);
    const double before = coupling.jello().energy().total();
    EXPECT_NEAR(before, 0.5 * 0.2 * (9.0 + 0.01 + 0.0025), 1e-12);  // the sphere's energy
    run(coupling, 0.3);
    EXPECT_GT(coupling.jello().energy().elastic, 0.005 * before);
    return std::abs(coupling.jello().energy().total() / before - 1.0);
  };
  EXPECT_LT(errorAt(2e-4), 1e-3);
  EXPECT_LT(errorAt(1e-5), 1e-5);
}

// In the reference one stepper computes everything by penalties: without walls and other spheres
// nothing else differs.
TEST(JelloCoupling, ConvergesInSecondOrderToTheWayOfOneStepper) {
  JelloWorld whole = floating();
  const Sphere sphere = thrown().spheres.front();
  whole.balls.push_back({sphere.id, sphere.radius, sphere.mass, sphere.position, sphere.velocity});
  JelloStepper reference = *JelloStepper::create(whole, JelloIntegrator::rungeKutta4, 1e-5);
  for (int step = 0; step < 6000; ++step)
    ASSERT_TRUE(reference.advance());
  const auto errorAt = [&](double step) {
    JelloCoupling coupling = couplingOf(floating(), thrown(), JelloIntegrator::rungeKutta4, step);
    run(coupling, 0.06);
    return (coupling.spheres().state(0).position - reference.ballPosition(0)).norm();
  };
  const double coarse = errorAt(4e-4);
  const double fine = errorAt(1e-4);
  EXPECT_LT(fine, 2e-7);
  EXPECT_GT(coarse / fine, 8.0);  // 16 but for the time of the touch within a step
}

TEST(JelloCoupling, SpheresThatNeverTouchItKeepEveryBit) {
  SphereWorld spheres = thrown();
  spheres.spheres.front().velocity = {0.0, -1.0, 0.0};
  spheres.spheres.push_back(sphereAt(4, {0.2, -1.0, 0.0}, {-1.0, 0.3, 0.0}));
  spheres.planes = boxOf(1.5, 0.8);
  spheres.gravity = kEarthGravity;
  JelloWorld jello = floating();
  jello.planes.push_back({kFirstPlane, Vec3::UnitY(), 0.05});
  JelloCoupling coupling = couplingOf(jello, spheres);
  SphereStepper alone = *SphereStepper::create(spheres);
  std::size_t collisions = 0;
  for (int step = 1; step <= 5000; ++step) {
    ASSERT_TRUE(coupling.advance());
    const auto events = alone.advanceTo(coupling.time());
    ASSERT_EQ(coupling.events().size(), events.size());
    collisions += events.size() / 2;
    for (std::size_t index = 0; index < events.size(); ++index)
      EXPECT_EQ(coupling.events()[index].time, events[index].time);
  }
  EXPECT_GE(collisions, 3U);
  EXPECT_EQ(coupling.spheres().state(1).position, alone.state(1).position);
}

TEST(JelloCoupling, EventsHaveTheWholeImpulseOfBounces) {
  JelloCoupling coupling = couplingOf(floating(0.0, 3000.0), thrown());
  const Vec3 before = coupling.spheres().state(0).velocity;
  std::vector<ImpulseEvent> events;
  double settled = 0.0;
  while (coupling.time() < 0.2) {
    ASSERT_TRUE(coupling.advance());
    for (const ImpulseEvent& event : coupling.events()) {
      EXPECT_GE(event.time, settled);
      events.push_back(event);
    }
    EXPECT_GE(coupling.settledTime(), settled);
    settled = coupling.settledTime();
  }
  ASSERT_GE(events.size(), 2U);
  EXPECT_EQ(events[0].body, 3U);
  EXPECT_EQ(events[0].other, kJelloId);
  EXPECT_EQ(events[1].body, kJelloId);
  Vec3 given = Vec3::Zero();
  for (std::size_t index = 0; index < events.size(); index += 2) {
    EXPECT_EQ(events[index].impulse, -events[index + 1].impulse);
    EXPECT_NEAR(events[index].normal.dot(events[index].impulse), events[index].impulse.norm(),
                1e-12);
    given += events[index].impulse;
  }
  const Vec3 change = 0.2 * (coupling.spheres().state(0).velocity - before);
  EXPECT_LT((given - change).norm(), 1e-12 * change.norm());
  EXPECT_NEAR(events[0].time, 0.06 / 3.0,
              2.1e-4);  // from 0.01 m below the origin to 0.05 below 0.1
  EXPECT_NEAR(events[0].approachSpeed, 3.0, 0.05);
}

// A sphere that lies on jello presses on it permanently, which is no collision.
TEST(JelloCoupling, WhatIsLaidOnItIsRestAfterItsFirstTouch) {
  JelloWorld jello = floating(1.0);
  jello.gravity = kEarthGravity;
  jello.planes.push_back({kFirstPlane, Vec3::UnitY(), 0.1});
  SphereWorld spheres;
  spheres.gravity = kEarthGravity;
  spheres.spheres.push_back(sphereAt(3, {0.0, 0.41, 0.0}));
  JelloCoupling coupling = couplingOf(jello, spheres);
  std::size_t events = 0;
  while (coupling.time() < 4.0) {
    ASSERT_TRUE(coupling.advance());
    events += coupling.events().size();
    if (coupling.time() > 2.0) {
      ASSERT_TRUE(coupling.events().empty());
    }
  }
  EXPECT_GE(events, 2U);
  EXPECT_EQ(coupling.settledTime(), coupling.time());
  const SphereState state = coupling.spheres().state(0);
  EXPECT_LT(state.velocity.norm(), 0.02);
  EXPECT_GT(state.position.y(), 0.15);
}

TEST(JelloCoupling, ABlowUpLeavesAllAsItWas) {
  JelloWorld jello = floating();
  jello.velocities.front() = {5.0, 0.0, 0.0};
  JelloCoupling coupling = couplingOf(jello, thrown(), JelloIntegrator::rungeKutta4, 0.1);
  Status stepped = std::monostate{};
  for (int step = 0; step < 1000 && stepped; ++step)
    stepped = coupling.advance();
  ASSERT_FALSE(stepped);
  EXPECT_THAT(stepped.error().message, testing::HasSubstr("blew up"));
  EXPECT_EQ(coupling.time(), coupling.spheres().time());
  EXPECT_TRUE(coupling.spheres().state(0).position.allFinite());
}

TEST(JelloCoupling, RefusesBallsBesideSpheresAndWhatTheSteppersRefuse) {
  JelloWorld jello = floating();
  jello.balls.push_back({.id = 1, .radius = 0.1, .mass = 1.0});
  const JelloStepping stepping{JelloIntegrator::rungeKutta4, 1e-4};
  EXPECT_FALSE(JelloCoupling::create(jello, thrown(), stepping));
  EXPECT_FALSE(JelloCoupling::create(floating(), thrown(), {JelloIntegrator::midpoint, 0.0}));
  SphereWorld spheres = thrown();
  spheres.spheres.front().radius = -1.0;
  EXPECT_FALSE(JelloCoupling::create(floating(), spheres, stepping));
}

}  // namespace
}  // namespace carom::test
