#include "native/mechanics/resting.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/native/sphere_worlds.h"

namespace carom {

using namespace native;

namespace {

const Vec3 kPull{0.0, -9.81, 0.0};

TEST(Carried, InTheAirIsFreeFall) {
  EXPECT_EQ(carriedBy(kPull, {}).acceleration, kPull);
}

TEST(Carried, OnAFloorIsRestAndOnASlopeTheTangentialPull) {
  const std::vector<Vec3> floor{Vec3::UnitY()};
  EXPECT_EQ(carriedBy(kPull, floor).acceleration, Vec3::Zero());
  EXPECT_EQ(carriedBy(kPull, floor).touching, 1U);
  const std::vector<Vec3> slope{{std::sin(0.3), std::cos(0.3), 0.0}};
  const Vec3 down{std::cos(0.3), -std::sin(0.3), 0.0};
  EXPECT_LT((carriedBy(kPull, slope).acceleration - 9.81 * std::sin(0.3) * down).norm(), 1e-14);
}

TEST(Carried, AgainstACeilingOrWallThatDoesNotPressNothingHolds) {
  const std::vector<Vec3> ceiling{-Vec3::UnitY()};
  EXPECT_EQ(carriedBy(kPull, ceiling).acceleration, kPull);
  EXPECT_EQ(carriedBy(kPull, ceiling).touching, 0U);
  const std::vector<Vec3> wall{Vec3::UnitX()};
  EXPECT_EQ(carriedBy(kPull, wall).acceleration, kPull);
  EXPECT_EQ(carriedBy(kPull, wall).touching, 1U) << "it slides down along it";
}

TEST(Carried, InAGutterItRunsAlongAndInACornerItStays) {
  const Vec3 left = Vec3(1.0, 1.0, 0.0).normalized();
  const Vec3 right = Vec3(-1.0, 1.0, 0.1).normalized();
  const std::vector<Vec3> gutter{left, right};
  const Vec3 along = left.cross(right).normalized();
  EXPECT_LT((carriedBy(kPull, gutter).acceleration - along.dot(kPull) * along).norm(), 1e-14);
  const std::vector<Vec3> corner{left, right, Vec3(0.0, 0.2, -1.0).normalized()};
  EXPECT_EQ(carriedBy(kPull, corner).acceleration, Vec3::Zero());
  EXPECT_EQ(carriedBy(kPull, corner).touching, 7U);
}

TEST(Carried, OfTwoSlopesTheSteeperMayCarryNothing) {
  // The body slides down the gentle slope and leaves the steep wall.
  const std::vector<Vec3> normals{Vec3(0.1, 1.0, 0.0).normalized(), Vec3::UnitX()};
  const Carried carried = carriedBy(kPull, normals);
  EXPECT_EQ(carried.touching, 1U);
  EXPECT_GT(carried.acceleration.x(), 0.0);
}

// Gauss's principle: no admissible acceleration is nearer to the pull. The oracle tries random
// ones.
TEST(Carried, IsTheNearestAdmissibleAcceleration) {
  test::SplitMix random(3);
  for (int trial = 0; trial < 300; ++trial) {
    std::vector<Vec3> normals(static_cast<std::size_t>(1 + trial % 12));
    for (Vec3& normal : normals)
      normal = (random.inCube(1.0) + Vec3(0.0, 0.7, 0.0)).normalized();
    const Carried carried = carriedBy(kPull, normals);
    for (const Vec3& normal : normals)
      EXPECT_GE(normal.dot(carried.acceleration), -1e-10) << trial;
    const double distance = (carried.acceleration - kPull).norm();
    for (int other = 0; other < 200; ++other) {
      Vec3 candidate = carried.acceleration + random.inCube(std::pow(10.0, -(other % 5)));
      bool admissible = true;
      for (const Vec3& normal : normals)
        admissible = admissible && normal.dot(candidate) >= 0.0;
      if (admissible) {
        EXPECT_GE((candidate - kPull).norm(), distance - 1e-9) << trial;
      }
    }
  }
}

TEST(HeldVelocity, HasTheSpeedsOfTheSurfacesAndKeepsTheRest) {
  const std::vector<Vec3> normals{Vec3(1.0, 1.0, 0.0).normalized(),
                                  Vec3(0.0, 1.0, 0.3).normalized()};
  const std::vector<double> speeds{0.3, -0.1};
  const Vec3 velocity{1.0, 2.0, 3.0};
  const Vec3 held = heldVelocity(velocity, normals, speeds);
  for (std::size_t k = 0; k < 2; ++k)
    EXPECT_NEAR(normals[k].dot(held), speeds[k], 1e-15);
  const Vec3 along = normals[0].cross(normals[1]).normalized();
  EXPECT_NEAR(along.dot(held), along.dot(velocity), 1e-15);
}

TEST(HeldVelocity, BetweenThreeSurfacesAtRestIsZeroExactly) {
  const std::vector<Vec3> normals{Vec3(1.0, 1.0, 0.0).normalized(),
                                  Vec3(-1.0, 1.0, 0.2).normalized(),
                                  Vec3(0.1, 1.0, -1.0).normalized()};
  EXPECT_EQ(heldVelocity({1.0, 2.0, 3.0}, normals, std::vector<double>(3, 0.0)), Vec3::Zero());
}

}  // namespace
}  // namespace carom
