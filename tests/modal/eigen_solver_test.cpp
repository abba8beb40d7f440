#include "modal/analysis/eigen_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include <Eigen/Eigenvalues>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/random.h"

namespace carom {

using namespace modal;

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing::HasSubstr;

SparseMatrix sparse(const MatrixXd& dense) {
  return dense.sparseView();
}

SparseMatrix identity(Index size) {
  SparseMatrix matrix(size, size);
  matrix.setIdentity();
  return matrix;
}

// Stiffness of unit masses in a row with unit springs between them, free at both ends or held at
// the first.
MatrixXd chain(Index masses, bool held) {
  MatrixXd stiffness = MatrixXd::Zero(masses, masses);
  for (Index mass = 0; mass + 1 < masses; ++mass) {
    stiffness(mass, mass) += 1.0;
    stiffness(mass + 1, mass + 1) += 1.0;
    stiffness(mass, mass + 1) = stiffness(mass + 1, mass) = -1.0;
  }
  if (held) stiffness(0, 0) += 1.0;
  return stiffness;
}

// Eigenvalue of the free chain, by the discrete cosine transform that diagonalises it.
double chainLambda(Index mode, Index masses) {
  const double angle = std::numbers::pi * static_cast<double>(mode) / static_cast<double>(masses);
  return 2.0 - 2.0 * std::cos(angle);
}

EigenSolution solved(const SparseMatrix& stiffness, const SparseMatrix& mass,
                     const EigenSettings& settings) {
  Result<EigenSolution> solution = lowestModes(stiffness, mass, settings);
  EXPECT_TRUE(solution) << (solution ? "" : solution.error().message);
  return solution ? *std::move(solution) : EigenSolution{};
}

EigenSettings modes(Index count) {
  EigenSettings settings;
  settings.modes = count;
  return settings;
}

void expectModes(const EigenSolution& solution, const SparseMatrix& stiffness,
                 const SparseMatrix& mass, double largest) {
  const Index count = solution.lambda.size();
  ASSERT_EQ(solution.vectors.cols(), count);
  const MatrixXd gram = solution.vectors.transpose() * (mass * solution.vectors);
  EXPECT_LT((gram - MatrixXd::Identity(count, count)).norm(), 1e-9);
  const MatrixXd energy = solution.vectors.transpose() * (stiffness * solution.vectors);
  EXPECT_LT((energy - MatrixXd(solution.lambda.asDiagonal())).norm(), 1e-8 * largest);
}

TEST(EigenSolver, FindsTheModesOfAHeldChain) {
  const Index masses = 300;
  const SparseMatrix stiffness = sparse(chain(masses, true));
  const EigenSolution solution = solved(stiffness, identity(masses), modes(20));
  ASSERT_EQ(solution.lambda.size(), 20);
  for (Index mode = 0; mode < 20; ++mode) {
    // The closed form is from Rayleigh, Theory of Sound, section 120: a chain with a held and a
    // free end.
    const double half = std::numbers::pi * (2.0 * static_cast<double>(mode) + 1.0) /
                        (2.0 * (2.0 * static_cast<double>(masses) + 1.0));
    const double expected = 4.0 * std::sin(half) * std::sin(half);
    EXPECT_NEAR(solution.lambda[mode], expected, 1e-10 * expected);
  }
  EXPECT_TRUE(solution.counted);
  EXPECT_LT(solution.residual, 1e-5);
  expectModes(solution, stiffness, identity(masses), 4.0);
}

TEST(EigenSolver, FindsTheSameInAnOrderThatIsGiven) {
  const Index masses = 300;
  EigenSettings settings = modes(12);
  settings.highest = 4.0;  // counted with both signs of pivots
  for (const int step : {1, 7, 149}) {
    settings.order.clear();
    for (int row = 0; row < masses; ++row)
      settings.order.push_back(row * step % static_cast<int>(masses));
    const EigenSolution solution = solved(sparse(chain(masses, false)), identity(masses), settings);
    ASSERT_EQ(solution.lambda.size(), 12);
    for (Index mode = 1; mode < 12; ++mode)
      EXPECT_NEAR(solution.lambda[mode], chainLambda(mode, masses),
                  1e-10 * chainLambda(mode, masses))
          << step;
    EXPECT_TRUE(solution.counted);
    EXPECT_EQ(solution.below, masses);
  }
}

TEST(EigenSolver, FindsTheRigidModeOfAFreeChain) {
  const Index masses = 200;
  const EigenSolution solution = solved(sparse(chain(masses, false)), identity(masses), modes(12));
  ASSERT_EQ(solution.lambda.size(), 12);
  EXPECT_NEAR(solution.lambda[0], 0.0, 1e-12);
  const double even = 1.0 / std::sqrt(static_cast<double>(masses));
  EXPECT_LT((solution.vectors.col(0).cwiseAbs().array() - even).abs().maxCoeff(), 1e-8);
  for (Index mode = 1; mode < 12; ++mode)
    EXPECT_NEAR(solution.lambda[mode], chainLambda(mode, masses),
                1e-10 * chainLambda(mode, masses));
  EXPECT_TRUE(solution.counted);
}

// The eigenvalues of a free three-dimensional lattice are sums of the chain's, with multiplicities.
TEST(EigenSolver, FindsEveryCopyOfMultipleModes) {
  const Index side = 9;
  const Index size = side * side * side;
  const MatrixXd line = chain(side, false);
  std::vector<Eigen::Triplet<double>> entries;
  std::vector<double> expected;
  const auto at = [&](Index x, Index y, Index z) { return (z * side + y) * side + x; };
  for (Index z = 0; z < side; ++z) {
    for (Index y = 0; y < side; ++y) {
      for (Index x = 0; x < side; ++x) {
        expected.push_back(chainLambda(x, side) + chainLambda(y, side) + chainLambda(z, side));
        for (Index other = 0; other < side; ++other) {
          entries.emplace_back(at(x, y, z), at(other, y, z), line(x, other));
          entries.emplace_back(at(x, y, z), at(x, other, z), line(y, other));
          entries.emplace_back(at(x, y, z), at(x, y, other), line(z, other));
        }
      }
    }
  }
  SparseMatrix stiffness(size, size);
  stiffness.setFromTriplets(entries.begin(), entries.end());
  stiffness.prune(0.0);
  std::sort(expected.begin(), expected.end());
  const EigenSolution solution = solved(stiffness, identity(size), modes(60));
  ASSERT_EQ(solution.lambda.size(), 60);
  for (Index mode = 0; mode < 60; ++mode)
    EXPECT_NEAR(solution.lambda[mode], expected[static_cast<std::size_t>(mode)], 1e-9);
  EXPECT_TRUE(solution.counted);
  expectModes(solution, stiffness, identity(size), 12.0);
}

// The modes have more copies than a block of vectors has columns.
TEST(EigenSolver, FindsTheRigidModesOfTwentySeparateBodies) {
  const Index bodies = 20;
  const Index masses = 15;
  MatrixXd stiffness = MatrixXd::Zero(bodies * masses, bodies * masses);
  for (Index body = 0; body < bodies; ++body)
    stiffness.block(body * masses, body * masses, masses, masses) = chain(masses, false);
  const EigenSolution solution =
      solved(sparse(stiffness), identity(bodies * masses), modes(2 * bodies + 3));
  ASSERT_EQ(solution.lambda.size(), 2 * bodies + 3);
  for (Index mode = 0; mode < solution.lambda.size(); ++mode)
    EXPECT_NEAR(solution.lambda[mode], chainLambda(mode / bodies, masses), 1e-9) << mode;
  EXPECT_TRUE(solution.counted);
  expectModes(solution, sparse(stiffness), identity(bodies * masses), 4.0);
}

TEST(EigenSolver, FindsEqualModesWhereEveryVectorIsOne) {
  const EigenSolution solution = solved(5.0 * identity(50), identity(50), modes(12));
  ASSERT_EQ(solution.lambda.size(), 12);
  EXPECT_LT((solution.lambda.array() - 5.0).abs().maxCoeff(), 1e-9);
  expectModes(solution, 5.0 * identity(50), identity(50), 5.0);
}

// The oracle is a dense solver of another kind, and the mass matrix is full.
TEST(EigenSolver, AgreesWithADenseSolverForAnyMass) {
  const Index size = 60;
  Random random(3);
  const auto someMatrix = [&] {
    MatrixXd matrix(size, size);
    for (double& value : matrix.reshaped())
      value = random.between(-1.0, 1.0);
    return matrix;
  };
  const MatrixXd half = someMatrix().leftCols(size - 3);  // so that three lambdas are 0
  const MatrixXd other = someMatrix();
  const MatrixXd stiffness = half * half.transpose();
  const MatrixXd mass = other * other.transpose() + 3.0 * MatrixXd::Identity(size, size);
  const VectorXd expected =
      Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd>(stiffness, mass).eigenvalues();
  for (const Index count : {Index{5}, Index{30}, size, size + 100}) {
    const EigenSolution solution = solved(sparse(stiffness), sparse(mass), modes(count));
    ASSERT_EQ(solution.lambda.size(), std::min(count, size));
    for (Index mode = 0; mode < solution.lambda.size(); ++mode)
      EXPECT_NEAR(solution.lambda[mode], expected[mode], 1e-8 * expected[size - 1]) << mode;
    EXPECT_TRUE(solution.counted);
    expectModes(solution, sparse(stiffness), sparse(mass), expected[size - 1]);
  }
}

TEST(EigenSolver, SolvesOneDegreeOfFreedom) {
  const EigenSolution solution = solved(8.0 * identity(1), 2.0 * identity(1), {});
  ASSERT_EQ(solution.lambda.size(), 1);
  EXPECT_NEAR(solution.lambda[0], 4.0, 1e-12);
  EXPECT_NEAR(std::abs(solution.vectors(0, 0)), std::sqrt(0.5), 1e-12);
}

TEST(EigenSolver, StopsAtTheHighestAndSaysHowManyAreBelow) {
  const Index masses = 200;
  EigenSettings settings = modes(100);
  settings.highest = 0.5 * (chainLambda(24, masses) + chainLambda(25, masses));
  const SparseMatrix stiffness = sparse(chain(masses, false));
  EigenSolution solution = solved(stiffness, identity(masses), settings);
  EXPECT_EQ(solution.below, 25);
  ASSERT_EQ(solution.lambda.size(), 25);
  EXPECT_NEAR(solution.lambda[24], chainLambda(24, masses), 1e-10);
  EXPECT_TRUE(solution.counted);

  settings.modes = 10;
  solution = solved(stiffness, identity(masses), settings);
  EXPECT_EQ(solution.below, 25);
  EXPECT_EQ(solution.lambda.size(), 10);
  EXPECT_TRUE(solution.counted);

  settings.highest = -1.0;  // no mode is as low
  EXPECT_EQ(solved(stiffness, identity(masses), settings).lambda.size(), 0);
}

TEST(EigenSolver, GivesTheSameBitsAgain) {
  const SparseMatrix stiffness = sparse(chain(400, true));
  const EigenSolution once = solved(stiffness, identity(400), modes(15));
  const EigenSolution again = solved(stiffness, identity(400), modes(15));
  EXPECT_EQ(once.lambda, again.lambda);
  EXPECT_EQ(once.vectors, again.vectors);
}

TEST(EigenSolver, CanBeCancelledWheneverItReports) {
  const SparseMatrix stiffness = sparse(chain(200, true));
  EigenSettings settings = modes(20);
  settings.highest = 1.0;
  int reports = 0;
  double last = 0.0;
  const auto count = [&](std::string_view, double fraction) {
    ++reports;
    EXPECT_GE(fraction, last);
    EXPECT_LE(last = fraction, 1.0);
    return true;
  };
  ASSERT_TRUE(lowestModes(stiffness, identity(200), settings, count));
  ASSERT_GT(reports, 3);
  for (int until = 0; until < reports; ++until) {
    int left = until;
    const Result<EigenSolution> solution = lowestModes(
        stiffness, identity(200), settings, [&](std::string_view, double) { return left-- > 0; });
    ASSERT_FALSE(solution);
    EXPECT_EQ(solution.error().message, kCancelled);
  }
}

TEST(EigenSolver, RefusesWhatCannotBeSolved) {
  const auto refusal = [](const SparseMatrix& stiffness, const SparseMatrix& mass,
                          const EigenSettings& settings = {}) {
    const Result<EigenSolution> solution = lowestModes(stiffness, mass, settings);
    return solution ? std::string() : solution.error().message;
  };
  EXPECT_THAT(refusal(identity(3), identity(4)), HasSubstr("3 by 3 and the mass 4 by 4"));
  EXPECT_THAT(refusal(SparseMatrix(), SparseMatrix()), HasSubstr("0 by 0"));
  EXPECT_THAT(refusal(identity(3), identity(3), modes(0)), HasSubstr("0 modes"));
  EXPECT_THAT(refusal(identity(3), -1.0 * identity(3)), HasSubstr("positive definite"));
  EigenSettings settings;
  settings.shift = 1.0;
  EXPECT_THAT(refusal(identity(3), identity(3), settings), HasSubstr("shift"));
  settings = {};
  settings.tolerance = 0.0;
  EXPECT_THAT(refusal(identity(3), identity(3), settings), HasSubstr("tolerance"));
}

}  // namespace
}  // namespace carom
