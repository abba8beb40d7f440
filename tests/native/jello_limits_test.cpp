#include "native/jello/jello_limits.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include "native/jello/jello_stepper.h"
#include "tests/support/jello_stiffness.h"
#include "tests/support/random.h"

namespace carom::test {

using namespace native;

namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

// The limits of h w without damping, in the integrators' order, are: none stable, 2, none stable, 2
// sqrt 2, infinite, 2.
TEST(JelloLimits, AnUndampedOscillatorIsThatOfTheBooks) {
  using enum JelloIntegrator;
  for (const double w : {0.1, 7.0, 1e5}) {
    EXPECT_EQ(largestStep(explicitEuler, w, 0.0), 0.0);
    EXPECT_NEAR(w * largestStep(symplecticEuler, w, 0.0), 2.0, 1e-12);
    EXPECT_EQ(largestStep(midpoint, w, 0.0), 0.0);
    EXPECT_NEAR(w * largestStep(rungeKutta4, w, 0.0), 2.0 * std::numbers::sqrt2, 1e-9);
    EXPECT_EQ(largestStep(backwardEuler, w, 0.0), kInfinite);
    EXPECT_NEAR(w * largestStep(leapfrog, w, 0.0), 2.0, 1e-9);
  }
}

/// The matrix of a step of leapfrog, from its definition: place, velocity and the acceleration that
/// the velocity in the middle is extrapolated by.
Eigen::Matrix3d leapfrogStep(double w, double c, double h) {
  const Eigen::RowVector3d middle(1.0, 0.5 * h, 0.0);
  const Eigen::RowVector3d speed(0.0, 1.0, 0.5 * h);
  const Eigen::RowVector3d push = -w * w * middle - c * speed;
  Eigen::Matrix3d step;
  step.row(2) = push;
  step.row(1) = Eigen::RowVector3d::UnitY() + h * push;
  step.row(0) = middle + 0.5 * h * step.row(1);
  return step;
}

/// Largest eigenvalue of a step's matrix, from the definition of the step.
double growthOf(JelloIntegrator integrator, double w, double c, double h) {
  if (integrator == JelloIntegrator::leapfrog)
    return leapfrogStep(w, c, h).eigenvalues().cwiseAbs().maxCoeff();
  Eigen::Matrix2d rates;
  rates << 0.0, 1.0, -w * w, -c;
  const Eigen::Matrix2d one = Eigen::Matrix2d::Identity();
  const Eigen::Matrix2d z = h * rates;
  Eigen::Matrix2d step = one;
  if (integrator == JelloIntegrator::explicitEuler) step = one + z;
  if (integrator == JelloIntegrator::midpoint) step = one + z * (one + 0.5 * z);
  if (integrator == JelloIntegrator::rungeKutta4)
    step = one + z * (one + 0.5 * z * (one + z / 3.0 * (one + 0.25 * z)));
  if (integrator == JelloIntegrator::symplecticEuler)
    step << 1.0 - h * h * w * w, h * (1.0 - h * c), -h * w * w, 1.0 - h * c;
  return step.eigenvalues().cwiseAbs().maxCoeff();
}

TEST(JelloLimits, ADampedOscillatorGrowsJustBeyondItsLimit) {
  using enum JelloIntegrator;
  for (const JelloIntegrator integrator :
       {explicitEuler, symplecticEuler, midpoint, rungeKutta4, leapfrog}) {
    for (const double damping : {0.01, 0.5, 1.9, 2.1, 30.0}) {
      const double limit = largestStep(integrator, 3.0, 3.0 * damping);
      EXPECT_LE(growthOf(integrator, 3.0, 3.0 * damping, 0.999 * limit), 1.0 + 1e-12)
          << nameOf(integrator) << damping;
      EXPECT_GT(growthOf(integrator, 3.0, 3.0 * damping, 1.001 * limit), 1.0)
          << nameOf(integrator) << damping;
    }
  }
}

/// Highest frequency, from all eigenvalues of the whole matrix.
double highestOf(const JelloLattice& lattice) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(stiffnessOf(lattice),
                                                              Eigen::EigenvaluesOnly);
  return std::sqrt(solver.eigenvalues().maxCoeff() / lattice.pointMass);
}

