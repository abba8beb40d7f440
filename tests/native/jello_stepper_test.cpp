#include "native/jello/jello_stepper.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/random.h"

namespace carom::test {

using namespace native;

namespace {

constexpr std::array<JelloIntegrator, kJelloIntegrators> kAll = {
    JelloIntegrator::explicitEuler, JelloIntegrator::symplecticEuler, JelloIntegrator::midpoint,
    JelloIntegrator::rungeKutta4,   JelloIntegrator::backwardEuler,   JelloIntegrator::leapfrog};

/// A jello that is crumpled and turns, in free space.
JelloWorld crumpled(std::size_t count, double damping) {
  JelloWorld world;
  world.lattice = {.count = count,
                   .size = {1.0, 0.8, 1.2},
                   .pointMass = 0.01,
                   .stiffness = 40.0,
                   .damping = damping};
  world.contact = {.stiffness = 400.0, .damping = 0.1};
  world.positions = restingPoints(world.lattice, {0.2, 0.1, -0.3});
  Random random(5);
  for (Vec3& point : world.positions) {
    world.velocities.push_back(0.3 * random.inCube() + Vec3(0.1, 0.5, 0.9).cross(point));
    point += 0.04 * random.inCube();
  }
  return world;
}

JelloStepper stepperOf(const JelloWorld& world, JelloIntegrator integrator, double step) {
  return *JelloStepper::create(world, integrator, step);
}

void run(JelloStepper& stepper, double seconds) {
  const auto steps = std::lround(seconds / stepper.step());
  for (long index = 0; index < steps; ++index)
    ASSERT_TRUE(stepper.advance());
}

TEST(JelloStepper, MomentumIsKeptToRoundingWithoutWalls) {
  for (const JelloIntegrator integrator : kAll) {
    JelloStepper stepper = stepperOf(crumpled(5, 0.02), integrator, 1e-4);
    const Vec3 before = stepper.momentum();
    double scale = 0.0;
    for (std::size_t point = 0; point < 125; ++point)
      scale += 0.01 * stepper.velocity(point).norm();
    run(stepper, 0.05);
    // The implicit integrator solves to 1e-12.
    const double tolerance = integrator == JelloIntegrator::backwardEuler ? 1e-10 : 1e-13;
    EXPECT_LT((stepper.momentum() - before).norm(), tolerance * scale) << nameOf(integrator);
  }
}

TEST(JelloStepper, EnergyAndAngularMomentumAreKeptByAFineRungeKutta) {
  JelloStepper stepper = stepperOf(crumpled(4, 0.0), JelloIntegrator::rungeKutta4, 2e-4);
  const double energy = stepper.energy().total();
  const Vec3 turning = stepper.angularMomentum();
  ASSERT_GT(stepper.energy().elastic, 0.1 * energy);
  run(stepper, 0.5);
  EXPECT_NEAR(stepper.energy().total(), energy, 1e-6 * energy);
  EXPECT_LT((stepper.angularMomentum() - turning).norm(), 1e-7 * turning.norm());
}

// Springs pull along themselves, so that symplectic Euler keeps the angular momentum at any step.
TEST(JelloStepper, AngularMomentumIsKeptToRoundingBySymplecticEuler) {
  JelloStepper stepper = stepperOf(crumpled(4, 0.05), JelloIntegrator::symplecticEuler, 2e-3);
  const Vec3 turning = stepper.angularMomentum();
  run(stepper, 1.0);
  EXPECT_LT((stepper.angularMomentum() - turning).norm(), 1e-12 * turning.norm());
}

TEST(JelloStepper, DampedEnergyNeverGrows) {
  for (const JelloIntegrator integrator :
       {JelloIntegrator::midpoint, JelloIntegrator::rungeKutta4, JelloIntegrator::backwardEuler}) {
    JelloStepper stepper = stepperOf(crumpled(4, 0.05), integrator, 2e-4);
    double energy = stepper.energy().total();
    for (int index = 0; index < 1000; ++index) {
      ASSERT_TRUE(stepper.advance());
      const double now = stepper.energy().total();
      ASSERT_LE(now, energy * (1.0 + 1e-13)) << nameOf(integrator) << " " << index;
      energy = now;
    }
  }
}

/// Largest distance (m) from the places where a fine run ends.
double errorOf(JelloIntegrator integrator, double step, const std::vector<Vec3>& reference) {
  JelloStepper stepper = stepperOf(crumpled(3, 0.02), integrator, step);
  run(stepper, 0.064);
  double worst = 0.0;
  for (std::size_t point = 0; point < reference.size(); ++point)
    worst = std::max(worst, (stepper.position(point) - reference[point]).norm());
  return worst;
}

TEST(JelloStepper, ConvergesAtTheOrderOfItsIntegrator) {
  JelloStepper fine = stepperOf(crumpled(3, 0.02), JelloIntegrator::rungeKutta4, 1e-5);
  run(fine, 0.064);
  std::vector<Vec3> reference;
  for (std::size_t point = 0; point < 27; ++point)
    reference.push_back(fine.position(point));
  const std::array<double, kJelloIntegrators> orders = {1.0, 1.0, 2.0, 4.0, 1.0, 2.0};
  const std::array<double, kJelloIntegrators> steps = {1.25e-4, 1.25e-4, 5e-4, 2e-3, 1.25e-4, 5e-4};
  for (std::size_t which = 0; which < kAll.size(); ++which) {
    const double coarse = errorOf(kAll[which], steps[which], reference);
    const double half = errorOf(kAll[which], 0.5 * steps[which], reference);
    EXPECT_NEAR(std::log2(coarse / half), orders[which], 0.1 * orders[which])
        << nameOf(kAll[which]) << " " << coarse << " " << half;
  }
}

TEST(JelloStepper, VolumeIsThatOfTheBoxHoweverItIsShearedAndTurned) {
  JelloWorld world = crumpled(4, 0.0);
  const Quat turn(Eigen::AngleAxisd(1.0, Vec3(1, 2, 3).normalized()));
  world.positions = restingPoints(world.lattice, {5.0, 2.0, 1.0}, turn);
  EXPECT_NEAR(stepperOf(world, JelloIntegrator::midpoint, 1.0).volume(), 0.96, 1e-12);
  for (Vec3& point : world.positions)
    point += Vec3(0.5 * point.y() - 0.2 * point.z(), 0.0, 0.0);
  EXPECT_NEAR(stepperOf(world, JelloIntegrator::midpoint, 1.0).volume(), 0.96, 1e-12);
  for (Vec3& point : world.positions)
    point.z() *= 1.1;
  EXPECT_NEAR(stepperOf(world, JelloIntegrator::midpoint, 1.0).volume(), 1.056, 1e-12);
}

// A jello's centre falls freely by half g t^2, whatever its springs do.
TEST(JelloStepper, ItsCentreFallsAsAStoneDoes) {
  JelloWorld world = crumpled(4, 0.1);
  world.gravity = {0.0, -9.81, 0.0};
  JelloStepper stepper = stepperOf(world, JelloIntegrator::rungeKutta4, 1e-3);
  const Vec3 from = stepper.centre();
  const Vec3 speed = stepper.jelloMomentum() / (64 * 0.01);
  run(stepper, 0.5);
  const Vec3 expected = from + 0.5 * speed + 0.125 * world.gravity;
  EXPECT_LT((stepper.centre() - expected).norm(), 1e-12);
}

// At rest in a box the floor bears the jello's weight: each of the lowest points sinks in.
TEST(JelloStepper, ComesToRestOnTheFloorWithItsWeightOnIt) {
  JelloWorld world;
  world.lattice = {
      .count = 4, .size = Vec3::Ones(), .pointMass = 0.01, .stiffness = 100.0, .damping = 0.3};
  world.contact = {.stiffness = 1000.0, .damping = 1.0};
  world.gravity = {0.0, -9.81, 0.0};
  world.room = JelloBox{{-2, -0.5, -2}, {2, 4, 2}};
  world.positions = restingPoints(world.lattice, Vec3::Zero());
  world.velocities.assign(64, Vec3::Zero());
  JelloStepper stepper = stepperOf(world, JelloIntegrator::rungeKutta4, 1e-3);
  run(stepper, 20.0);
  EXPECT_LT(stepper.energy().kinetic, 1e-12);
  double borne = 0.0;
  for (std::size_t point = 0; point < 64; ++point)
    borne += 1000.0 * std::max(0.0, -0.5 - stepper.position(point).y());
  EXPECT_NEAR(borne, 0.64 * 9.81, 1e-5);
}

// A marble flies into a jello in free space: the total momentum stays, and the impulses of the
// marble's touches are all that it gained.
TEST(JelloStepper, AMarbleAndAJelloPushEachOtherAlike) {
  for (const JelloIntegrator integrator : kAll) {
    JelloWorld world = crumpled(5, 0.05);
    world.balls = {{.id = 1,
                    .radius = 0.2,
                    .mass = 0.3,
                    .position = {0.2, 1.0, -0.3},
                    .velocity = {0.0, -2.0, 0.0}}};
    JelloStepper stepper = stepperOf(world, integrator, 1e-4);
    const Vec3 before = stepper.momentum();
    Vec3 given = Vec3::Zero();
    for (int index = 0; index < 3000; ++index) {
      ASSERT_TRUE(stepper.advance());
      given += stepper.touches()[0].impulse;
    }
    const Vec3 gained = 0.3 * (stepper.ballVelocity(0) - world.balls[0].velocity);
    EXPECT_LT((stepper.momentum() - before).norm(), 1e-9) << nameOf(integrator);
    EXPECT_GT(gained.y(), 0.1) << nameOf(integrator);
    // The implicit integrator reports the force at the begin of each step.
    const double tolerance = integrator == JelloIntegrator::backwardEuler ? 0.05 : 1e-9;
    EXPECT_LT((given - gained).norm(), tolerance * gained.norm()) << nameOf(integrator);
  }
}

TEST(JelloStepper, AFieldPushesAsMuchAsBetweenItsGridPoints) {
  JelloWorld world = crumpled(2, 0.0);
  world.lattice.stiffness = 0.0;
  world.lattice.damping = 0.0;
  world.velocities.assign(8, Vec3::Zero());
  // The field is linear in x and y: trilinear interpolation is exact, and clamped outside.
  world.field = {.count = 3, .min = {-1, -1, -1}, .max = {1, 1, 1}, .forces = {}};
  for (const double x : {-1.0, 0.0, 1.0})
    for (const double y : {-1.0, 0.0, 1.0})
      for (int z = 0; z < 3; ++z)
        world.field.forces.emplace_back(x, 2.0 * y, 0.5);
  world.positions[0] = {0.3, -0.7, 0.2};
  world.positions[1] = {-5.0, 0.5, 9.0};
  JelloStepper stepper = stepperOf(world, JelloIntegrator::explicitEuler, 1e-3);
  ASSERT_TRUE(stepper.advance());
  EXPECT_LT((stepper.velocity(0) - 0.1 * Vec3(0.3, -1.4, 0.5)).norm(), 1e-12);
  EXPECT_LT((stepper.velocity(1) - 0.1 * Vec3(-1.0, 1.0, 0.5)).norm(), 1e-12);
}

TEST(JelloStepper, ABlowUpIsAnErrorAndKeepsWhatWas) {
  JelloStepper stepper = stepperOf(crumpled(4, 0.0), JelloIntegrator::explicitEuler, 0.05);
  Status status = std::monostate{};
  while (status) {
    ASSERT_LT(stepper.steps(), 10000U);
    status = stepper.advance();
  }
  EXPECT_THAT(status.error().message, testing::HasSubstr("blew up at"));
  EXPECT_THAT(status.error().message, testing::HasSubstr("explicit_euler at steps of 50"));
  for (std::size_t point = 0; point < 64; ++point) {
    EXPECT_TRUE(stepper.position(point).allFinite());
    EXPECT_TRUE(stepper.velocity(point).allFinite());
  }
}

TEST(JelloStepper, WhatIsNoWorldIsRefused) {
  const auto reason = [](auto change) {
    JelloWorld world = crumpled(3, 0.1);
    change(world);
    const auto stepper = JelloStepper::create(world, JelloIntegrator::midpoint, 1e-3);
    return stepper ? std::string("none") : stepper.error().message;
  };
  using testing::HasSubstr;
  EXPECT_EQ(reason([](JelloWorld&) {}), "none");
  EXPECT_THAT(reason([](JelloWorld& w) { w.lattice.count = 1; }), HasSubstr("expected 2 to 128"));
  EXPECT_THAT(reason([](JelloWorld& w) { w.lattice.size.y() = 0.0; }), HasSubstr("size"));
  EXPECT_THAT(reason([](JelloWorld& w) { w.lattice.pointMass = -1.0; }), HasSubstr("mass"));
  EXPECT_THAT(reason([](JelloWorld& w) { w.lattice.stiffness = NAN; }), HasSubstr("stiffness"));
  EXPECT_THAT(reason([](JelloWorld& w) { w.positions.pop_back(); }),
              HasSubstr("26 positions; expected 27"));
  EXPECT_THAT(reason([](JelloWorld& w) { w.velocities[4].x() = INFINITY; }),
              HasSubstr("number 4 of the velocities"));
  EXPECT_THAT(reason([](JelloWorld& w) {
                w.planes.push_back({0, {1, 1, 0}, 0.0});
              }),
              HasSubstr("length 1"));
  EXPECT_THAT(reason([](JelloWorld& w) { w.field.count = 2; }), HasSubstr("expected 2^3"));
  EXPECT_FALSE(JelloStepper::create(crumpled(3, 0.1), JelloIntegrator::midpoint, 0.0));
}

// A large lattice is computed in two halves, possibly by two threads: no force between them may get
// lost, and the result must not depend on the order of the halves.
TEST(JelloStepper, ALargeLatticeIsWholeAndTheSameEveryTime) {
  const JelloWorld world = crumpled(JelloStepper::kSplitFrom, 0.02);
  JelloStepper stepper = stepperOf(world, JelloIntegrator::explicitEuler, 1e-5);
  ASSERT_TRUE(stepper.advance());
  // The expected forces are summed spring by spring.
  std::vector<Vec3> forces(world.pointCount(), Vec3::Zero());
  const Vec3 spacing = world.lattice.size / static_cast<double>(world.lattice.count - 1);
  forEachSpring(world.lattice, [&](std::size_t a, std::size_t b, std::size_t which) {
    const auto& to = jelloSprings()[which].to;
    const Vec3 away = world.positions[a] - world.positions[b];
    const double rest = spacing.cwiseProduct(Vec3(to[0], to[1], to[2])).norm();
    const Vec3 along = away.normalized();
    const Vec3 push = -(40.0 * (away.norm() - rest) +
                        0.02 * along.dot(world.velocities[a] - world.velocities[b])) *
                      along;
    forces[a] += push;
    forces[b] -= push;
  });
  for (std::size_t point = 0; point < world.pointCount(); ++point) {
    const Vec3 expected = world.velocities[point] + 1e-5 / 0.01 * forces[point];
    ASSERT_LT((stepper.velocity(point) - expected).norm(), 1e-14 * 40.0) << point;
  }
  JelloStepper one = stepperOf(world, JelloIntegrator::rungeKutta4, 1e-4);
  JelloStepper two = stepperOf(world, JelloIntegrator::rungeKutta4, 1e-4);
  for (int step = 0; step < 10; ++step)
    ASSERT_TRUE(one.advance() && two.advance());
  for (std::size_t point = 0; point < world.pointCount(); ++point)
    ASSERT_EQ(one.position(point), two.position(point)) << point;
}

}  // namespace
}  // namespace carom::test
