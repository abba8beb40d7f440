#include "audio/model/surface_locator.h"

#include <algorithm>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/audio/meshes.h"
#include "tests/support/random.h"

namespace carom::test {

using namespace audio;

namespace {

Vec3 placeOf(const SurfacePoint& point, const SurfaceMesh& mesh) {
  Vec3 place = Vec3::Zero();
  for (std::size_t corner = 0; corner < 3; ++corner)
    place += point.weights[corner] * mesh.vertices[point.vertices[corner]];
  return place;
}

/// Distance to many points of every triangle: the true distance is less by at most what the gaps
/// between the points allow.
double nearestBySampling(const Vec3& point, const SurfaceMesh& mesh) {
  constexpr int kParts = 8;
  double least = std::numeric_limits<double>::infinity();
  for (const auto& [a, b, c] : mesh.triangles) {
    for (int i = 0; i <= kParts; ++i) {
      for (int j = 0; i + j <= kParts; ++j) {
        const double u = static_cast<double>(i) / kParts;
        const double v = static_cast<double>(j) / kParts;
        const Vec3 at =
            (1.0 - u - v) * mesh.vertices[a] + u * mesh.vertices[b] + v * mesh.vertices[c];
        least = std::min(least, (at - point).norm());
      }
    }
  }
  return least;
}

TEST(SurfaceLocator, FindsThePointThatASearchThroughAllTrianglesFinds) {
  const SurfaceMesh mesh = ellipsoidMesh({0.1, 0.05, 0.02}, 3);
  const SurfaceLocator locator(mesh);
  Random random(1);
  for (int trial = 0; trial < 200; ++trial) {
    const Vec3 point = 0.15 * random.inCube();
    const SurfacePoint found = locator.nearest(point);
    const double distance = (placeOf(found, mesh) - point).norm();
    const double sampled = nearestBySampling(point, mesh);
    EXPECT_LE(distance, sampled + 1e-15);
    EXPECT_GT(distance, sampled - 0.002);  // m, for gaps of an eighth of an edge
    EXPECT_EQ(mesh.triangles[found.triangle], found.vertices);
  }
}

/// A slab with a finely meshed knob on it: the vertex nearest to the middle of the slab belongs to
/// the knob.
TEST(SurfaceLocator, ALargeTriangleIsFoundBesideManySmallOnes) {
  SurfaceMesh mesh = boxMesh({1.0, 1.0, 0.01});
  const SurfaceMesh knob = ellipsoidMesh({0.02, 0.02, 0.02}, 3);
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  for (const Vec3& vertex : knob.vertices)
    mesh.vertices.emplace_back(vertex + Vec3(0.1, 0.2, 0.03));
  for (const auto& [a, b, c] : knob.triangles)
    mesh.triangles.push_back({first + a, first + b, first + c});
  const SurfacePoint found = SurfaceLocator(mesh).nearest({0.1, -0.1, 0.01});
  EXPECT_LT((placeOf(found, mesh) - Vec3(0.1, -0.1, 0.01)).norm(), 1e-12);
}

TEST(SurfaceLocator, APointOfTheSurfaceIsFoundWhereItIs) {
  const SurfaceMesh mesh = boxMesh({0.1, 0.02, 0.3});
  const SurfaceLocator locator(mesh);
  Random random(2);
  for (int trial = 0; trial < 500; ++trial) {
    Vec3 point = random.inCube().cwiseProduct(Vec3(0.1, 0.02, 0.3));
    const int axis = random.below(3);
    point[axis] = random.chance(0.5) ? mesh.vertices[0][axis] : mesh.vertices[7][axis];
    const SurfacePoint found = locator.nearest(point);
    EXPECT_LT((placeOf(found, mesh) - point).norm(), 1e-12);
    EXPECT_NEAR(found.weights[0] + found.weights[1] + found.weights[2], 1.0, 1e-12);
  }
}

TEST(SurfaceLocator, FarAwayItIsTheCornerOrTheFootOfThePerpendicular) {
  const SurfaceMesh mesh = boxMesh({1.0, 1.0, 1.0});
  const SurfaceLocator locator(mesh);
  EXPECT_LT((placeOf(locator.nearest({9.0, 9.0, 9.0}), mesh) - Vec3(1, 1, 1)).norm(), 1e-12);
  EXPECT_LT((placeOf(locator.nearest({5.0, 0.25, 0.5}), mesh) - Vec3(1, 0.25, 0.5)).norm(), 1e-12);
  EXPECT_LT((placeOf(locator.nearest({5.0, -9.0, 0.5}), mesh) - Vec3(1, -1, 0.5)).norm(), 1e-12);
}

TEST(SurfaceLocator, VerticesAloneAndTrianglesWithoutAreaAreFound) {
  SurfaceMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  EXPECT_EQ(SurfaceLocator(mesh).nearest({1.2, 3, 0}).vertices[0], 1u);
  mesh.triangles = {{0, 1, 2}, {1, 1, 1}};
  const SurfacePoint found = SurfaceLocator(mesh).nearest({1.2, 3, 0});
  EXPECT_TRUE(placeOf(found, mesh).allFinite());
  EXPECT_LT((placeOf(found, mesh) - Vec3(1.2, 0, 0)).norm(), 0.2 + 1e-12);
}

}  // namespace
}  // namespace carom::test
