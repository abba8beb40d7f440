#include "modal/analysis/voxel_mesh.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/audio/meshes.h"
#include "tests/support/random.h"

namespace carom {

using namespace modal;

namespace {

using testing::HasSubstr;

const Eigen::Matrix3d kMeshTurn =
    Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).toRotationMatrix();

VoxelSettings cells(double size) {
  VoxelSettings settings;
  settings.cellSize = size;
  return settings;
}

VoxelMesh gridOf(const SurfaceMesh& surface, const VoxelSettings& settings = {}) {
  Result<VoxelMesh> mesh = voxelMesh(surface, settings);
  EXPECT_TRUE(mesh) << (mesh ? "" : mesh.error().message);
  return mesh ? *std::move(mesh) : VoxelMesh{};
}

std::string refusal(const SurfaceMesh& surface, const VoxelSettings& settings = {}) {
  const Result<VoxelMesh> mesh = voxelMesh(surface, settings);
  return mesh ? "" : mesh.error().message;
}

SurfaceMesh boxAt(const Vec3& centre, const Vec3& half) {
  return mapped(boxMesh(half), [&](const Vec3& vertex) { return Vec3(vertex + centre); });
}

TEST(VoxelMesh, ABoxIsWholeCellsHoweverItIsTurned) {
  const Vec3 half(0.031, 0.017, 0.011);
  for (const Eigen::Matrix3d& turn : {Eigen::Matrix3d(Eigen::Matrix3d::Identity()), kMeshTurn}) {
    const Vec3 centre(0.3, -0.2, 0.1);
    const VoxelMesh mesh = gridOf(
        mapped(boxMesh(half), [&](const Vec3& vertex) { return Vec3(turn * vertex + centre); }));
    std::size_t places = 1;
    for (const int count : mesh.count)
      places *= static_cast<std::size_t>(count);
    EXPECT_EQ(mesh.cells.size(), places);
    EXPECT_TRUE(mesh.boxes.empty());
    EXPECT_NEAR(mesh.sampled, 8.0 * half.prod(), 1e-12 * half.prod());
    EXPECT_LE(3 * mesh.nodes.size(), 20000u);
    EXPECT_GE(3 * mesh.nodes.size(), 16000u);
    Vec3 farthest = Vec3::Zero();
    for (const Vec3& node : mesh.nodes)
      farthest = farthest.cwiseMax((turn.transpose() * (node - centre)).cwiseAbs());
    EXPECT_LT((farthest - half).norm(), 1e-12);
  }
}

TEST(VoxelMesh, AThinPlateHasLayersOfFlatCells) {
  const VoxelMesh mesh = gridOf(boxMesh({0.15, 0.1, 0.0015}));
  EXPECT_GE(mesh.count[2], 2);
  EXPECT_LE(mesh.cellSize.maxCoeff(), 5.0 * mesh.cellSize.minCoeff());
  EXPECT_TRUE(mesh.boxes.empty());
  EXPECT_NEAR(mesh.cellSize.z() * mesh.count[2], 0.003, 1e-15);
}

// An ellipsoid has no large face: only its principal axes give the box of its semi-axes.
TEST(VoxelMesh, AnEllipsoidLiesInItsPrincipalAxes) {
  const VoxelMesh mesh = gridOf(mapped(ellipsoidMesh({0.02, 0.03, 0.08}, 4),
                                       [](const Vec3& v) { return Vec3(kMeshTurn * v); }));
  Vec3 size;
  for (int axis = 0; axis < 3; ++axis)
    size[axis] = mesh.cellSize[axis] * mesh.count[static_cast<std::size_t>(axis)];
  std::sort(size.begin(), size.end());
  EXPECT_LT((size - Vec3(0.04, 0.06, 0.16)).norm(), 0.02 * size.norm());
  EXPECT_NEAR(mesh.axes.determinant(), 1.0, 1e-12);
}

TEST(VoxelMesh, HoldsTheVolumeOfARoundBodyInCutCells) {
  const SurfaceMesh surface = mapped(ellipsoidMesh({0.04, 0.05, 0.06}, 4),
                                     [](const Vec3& vertex) { return Vec3(kMeshTurn * vertex); });
  const VoxelMesh mesh = gridOf(surface);
  double volume = 0.0;
  for (const VoxelCell& cell : mesh.cells) {
    if (cell.boxCount == 0) volume += mesh.cellSize.prod();
    for (std::uint32_t box = cell.firstBox; box < cell.firstBox + cell.boxCount; ++box) {
      const CellBox& part = mesh.boxes[box];
      EXPECT_GE(part.low.minCoeff(), 0.0);
      EXPECT_LE(part.high.maxCoeff(), 1.0);
      volume += mesh.cellSize.cwiseProduct(part.high - part.low).prod();
    }
  }
  EXPECT_NEAR(volume, mesh.sampled, 1e-12 * volume);
  EXPECT_NEAR(mesh.volume, signedVolume(surface), 1e-12 * volume);
  EXPECT_NEAR(volume, signedVolume(surface), 0.002 * volume);
  EXPECT_NEAR(gridOf(turnedInsideOut(surface)).sampled, volume, 0.002 * volume);
}

TEST(VoxelMesh, FewerRowsAreCoarserButUnbiased) {
  const SurfaceMesh surface = ellipsoidMesh({0.05, 0.05, 0.05}, 4);
  VoxelSettings settings = cells(0.01);
  settings.rows = 1;
  EXPECT_NEAR(gridOf(surface, settings).sampled / signedVolume(surface), 1.0, 0.03);
  settings.rows = 20;
  EXPECT_NEAR(gridOf(surface, settings).sampled / signedVolume(surface), 1.0, 0.0015);
}

TEST(VoxelMesh, LeavesACavityEmptyAndCountsAnOverlapOnce) {
  const SurfaceMesh hollow =
      joined(boxMesh({0.05, 0.05, 0.05}), turnedInsideOut(boxMesh({0.02, 0.02, 0.02})));
  EXPECT_NEAR(gridOf(hollow, cells(0.01)).sampled, 1e-3 - 6.4e-5, 1e-12);

  const VoxelMesh cross =
      gridOf(joined(boxMesh({0.05, 0.01, 0.01}), boxMesh({0.01, 0.05, 0.01})), cells(0.01));
  EXPECT_NEAR(cross.sampled, 2.0 * 4e-5 - 8e-6, 1e-15);
  EXPECT_NEAR(cross.volume, 2.0 * 4e-5 - 8e-6, 1e-15);
}

TEST(VoxelMesh, WeightsInterpolateLinearFieldsExactly) {
  const SurfaceMesh surface = ellipsoidMesh({0.03, 0.05, 0.04}, 3);
  const VoxelMesh mesh = gridOf(surface, cells(0.01));
  std::vector<Vec3> points = surface.vertices;
  Random random(5);
  for (int count = 0; count < 100; ++count)
    points.push_back(0.06 * random.inCube());  // some of them outside
  for (const Vec3& point : points) {
    const CellPoint found = locate(mesh, point);
    Vec3 sum = Vec3::Zero();
    for (std::size_t corner = 0; corner < 8; ++corner)
      sum += found.weights[corner] * mesh.nodes[mesh.cells[found.cell].nodes[corner]];
    EXPECT_LT((sum - point).norm(), 1e-14);
  }
  for (const Vec3& vertex : surface.vertices)
    for (const double weight : locate(mesh, vertex).weights)
      EXPECT_LT(std::abs(weight), 2.0);
}

// The body is two cubes with a rod between them that the samples of a coarse grid miss.
TEST(VoxelMesh, SaysWhichSizeHoldsABodyTogether) {
  const auto dumbbell = [](double half) {
    SurfaceMesh mesh = joined(boxAt({-0.05, 0.0, 0.0}, {0.02, 0.02, 0.02}),
                              boxAt({0.05, 0.0, 0.0}, {0.02, 0.02, 0.02}));
    return joined(mesh, boxAt({0.0, 0.0037, 0.0041}, {0.04, half, half}));
  };
  const std::string message = refusal(dumbbell(0.001), cells(0.035));
  EXPECT_THAT(message, HasSubstr("35.00 mm are too coarse"));
  EXPECT_THAT(message, HasSubstr("2 pieces"));
  const std::size_t at = message.find("cells of ", 10) + 9;
  const double remedy = 1e-3 * std::stod(message.substr(at));
  EXPECT_EQ(refusal(dumbbell(0.001), cells(remedy)), "") << message;

  EXPECT_THAT(refusal(dumbbell(1e-5), cells(0.02)), HasSubstr("no size"));
}

TEST(VoxelMesh, RefusesWhatIsNoSolid) {
  SurfaceMesh open = boxMesh({1, 1, 1});
  open.triangles.pop_back();
  EXPECT_THAT(refusal(open), HasSubstr("open"));
  EXPECT_THAT(refusal({}), HasSubstr("no volume"));
  EXPECT_THAT(refusal(boxMesh({1, 1, 0})), HasSubstr("no volume"));
  SurfaceMesh strange = boxMesh({1, 1, 1});
  strange.vertices[3].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(refusal(strange), HasSubstr("finite"));
  SurfaceMesh beyond = boxMesh({1, 1, 1});
  beyond.triangles[0][0] = 8;
  EXPECT_THAT(refusal(beyond), HasSubstr("vertex 8, and there are 8"));
  EXPECT_THAT(refusal(boxMesh({1, 1, 1}), cells(0.0)), HasSubstr("size of a cell"));
  EXPECT_THAT(refusal(boxMesh({1, 1, 1}), cells(1e-4)), HasSubstr("too fine"));
  VoxelSettings settings;
  settings.degreesOfFreedom = 23;
  EXPECT_THAT(refusal(boxMesh({1, 1, 1}), settings), HasSubstr("too few"));
  settings = {};
  settings.rows = 0;
  EXPECT_THAT(refusal(boxMesh({1, 1, 1}), settings), HasSubstr("row"));
}

}  // namespace
}  // namespace carom
