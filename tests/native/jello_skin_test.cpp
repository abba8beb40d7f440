#include "native/jello/jello_skin.h"

#include <array>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "native/jello/jello_world.h"
#include "tests/support/random.h"

namespace carom::test {

using namespace native;

namespace {

struct Points {
  explicit Points(const std::vector<Vec3>& points) {
    for (const Vec3& point : points)
      for (std::size_t axis = 0; axis < 3; ++axis)
        places[axis].push_back(point[static_cast<Eigen::Index>(axis)]);
  }
  JelloSkin::Places view() const { return {places[0].data(), places[1].data(), places[2].data()}; }
  std::array<std::vector<double>, 3> places;
};

/// A box of 2 x 2 x 2 m about the origin, of 5 points along each axis.
const JelloLattice kBox{.count = 5, .size = Vec3::Constant(2.0)};

/// Height in m above a box with half edges of 1 m; negative inside.
double heightAbove(const Vec3& point) {
  const Vec3 beyond = point.cwiseAbs() - Vec3::Ones();
  return beyond.cwiseMax(0.0).norm() + std::min(0.0, beyond.maxCoeff());
}

TEST(JelloSkin, ABallIsAsDeepAsItIsInTheBox) {
  const JelloSkin skin(kBox.count);
  Random random(3);
  const Quat turned(Eigen::AngleAxisd(0.7, Vec3(1.0, 2.0, -0.5).normalized()));
  const Points points(restingPoints(kBox, {0.3, -0.2, 0.1}, turned));
  int inside = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const Vec3 local = 1.6 * random.inCube();
    const Vec3 middle = turned * local + Vec3(0.3, -0.2, 0.1);
    const double radius = 0.3;
    const double height = heightAbove(local);
    const auto contact = skin.meet(points.view(), middle, radius);
    ASSERT_EQ(contact.has_value(), height < radius) << local.transpose();
    if (!contact) continue;
    inside += height < 0.0 ? 1 : 0;
    EXPECT_NEAR(contact->depth, radius - height, 1e-12);
    EXPECT_NEAR(contact->normal.norm(), 1.0, 1e-12);
    EXPECT_LT((middle - height * contact->normal - contact->place).norm(), 1e-12);
    Vec3 mean = Vec3::Zero();
    for (std::size_t corner = 0; corner < 3; ++corner) {
      EXPECT_GE(contact->weights[corner], 0.0);
      const std::size_t at = contact->points[corner];
      mean += contact->weights[corner] *
              Vec3(points.places[0][at], points.places[1][at], points.places[2][at]);
    }
    EXPECT_LT((mean - contact->place).norm(), 1e-12);
  }
  EXPECT_GT(inside, 300);
}

// The middle is equally near to all six faces, and inside all the same.
TEST(JelloSkin, ABallInTheVeryMiddleIsInside) {
  const JelloSkin skin(kBox.count);
  const Points points(restingPoints(kBox, Vec3::Zero()));
  const auto contact = skin.meet(points.view(), Vec3::Zero(), 0.1);
  ASSERT_TRUE(contact);
  EXPECT_NEAR(contact->depth, 1.1, 1e-12);
}

// For points exactly on faces, edges and corners there is no direction to the nearest point.
TEST(JelloSkin, ABallOnTheSkinIsPushedOutwards) {
  const JelloSkin skin(kBox.count);
  const Points points(restingPoints(kBox, Vec3::Zero()));
  for (const Vec3& middle :
       {Vec3(1.0, 0.2, 0.1), Vec3(1.0, 1.0, 0.1), Vec3(-1.0, 1.0, 1.0), Vec3(0.5, -1.0, 0.5)}) {
    const auto contact = skin.meet(points.view(), middle, 0.1);
    ASSERT_TRUE(contact);
    EXPECT_NEAR(contact->depth, 0.1, 1e-12);
    EXPECT_GT(contact->normal.dot(middle), 0.5);
  }
}

}  // namespace
}  // namespace carom::test
