#include "carom/audio/surface_mesh.h"

#include <cstddef>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "tests/audio/meshes.h"
#include "tests/support/random.h"

namespace carom {
namespace {

TEST(SurfaceMesh, VolumeCentroidAndAreaOfABoxFarFromTheOrigin) {
  const Vec3 far(10, -20, 30);
  const SurfaceMesh box = mapped(boxMesh({1, 2, 3}), [&](const Vec3& v) { return Vec3(v + far); });
  EXPECT_NEAR(signedVolume(box), 48.0, 1e-12);
  EXPECT_NEAR(surfaceArea(box), 88.0, 1e-12);
  EXPECT_LT((volumeCentroid(box) - far).norm(), 1e-12);
  EXPECT_NEAR(signedVolume(turnedInsideOut(box)), -48.0, 1e-12);
  EXPECT_TRUE(closedSurface(box));
}

TEST(SurfaceMesh, SecondMomentIsTheSumOverABoxOfItsParallelAxes) {
  // About the middle of a box with half extents a, b, c the moment is V diag(a^2, b^2, c^2) / 3;
  // the parallel axis adds V d d^T.
  const Vec3 away(0.5, -2.0, 3.0);
  const SurfaceMesh box = mapped(boxMesh({1, 2, 3}), [&](const Vec3& v) { return Vec3(v + away); });
  Eigen::Matrix3d expected = Vec3(16.0, 64.0, 144.0).asDiagonal();
  EXPECT_LT((secondMoment(box, away) - expected).norm(), 1e-11);
  EXPECT_LT((secondMoment(turnedInsideOut(box), away) + expected).norm(), 1e-11);
  expected += 48.0 * away * away.transpose();
  EXPECT_LT((secondMoment(box, Vec3::Zero()) - expected).norm(), 1e-10);
}

/// Gives every triangle three vertices of its own.
SurfaceMesh soupOf(const SurfaceMesh& mesh) {
  SurfaceMesh soup;
  for (const auto& triangle : mesh.triangles) {
    const auto first = static_cast<std::uint32_t>(soup.vertices.size());
    for (const std::uint32_t corner : triangle)
      soup.vertices.push_back(mesh.vertices[corner]);
    soup.triangles.push_back({first, first + 1, first + 2});
  }
  return soup;
}

TEST(SurfaceMesh, ASoupOfTrianglesWeldsBackIntoTheClosedSurface) {
  const SurfaceMesh ball = ellipsoidMesh({1.0, 2.0, 3.0}, 4);
  SurfaceMesh soup = soupOf(ball);
  Random random(1);
  for (Vec3& vertex : soup.vertices)
    vertex += 1e-9 * random.inCube();
  ASSERT_FALSE(closedSurface(soup));
  const SurfaceMesh whole = welded(soup, 1e-8);
  EXPECT_EQ(whole.vertices.size(), ball.vertices.size());
  EXPECT_EQ(whole.triangles.size(), ball.triangles.size());
  EXPECT_TRUE(closedSurface(whole));
  EXPECT_NEAR(signedVolume(whole), signedVolume(ball), 1e-7);
  EXPECT_EQ(welded(soupOf(ball), 0.0).vertices.size(), ball.vertices.size());
}

TEST(SurfaceMesh, WeldingDropsWhatVanishesAndWhatNothingUses) {
  const SurfaceMesh mesh = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {9, 9, 9}, {1, 1e-7, 0}},
                            {{0, 1, 2}, {1, 4, 2}}};
  const SurfaceMesh whole = welded(mesh, 1e-6);
  EXPECT_EQ(whole.vertices.size(), 3u);
  EXPECT_EQ(whole.triangles.size(), 1u);
}

// All pairs are checked. The points lie in clusters so far apart that none reaches another.
TEST(SurfaceMesh, PointsAreCoincidentExactlyWhenTheyAreNear) {
  Random random(2);
  std::vector<Vec3> points;
  for (int cluster = 0; cluster < 60; ++cluster) {
    const Vec3 centre = random.inCube();
    for (int copy = random.below(5); copy >= 0; --copy)
      points.emplace_back(centre + 1e-5 * random.inCube());
  }
  const std::vector<std::uint32_t> stands = coincident(points, 4e-5);
  for (std::size_t one = 0; one < points.size(); ++one)
    for (std::size_t other = 0; other < points.size(); ++other)
      EXPECT_EQ(stands[one] == stands[other], (points[one] - points[other]).norm() <= 4e-5);
}

// Zero has two signs, and coordinates can be too large for the cells of a grid.
TEST(SurfaceMesh, CoincidenceHoldsForBothZerosAndForHugeNumbers) {
  const auto first = [](const std::vector<Vec3>& points, double distance) {
    return coincident(points, distance)[1];
  };
  EXPECT_EQ(first({{0.0, 0.0, 0.0}, {-0.0, 0.0, -0.0}}, 0.0), 0u);
  EXPECT_EQ(first({{1e-9, 0.0, 0.0}, {-1e-9, 0.0, 0.0}}, 1e-8), 1u);
  EXPECT_EQ(coincident({{1e-9, 0.0, 0.0}, {-1e-9, 0.0, 0.0}}, 1e-8)[0], 1u);
  EXPECT_EQ(first({{1e300, 0.0, 0.0}, {1e300, 0.0, 0.0}}, 1e-300), 0u);
  EXPECT_EQ(first({{1e300, 0.0, 0.0}, {-1e300, 0.0, 0.0}}, 1e-300), 1u);
}

}  // namespace
}  // namespace carom