TEST(JelloLimits, HighestFrequencyIsThatOfTheWholeMatrix) {
  for (const std::size_t count : {2U, 3U, 5U, 6U}) {
    JelloWorld world;
    world.lattice = {.count = count,
                     .size = {1.0, 0.5, 2.0},
                     .pointMass = 0.003,
                     .stiffness = 250.0,
                     .damping = 0.0};
    const double expected = highestOf(world.lattice);
    EXPECT_NEAR(jelloLimits(world).highestFrequency, expected, 1e-3 * expected) << count;
  }
}

TEST(JelloLimits, ALargeLatticeIsNearlyOneWithoutEnd) {
  JelloWorld world;
  world.lattice = {
      .count = 24, .size = Vec3::Ones(), .pointMass = 0.01, .stiffness = 100.0, .damping = 0.0};
  const double finite = jelloLimits(world).highestFrequency;
  world.lattice.count = 25;
  const double endless = jelloLimits(world).highestFrequency;
  EXPECT_GT(endless, finite);
  EXPECT_LT(endless, 1.01 * finite);
}

// Runs begin to grow within 2 % of the limit, damped and undamped.
TEST(JelloLimits, RunsBlowUpJustBeyondTheirLimit) {
  using enum JelloIntegrator;
  struct Case {
    JelloIntegrator integrator;
    double damping;  // N s/m
  };
  for (const Case& one : {Case{symplecticEuler, 0.0}, Case{rungeKutta4, 0.0},
                          Case{symplecticEuler, 0.03}, Case{rungeKutta4, 0.03}, Case{leapfrog, 0.0},
                          Case{leapfrog, 0.03}, Case{explicitEuler, 0.3}, Case{midpoint, 0.3}}) {
    JelloWorld world;
    world.lattice = {.count = 4,
                     .size = Vec3::Ones(),
                     .pointMass = 0.01,
                     .stiffness = 100.0,
                     .damping = one.damping};
    world.positions = restingPoints(world.lattice, Vec3::Zero());
    Random random(2);
    for (std::size_t point = 0; point < world.pointCount(); ++point)
      world.velocities.emplace_back(1e-9 * random.inCube());
    const double limit = jelloLimits(world).free[static_cast<std::size_t>(one.integrator)];
    const auto blowsUp = [&](double step) {
      auto stepper = *JelloStepper::create(world, one.integrator, step);
      for (int index = 0; index < 3000; ++index) {
        if (!stepper.advance()) return true;
        if (stepper.energy().kinetic > 1e-6) return true;
      }
      return false;
    };
    EXPECT_FALSE(blowsUp(0.98 * limit)) << nameOf(one.integrator) << " " << one.damping;
    EXPECT_TRUE(blowsUp(1.02 * limit)) << nameOf(one.integrator) << " " << one.damping;
  }
}

TEST(JelloLimits, WallsMakeItStiffer) {
  JelloWorld world;
  world.lattice = {
      .count = 3, .size = Vec3::Ones(), .pointMass = 0.01, .stiffness = 1.0, .damping = 0.0};
  world.contact = {.stiffness = 1e4, .damping = 0.0};
  const auto rk4 = static_cast<std::size_t>(JelloIntegrator::rungeKutta4);
  EXPECT_EQ(jelloLimits(world).touching[rk4], jelloLimits(world).free[rk4]);
  world.room = JelloBox{{-2, -2, -2}, {2, 2, 2}};
  // The limit is nearly that of a point on the wall's spring alone.
  EXPECT_NEAR(jelloLimits(world).touching[rk4], 2.0 * std::numbers::sqrt2 / std::sqrt(1e6),
              1e-3 * jelloLimits(world).touching[rk4]);
}

}  // namespace
}  // namespace carom::test
