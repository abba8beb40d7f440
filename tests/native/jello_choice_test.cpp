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

/// Root mean square distance in m from a fine run, the worst of all times.
double errorOf(const JelloWorld& world, const JelloStepping& stepping, double seconds) {
  JelloStepper fine = *JelloStepper::create(world, JelloIntegrator::rungeKutta4, 1e-5);
  JelloStepper run = *JelloStepper::create(world, stepping.integrator, stepping.step);
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

TEST(JelloChoice, TheErrorIsWhatIsWanted) {
  for (const double wanted : {1e-3, 1e-5, 1e-7}) {
    const auto choice = chooseStepping(stretched(), {}, {.error = wanted, .seconds = 0.5});
    ASSERT_TRUE(choice);
    // The error that the choice expects is compared with the true one, over all times rather than
    // 16.
    const double error = errorOf(stretched(), choice->stepping, 0.5);
    EXPECT_LT(choice->error, 1.01 * wanted);
    EXPECT_LT(error, 3.0 * wanted) << nameOf(choice->stepping.integrator);
    EXPECT_GT(error, 0.1 * std::min(wanted, choice->error));
  }
}

TEST(JelloChoice, ExactnessTakesAHigherOrder) {
  const auto rough = chooseStepping(stretched(), {}, {.error = 1e-2, .seconds = 0.5});
  const auto exact = chooseStepping(stretched(), {}, {.error = 1e-8, .seconds = 0.5});
  ASSERT_TRUE(rough && exact);
  EXPECT_EQ(rough->stepping.integrator, JelloIntegrator::symplecticEuler);
  EXPECT_EQ(exact->stepping.integrator, JelloIntegrator::rungeKutta4);
  EXPECT_LT(rough->cost, exact->cost);
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
