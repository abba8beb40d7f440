#include "native/jello/jello_kernels.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/random.h"

namespace carom::test {

using namespace native;

namespace {

/// A crumpled lattice in arrays, to which forces have already been added.
struct Crumpled {
  JelloLattice lattice;
  std::vector<Vec3> positions;
  std::vector<Vec3> velocities;
  std::vector<double> values;
  std::vector<double> forces;

  Crumpled(std::size_t count, double damping, std::uint64_t seed) {
    lattice.count = count;
    lattice.size = {1.0, 0.7, 1.3};
    lattice.stiffness = 130.0;
    lattice.damping = damping;
    Random random(seed);
    positions = restingPoints(lattice, Vec3(0.3, -2.0, 1.0));
    for (Vec3& point : positions) {
      point += 0.3 / static_cast<double>(count) * random.inCube();
      velocities.push_back(random.inCube());
    }
    const std::size_t stride = positions.size() + 2 * kJelloSlack;
    values.resize(6 * stride);
    forces.resize(3 * stride, 0.25);
    for (std::size_t point = 0; point < positions.size(); ++point) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto index = static_cast<Eigen::Index>(axis);
        values[axis * stride + kJelloSlack + point] = positions[point][index];
        values[(axis + 3) * stride + kJelloSlack + point] = velocities[point][index];
      }
    }
  }

  JelloArrays arrays() {
    const std::size_t stride = positions.size() + 2 * kJelloSlack;
    JelloArrays made;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      made.positions[axis] = values.data() + axis * stride + kJelloSlack;
      made.velocities[axis] = values.data() + (axis + 3) * stride + kJelloSlack;
      made.forces[axis] = forces.data() + axis * stride + kJelloSlack;
    }
    return made;
  }
  Vec3 force(std::size_t point) {
    const JelloArrays made = arrays();
    return Vec3(made.forces[0][point], made.forces[1][point], made.forces[2][point]) -
           Vec3::Constant(0.25);
  }
};

TEST(JelloKernels, SpringsPullAsHookeAndTheDampingSay) {
  for (const std::size_t count : {2U, 3U, 8U, 11U}) {
    for (const double damping : {0.0, 0.7}) {
      Crumpled jello(count, damping, count);
      const JelloSprings springs(jello.lattice);
      jelloKernel().addSprings(springs, {0, springs.count}, jello.arrays());
      // The expected forces sum the formula over all pairs of neighbours, each pair from both
      // sides.
      const Vec3 spacing = jello.lattice.size / static_cast<double>(count - 1);
      const auto n = static_cast<int>(count);
      const auto placeOf = [n](std::size_t point) {
        const auto p = static_cast<int>(point);
        return Eigen::Vector3i(p / (n * n), p / n % n, p % n);
      };
      for (std::size_t a = 0; a < jello.positions.size(); ++a) {
        Vec3 expected = Vec3::Zero();
        for (std::size_t b = 0; b < jello.positions.size(); ++b) {
          const Eigen::Vector3i lead = (placeOf(a) - placeOf(b)).cwiseAbs();
          const bool isNext = lead.maxCoeff() == 1;
          const bool isBend = lead.maxCoeff() == 2 && lead.sum() == 2;
          if (!isNext && !isBend) continue;
          const Vec3 away = jello.positions[a] - jello.positions[b];
          const double rest = lead.cast<double>().cwiseProduct(spacing).norm();
          const Vec3 along = away / away.norm();
          expected -= jello.lattice.stiffness * (away.norm() - rest) * along;
          expected -= damping * (jello.velocities[a] - jello.velocities[b]).dot(along) * along;
        }
        EXPECT_LT((jello.force(a) - expected).norm(), 1e-12 * (100.0 + expected.norm()));
      }
    }
  }
}

TEST(JelloKernels, AllHaveTheSameBits) {
  for (const std::size_t count : {2U, 3U, 5U, 8U, 9U, 16U, 19U}) {
    for (const double damping : {0.0, 0.7}) {
      Crumpled plain(count, damping, 7 * count);
      const JelloSprings springs(plain.lattice);
      const JelloWall wall{{0.6, 0.0, 0.8}, 0.9, 2000.0, 0.3};
      plainJelloKernel().addSprings(springs, {0, springs.count}, plain.arrays());
      plainJelloKernel().addWall(wall, plain.positions.size(), plain.arrays());
      for (const JelloKernel& kernel : jelloKernels()) {
        Crumpled other(count, damping, 7 * count);
        kernel.addSprings(springs, {0, springs.count}, other.arrays());
        kernel.addWall(wall, other.positions.size(), other.arrays());
        EXPECT_TRUE(other.forces == plain.forces) << kernel.name << ", " << count;
      }
    }
  }
}

TEST(JelloKernels, AWallPushesBackWhatIsBeyondItAndNeverPulls) {
  Crumpled jello(5, 0.0, 3);
  const Vec3 normal(0.6, 0.0, 0.8);
  const JelloWall wall{{0.6, 0.0, 0.8}, 0.9, 2000.0, 300.0};
  jelloKernel().addWall(wall, jello.positions.size(), jello.arrays());
  int pushed = 0;
  for (std::size_t point = 0; point < jello.positions.size(); ++point) {
    const double depth = 0.9 - normal.dot(jello.positions[point]);
    const double push = 2000.0 * depth - 300.0 * normal.dot(jello.velocities[point]);
    const Vec3 expected = depth > 0.0 && push > 0.0 ? Vec3(push * normal) : Vec3::Zero();
    EXPECT_LT((jello.force(point) - expected).norm(), 1e-9) << point;
    pushed += expected.norm() > 0.0 ? 1 : 0;
  }
  EXPECT_GT(pushed, 10);
  EXPECT_LT(pushed, 115);
}

TEST(JelloKernels, PointsInOnePlaceAreNoInfinity) {
  Crumpled jello(3, 0.5, 1);
  std::ranges::fill(jello.values, 1.0);
  const JelloSprings springs(jello.lattice);
  jelloKernel().addSprings(springs, {0, springs.count}, jello.arrays());
  for (std::size_t point = 0; point < jello.positions.size(); ++point)
    EXPECT_EQ(jello.force(point), Vec3::Zero());
}

}  // namespace
}  // namespace carom::test
