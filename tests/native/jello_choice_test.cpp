#include "native/jello/jello_choice.h"

#include <cmath>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "native/jello/jello_limits.h"

namespace carom {

using namespace native;

namespace {

/// A jello that is stretched by a tenth and let go.
JelloWorld stretched(double damping = 0.02) {
  JelloWorld world;
  world.lattice = {.count = 3,
                   .size = Vec3::Constant(0.5),
                   .pointMass = 0.02,
                   .stiffness = 80.0,
                   .damping = damping};
  world.positions = restingPoints(world.lattice, Vec3::Zero());
  for (Vec3& point : world.positions)
    point.x() *= 1.1;
  world.velocities.assign(world.pointCount(), Vec3::Zero());
  return world;
}

/// Root mean square distance in m from a run in steps of `fineStep` (s), the worst of all times.
double errorOf(const JelloWorld& world, const JelloStepping& stepping, double seconds,
               double fineStep = 1e-5) {
  JelloStepper fine = *JelloStepper::create(world, JelloIntegrator::rungeKutta4, fineStep);
  JelloStepper run = *JelloStepper::create(world, stepping.integrator, stepping.step);
  if (stepping.promise.error > 0.0) run.follow(stepping.promise);
  double worst = 0.0;
  while (run.time() + run.step() <= seconds) {
    EXPECT_TRUE(run.advance());
    while (fine.time() + fine.step() <= run.time())
      EXPECT_TRUE(fine.advance());
    const double rest = run.time() - fine.time();
    double sum = 0.0;
    for (std::size_t point = 0; point < world.pointCount(); ++point)
      sum +=
          (fine.position(point) + rest * fine.velocity(point) - run.position(point)).squaredNorm();
    worst = std::max(worst, std::sqrt(sum / static_cast<double>(world.pointCount())));
  }
  return worst;
}

// The error is compared at all times.
TEST(JelloChoice, TheErrorIsWhatIsPromised) {
  for (const double wanted : {1e-3, 1e-5, 1e-7}) {
    const auto choice = chooseStepping(stretched(), {}, {.error = wanted, .seconds = 0.5});
    ASSERT_TRUE(choice);
    EXPECT_EQ(choice->error, wanted);
    EXPECT_LT(errorOf(stretched(), choice->stepping, 0.5), wanted)
        << nameOf(choice->stepping.integrator);
  }
}

TEST(JelloChoice, TheErrorOfAGivenIntegratorIsWhatIsWanted) {
  for (const JelloIntegrator integrator :
       {JelloIntegrator::symplecticEuler, JelloIntegrator::midpoint, JelloIntegrator::rungeKutta4,
        JelloIntegrator::leapfrog}) {
    const double wanted = 1e-5;
    const auto choice = chooseStepping(stretched(), {},
                                       {.error = wanted, .seconds = 0.5, .integrator = integrator});
    ASSERT_TRUE(choice);
    const double error = errorOf(stretched(), choice->stepping, 0.5);
    EXPECT_LT(choice->error, 1.01 * wanted);
    EXPECT_LT(error, 3.0 * wanted) << nameOf(integrator);
    EXPECT_GT(error, 0.1 * std::min(wanted, choice->error)) << nameOf(integrator);
  }
}

TEST(JelloChoice, ExactnessTakesAHigherOrder) {
  const auto rough = chooseStepping(stretched(), {}, {.error = 1e-2, .seconds = 0.5});
  const auto exact = chooseStepping(stretched(), {}, {.error = 1e-8, .seconds = 0.5});
  ASSERT_TRUE(rough && exact);
  EXPECT_EQ(rough->stepping.integrator, JelloIntegrator::leapfrog);
  EXPECT_EQ(exact->stepping.integrator, JelloIntegrator::rungeKutta4);
  EXPECT_LT(rough->cost, exact->cost);
}

TEST(JelloChoice, WhatCannotBeKeptIsNotPromised) {
  const auto choice = chooseStepping(stretched(), {}, {.error = 1e-15, .seconds = 0.5});
  ASSERT_TRUE(choice);
  EXPECT_GT(choice->error, 1e-15);
}

/// A jello that nothing damps, whose points are up to `size` (m) off their places of rest.
JelloWorld shaken(double size) {
  JelloWorld world = stretched(0.0);
  world.positions = restingPoints(world.lattice, Vec3::Zero());
  double turn = 0.0;
  for (Vec3& point : world.positions)
    for (double& coordinate : point)
      coordinate += size * std::sin(turn += 2.4);  // by about the golden angle each
  return world;
}

/// Evaluations that a run of leapfrog takes at 90 % of its stable step.
double evaluationsOfWholeSteps(const JelloWorld& world, double seconds) {
  return seconds /
         (0.9 * jelloLimits(world).touching[static_cast<std::size_t>(JelloIntegrator::leapfrog)]);
}

// Where what swings is out of phase, errors do not grow: whole steps keep a promise that steps
// which are followed keep with far more of them.
TEST(JelloChoice, WhatIsOutOfPhaseTakesWholeSteps) {
  constexpr double kSeconds = 10.0;
  const JelloWorld world = shaken(1e-3);
  const auto choice = chooseStepping(world, {}, {.error = 3e-3, .seconds = kSeconds});
  ASSERT_TRUE(choice);
  EXPECT_EQ(choice->stepping.promise.error, 0.0);
  EXPECT_EQ(choice->error, 3e-3);
  EXPECT_LT(errorOf(world, choice->stepping, kSeconds, 1e-4), 3e-3);
  const double whole = evaluationsOfWholeSteps(world, kSeconds);
  EXPECT_LT(static_cast<double>(choice->spent) + kSeconds * choice->cost, 3.0 * whole);
  // Followed, the same jello takes more than twice as many evaluations for the run alone.
  JelloStepper followed =
      *JelloStepper::create(world, JelloIntegrator::leapfrog, kSeconds / std::ceil(whole));
  followed.follow({3e-3, kSeconds});
  while (followed.time() < kSeconds)
    ASSERT_TRUE(followed.advance());
  EXPECT_GT(static_cast<double>(followed.evaluations()), 2.0 * kSeconds * choice->cost);
}

// A tenth of the way that what swings goes is not kept by whole steps, however long they are tried.
TEST(JelloChoice, WhatIsOutOfPhaseIsFollowedWhereTheWishIsFiner) {
  constexpr double kSeconds = 4.0;
  const JelloWorld world = shaken(1e-3);
  const auto choice = chooseStepping(world, {}, {.error = 1e-4, .seconds = kSeconds});
  ASSERT_TRUE(choice);
  EXPECT_EQ(choice->stepping.promise.error, 1e-4);
  EXPECT_LT(errorOf(world, choice->stepping, kSeconds, 1e-4), 1e-4);
}

// At rest, leapfrog's two accelerations are the same, which once hid the error of its first step;
// and Runge-Kutta's estimate was a third of what came.
TEST(JelloChoice, WhatIsLetGoAtRestIsFollowedFromItsFirstStepOn) {
  const JelloWorld world = shaken(1e-3);
  const double step = 1.0 / std::ceil(evaluationsOfWholeSteps(world, 1.0));
  for (const JelloIntegrator integrator : {JelloIntegrator::leapfrog, JelloIntegrator::rungeKutta4})
    for (const double wanted : {2e-3, 2e-4, 2e-5})
      EXPECT_LT(errorOf(world, {integrator, step, {wanted, 1.0}}, 1.0, 1e-4), wanted)
          << nameOf(integrator) << ", " << wanted;
}

// Jello whose swings are damped costs little after a while, which its first steps do not tell.
TEST(JelloChoice, WhatDampsIsFollowed) {
  const auto choice = chooseStepping(stretched(), {}, {.error = 1e-3, .seconds = 40.0});
  ASSERT_TRUE(choice);
  EXPECT_EQ(choice->stepping.promise.error, 1e-3);
  EXPECT_LT(static_cast<double>(choice->spent), evaluationsOfWholeSteps(stretched(), 40.0));
}

/// A jello that falls on a floor, 0.1 m below it.
JelloWorld falling() {
  JelloWorld world = stretched();
  world.gravity = {0.0, -9.81, 0.0};
  world.contact = {.stiffness = 200.0, .damping = 0.05};
  world.planes.push_back({9, Vec3::UnitY(), world.positions.front().y() - 0.1});
  return world;
}

// The fall takes 0.14 s, a little less for the corners, which swing. A way after a contact is no
// promise, and takes no smaller steps.
TEST(JelloChoice, StepsAreWholeFromTheFirstContactOn) {
  const auto choice = chooseStepping(falling(), {}, {.error = 1e-9, .seconds = 1.0});
  ASSERT_TRUE(choice);
  JelloStepper stepper =
      *JelloStepper::create(falling(), choice->stepping.integrator, choice->stepping.step);
  stepper.follow(choice->stepping.promise);
  while (stepper.time() < 0.12)
    ASSERT_TRUE(stepper.advance());
  EXPECT_GT(stepper.evaluations(), 2 * stepper.steps());
  EXPECT_TRUE(std::isinf(stepper.metAt()));
  while (stepper.time() < 0.2)
    ASSERT_TRUE(stepper.advance());
  EXPECT_NEAR(stepper.metAt(), std::sqrt(0.2 / 9.81), 0.02);
  const std::size_t evaluations = stepper.evaluations();
  const std::size_t steps = stepper.steps();
  while (stepper.time() < 1.0)
    ASSERT_TRUE(stepper.advance());
  EXPECT_EQ(stepper.evaluations() - evaluations, stepper.steps() - steps);
}

// Beyond the first contact no step is small enough to find the same way again: it was looked for
// down to 1/1000 of the stable step.
TEST(JelloChoice, AGivenIntegratorIsChosenForTheWayToTheFirstContact) {
  const JelloLimits limits = jelloLimits(falling());
  const auto integrator = JelloIntegrator::rungeKutta4;
  const auto choice =
      chooseStepping(falling(), {}, {.error = 1e-4, .seconds = 2.0, .integrator = integrator});
  ASSERT_TRUE(choice);
  EXPECT_GT(choice->stepping.step, 0.1 * limits.touching[static_cast<std::size_t>(integrator)]);
}

TEST(JelloChoice, NoStepIsBeyondWhatIsStable) {
  const JelloLimits limits = jelloLimits(stretched());
  for (std::size_t which = 0; which < kJelloIntegrators; ++which) {
    const auto integrator = static_cast<JelloIntegrator>(which);
    const auto choice =
        chooseStepping(stretched(), {}, {.error = 1.0, .seconds = 0.2, .integrator = integrator});
    ASSERT_TRUE(choice) << nameOf(integrator);
    EXPECT_EQ(choice->stepping.integrator, integrator);
    EXPECT_LE(choice->stepping.step, 0.9001 * limits.free[which]);
  }
}

TEST(JelloChoice, WhatIsStableAtNoStepIsRefused) {
  const auto choice =
      chooseStepping(stretched(0.0), {},
                     {.error = 1e-3, .seconds = 0.2, .integrator = JelloIntegrator::explicitEuler});
  ASSERT_FALSE(choice);
  EXPECT_THAT(choice.error().message, testing::HasSubstr("explicit_euler is stable at no step"));
  EXPECT_TRUE(chooseStepping(stretched(0.0), {}, {.error = 1e-3, .seconds = 0.2}));
  EXPECT_FALSE(chooseStepping(stretched(), {}, {.error = 0.0}));
  EXPECT_FALSE(chooseStepping(stretched(), {}, {.seconds = NAN}));
  EXPECT_FALSE(chooseStepping({}, {}, {}));
}

}  // namespace
}  // namespace carom
