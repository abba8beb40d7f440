#include "lab/fit/wall_thickness.h"

#include <gtest/gtest.h>

#include "tests/audio/meshes.h"
#include "tests/fit/round_trip_objects.h"

namespace carom::test {
namespace {

using namespace lab;

TEST(WallThickness, PlateAndTube) {
  EXPECT_NEAR(wallThickness(splitMesh(splitMesh(boxMesh({0.1, 0.07, 0.0015})))), 3e-3, 1e-4);
  const SurfaceMesh tube = latheMesh(
      {{0.03, 0.0}, {0.03, 0.05}, {0.03, 0.1}, {0.027, 0.1}, {0.027, 0.05}, {0.027, 0.0}}, 64);
  EXPECT_NEAR(wallThickness(tube), 3e-3, 1e-4);
}

TEST(WallThickness, BoxesKeepTheirEdges) {
  const SurfaceMesh thicker = thickened(boxMesh({0.05, 0.03, 0.004}), 0.002);
  for (const Vec3& vertex : thicker.vertices) {
    EXPECT_NEAR(std::abs(vertex.x()), 0.051, 1e-9);
    EXPECT_NEAR(std::abs(vertex.z()), 0.005, 1e-9);
  }
}

TEST(WallThickness, TubeGetsThickerByAsMuchAsAsked) {
  const SurfaceMesh tube = latheMesh(
      {{0.03, 0.0}, {0.03, 0.05}, {0.03, 0.1}, {0.027, 0.1}, {0.027, 0.05}, {0.027, 0.0}}, 64);
  EXPECT_NEAR(wallThickness(thickened(tube, 5e-4)), 3.5e-3, 1e-4);
}

}  // namespace
}  // namespace carom::test
