#include "modal/analysis/spline_mesh.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

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

GridSettings cells(double size) {
  GridSettings settings;
  settings.cellSize = size;
  return settings;
}

SplineMesh gridOf(const SurfaceMesh& surface, const GridSettings& settings = {}) {
  Result<SplineMesh> mesh = splineMesh(surface, settings);
  EXPECT_TRUE(mesh) << (mesh ? "" : mesh.error().message);
  return mesh ? *std::move(mesh) : SplineMesh{};
}

std::string refusal(const SurfaceMesh& surface, const GridSettings& settings = {}) {
  const Result<SplineMesh> mesh = splineMesh(surface, settings);
  return mesh ? "" : mesh.error().message;
}

SurfaceMesh boxAt(const Vec3& centre, const Vec3& half) {
  return mapped(boxMesh(half), [&](const Vec3& vertex) { return Vec3(vertex + centre); });
}

// Share of a volume that the filling outside of cut cells may add.
constexpr double kFilling = 1e-7;

TEST(SplineMesh, ABoxIsWholeCellsHoweverItIsTurned) {
  const Vec3 half(0.031, 0.017, 0.011);
  for (const Eigen::Matrix3d& turn : {Eigen::Matrix3d(Eigen::Matrix3d::Identity()), kMeshTurn}) {
    const Vec3 centre(0.3, -0.2, 0.1);
    const SplineMesh mesh = gridOf(
        mapped(boxMesh(half), [&](const Vec3& vertex) { return Vec3(turn * vertex + centre); }));
    std::size_t places = 1;
    std::size_t functions = 1;
    for (const int count : mesh.count) {
      places *= static_cast<std::size_t>(count);
      functions *= static_cast<std::size_t>(count + 3);
    }
    EXPECT_EQ(mesh.cells.size(), places);
    EXPECT_EQ(mesh.nodes.size(), functions);
    EXPECT_TRUE(mesh.moments.empty());
    EXPECT_NEAR(mesh.volume, 8.0 * half.prod(), 1e-12 * half.prod());
    EXPECT_LE(3 * mesh.nodes.size(), 6000u);
    EXPECT_GE(3 * mesh.nodes.size(), 4000u);
  }
}

TEST(SplineMesh, AThinPlateHasFlatCells) {
  const SplineMesh mesh = gridOf(boxMesh({0.15, 0.1, 0.0015}));
  EXPECT_EQ(mesh.count[2], 1);
  EXPECT_TRUE(mesh.moments.empty());
  EXPECT_NEAR(mesh.cellSize.z(), 0.003, 1e-15);
}

// An ellipsoid has no large face: only its principal axes give the box of its semi-axes.
TEST(SplineMesh, AnEllipsoidLiesInItsPrincipalAxes) {
  const SplineMesh mesh = gridOf(mapped(ellipsoidMesh({0.02, 0.03, 0.08}, 4),
                                        [](const Vec3& v) { return Vec3(kMeshTurn * v); }));
  Vec3 size;
  for (int axis = 0; axis < 3; ++axis)
    size[axis] = mesh.cellSize[axis] * mesh.count[static_cast<std::size_t>(axis)];
  std::sort(size.begin(), size.end());
  EXPECT_LT((size - Vec3(0.04, 0.06, 0.16)).norm(), 0.02 * size.norm());
  EXPECT_NEAR(mesh.axes.determinant(), 1.0, 1e-12);
}

// The moments of an inside, from the closed surface alone: the divergence theorem over its
// triangles, without any grid.
Vec3 firstMomentOf(const SurfaceMesh& surface) {
  return volumeCentroid(surface) * signedVolume(surface);
}

TEST(SplineMesh, HoldsVolumeAndCentreOfARoundBodyInCutCells) {
  const SurfaceMesh surface = mapped(ellipsoidMesh({0.04, 0.05, 0.06}, 4), [](const Vec3& vertex) {
    return Vec3(kMeshTurn * vertex + Vec3(0.1, 0.0, 0.2));
  });
  for (const bool isInsideOut : {false, true}) {
    const SplineMesh mesh = gridOf(isInsideOut ? turnedInsideOut(surface) : surface);
    double volume = 0.0;
    Vec3 first = Vec3::Zero();
    for (const SplineCell& cell : mesh.cells) {
      const Vec3 middle = Vec3(cell.place[0], cell.place[1], cell.place[2]) + Vec3::Constant(0.5);
      const CellMoments whole = momentsOf(-Vec3::Ones(), Vec3::Ones());
      const CellMoments& inside =
          cell.moments < 0 ? whole : mesh.moments[static_cast<std::size_t>(cell.moments)];
      const double part = mesh.cellSize.prod() / 8.0;
      volume += part * inside[0];
      const Vec3 off = 0.5 * Vec3(inside[1], inside[7], inside[49]);
      first += part * (mesh.origin * inside[0] +
                       mesh.axes * (middle * inside[0] + off).cwiseProduct(mesh.cellSize));
    }
    EXPECT_NEAR(mesh.volume, signedVolume(surface), 1e-10 * volume);
    EXPECT_NEAR(volume, signedVolume(surface), kFilling * volume);
    EXPECT_LT((first - firstMomentOf(surface)).norm(), kFilling * volume);
  }
}

// High moments of a slanted prism in one cell against sums over many small boxes.
TEST(SplineMesh, MomentsOfACutCellAreThoseOfItsInside) {
  const auto isInside = [](const Vec3& at) { return at.x() + 0.7 * at.y() + 0.3 * at.z() < 1.1; };
  GridSurface surface{.count = {1, 1, 1}, .triangles = {}};
  const auto top = [](double y, double z) { return Vec3(1.1 - 0.7 * y - 0.3 * z, y, z); };
  // A prism along x over the square 0.1 to 0.9 of y and z, which the slanted plane ends.
  const std::array<Vec3, 4> bottom = {Vec3(0, 0.1, 0.1), Vec3(0, 0.9, 0.1), Vec3(0, 0.9, 0.9),
                                      Vec3(0, 0.1, 0.9)};
  std::array<Vec3, 4> end;
  for (std::size_t corner = 0; corner < 4; ++corner)
    end[corner] = top(bottom[corner].y(), bottom[corner].z());
  const auto quad = [&](const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
    surface.triangles.push_back({a, b, c});
    surface.triangles.push_back({a, c, d});
  };
  quad(bottom[0], bottom[3], bottom[2], bottom[1]);
  quad(end[0], end[1], end[2], end[3]);
  for (std::size_t side = 0; side < 4; ++side) {
    const std::size_t next = (side + 1) % 4;
    quad(bottom[side], bottom[next], end[next], end[side]);
  }
  const std::vector<CellMoments> moments = momentsOf(surface, {0}, 1);
  constexpr int kParts = 80;
  CellMoments sum{};
  for (int z = 0; z < kParts; ++z) {
    for (int y = 0; y < kParts; ++y) {
      const double midY = 0.1 + 0.8 * (y + 0.5) / kParts;
      const double midZ = 0.1 + 0.8 * (z + 0.5) / kParts;
      const double far = top(midY, midZ).x();
      ASSERT_FALSE(isInside(Vec3(far + 1e-9, midY, midZ)));
      const Vec3 low(0.0, midY - 0.4 / kParts, midZ - 0.4 / kParts);
      const Vec3 high(far, midY + 0.4 / kParts, midZ + 0.4 / kParts);
      const CellMoments box =
          momentsOf(Vec3(2.0 * low - Vec3::Ones()), Vec3(2.0 * high - Vec3::Ones()));
      for (std::size_t index = 0; index < box.size(); ++index)
        sum[index] += box[index];
    }
  }
  for (std::size_t index = 0; index < sum.size(); ++index)
    EXPECT_NEAR(moments[0][index], sum[index], 3e-4) << index;
  EXPECT_NEAR(moments[0][0], 8.0 * 0.64 * top(0.5, 0.5).x(), 1e-13);
}

TEST(SplineMesh, LeavesACavityEmptyAndCountsAnOverlapOnce) {
  const SurfaceMesh hollow =
      joined(boxMesh({0.05, 0.05, 0.05}), turnedInsideOut(boxMesh({0.02, 0.02, 0.02})));
  EXPECT_NEAR(gridOf(hollow, cells(0.01)).volume, 1e-3 - 6.4e-5, 1e-12);

  const SplineMesh cross =
      gridOf(joined(boxMesh({0.05, 0.01, 0.01}), boxMesh({0.01, 0.05, 0.01})), cells(0.01));
  EXPECT_NEAR(cross.volume, 2.0 * 4e-5 - 8e-6, 1e-15);
}

// A knob is sunk into a plate by 0.5 mm: all walls but those of that part stay where they are,
// though no face lies on a line of the grid.
TEST(SplineMesh, ASunkKnobLeavesThePlateAsThickAsItIs) {
  const SurfaceMesh plate = boxMesh({0.1, 0.05, 0.001});
  const SurfaceMesh knob = boxAt({0.0131, 0.0077, 0.0055}, {0.005, 0.005, 0.005});
  const double overlap = 0.01 * 0.01 * 0.0005;
  const double whole = 0.2 * 0.1 * 0.002 + 1e-6 - overlap;
  for (const double size : {0.0031, 0.0047, 0.0073})
    EXPECT_NEAR(gridOf(joined(plate, knob), cells(size)).volume, whole, 0.2 * overlap) << size;
}

// Two plates a cell and more apart, joined at one end, as the tines of a fork.
TEST(SplineMesh, BothSidesOfASlotHaveFunctionsOfTheirOwn) {
  SurfaceMesh fork = joined(boxAt({0.0, 0.0, 0.02}, {0.05, 0.01, 0.005}),
                            boxAt({0.0, 0.0, -0.02}, {0.05, 0.01, 0.005}));
  fork = joined(fork, boxAt({-0.045, 0.0, 0.0}, {0.005, 0.01, 0.016}));
  const SplineMesh mesh = gridOf(fork, cells(0.01));
  std::size_t places = 0;
  std::vector<Vec3> seen;
  for (const Vec3& node : mesh.nodes) {
    const auto isHere = [&](const Vec3& other) { return (other - node).norm() < 1e-9; };
    if (std::none_of(seen.begin(), seen.end(), isHere)) ++places;
    seen.push_back(node);
  }
  EXPECT_GT(mesh.nodes.size(), places);
  // Each cell has one node for each function still, and all weights of a point sum to one.
  double sum = 0.0;
  for (const double weight : locate(mesh, {0.03, 0.0, 0.02}).weights)
    sum += weight;
  EXPECT_NEAR(sum, 1.0, 1e-14);
}

/// An open tray of so long, so wide and so high a box (m) with walls of one thickness.
SurfaceMesh trayMesh(const Vec3& size, double wall) {
  SurfaceMesh mesh;
  const auto rectangle = [&](double inwards, double height) {
    const Vec3 half = 0.5 * size - Vec3(inwards, inwards, 0.0);
    for (const auto& [x, y] :
         {std::pair(-1, -1), std::pair(1, -1), std::pair(1, 1), std::pair(-1, 1)})
      mesh.vertices.emplace_back(x * half.x(), y * half.y(), height);
  };
  const auto quad = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
  };
  rectangle(0.0, 0.0);
  rectangle(0.0, size.z());
  rectangle(wall, size.z());
  rectangle(wall, wall);
  quad(3, 2, 1, 0);
  for (std::uint32_t ring = 0; ring < 3; ++ring)
    for (std::uint32_t side = 0; side < 4; ++side)
      quad(4 * ring + side, 4 * ring + (side + 1) % 4, 4 * ring + 4 + (side + 1) % 4,
           4 * ring + 4 + side);
  quad(12, 13, 14, 15);
  return mesh;
}

bool hasLine(const GridAxis& axis, double place) {
  for (int cell = 0; cell < axis.cells(); ++cell)
    if (std::abs(axis[cell].begin - place) < 1e-9) return true;
  return false;
}

// Bottom and walls meet at sharp corners inside: the planes of their inner faces are lines of the
// grid, so that all cells are whole ones.
TEST(SplineMesh, InnerFacesOfATrayAreLinesHoweverItIsTurned) {
  const Vec3 size(0.2, 0.15, 0.05);
  const double wall = 0.003;
  const double volume = size.prod() - (size - Vec3(2, 2, 1) * wall).prod();
  for (const Eigen::Matrix3d& turn : {Eigen::Matrix3d(Eigen::Matrix3d::Identity()), kMeshTurn}) {
    const SurfaceMesh tray =
        mapped(trayMesh(size, wall), [&](const Vec3& vertex) { return Vec3(turn * vertex); });
    const SplineMesh mesh = gridOf(tray, cells(0.02));
    EXPECT_EQ(mesh.openEdges, 0.0);
    EXPECT_TRUE(mesh.openCells.empty());
    EXPECT_TRUE(mesh.moments.empty());
    EXPECT_NEAR(mesh.volume, volume, 1e-12 * volume);
    for (const GridAxis& axis : mesh.along) {
      const bool isUp = axis.length() < 0.1;
      EXPECT_TRUE(hasLine(axis, wall) || (isUp && hasLine(axis, size.z() - wall)));
      EXPECT_TRUE(hasLine(axis, axis.length() - wall) || isUp);
    }
    for (const Vec3& vertex : tray.vertices) {
      const CellPoint found = locate(mesh, vertex);
      Vec3 sum = Vec3::Zero();
      for (std::size_t function = 0; function < found.weights.size(); ++function)
        sum += found.weights[function] * mesh.nodes[mesh.cells[found.cell].nodes[function]];
      EXPECT_LT((sum - vertex).norm(), 1e-12);
    }
  }
}

// Where lines on all inner faces would take more functions than are wanted, cells are equal, and
// the grid says what is left.
TEST(SplineMesh, InnerFacesAreNoLinesWhereTheyTakeTooManyFunctions) {
  const SurfaceMesh tray = trayMesh({0.2, 0.15, 0.05}, 0.003);
  GridSettings few;
  few.degreesOfFreedom = 1000;
  const SplineMesh mesh = gridOf(tray, few);
  EXPECT_LE(3 * mesh.nodes.size(), 1000U);
  EXPECT_NEAR(mesh.openEdges, 2.0 * (0.194 + 0.144) + 4.0 * 0.047, 1e-12);
  for (const Vec3& corner : {Vec3(0.003, 0.003, 0.003), Vec3(0.197, 0.147, 0.05)}) {
    const auto cell = static_cast<std::uint32_t>(locate(mesh, tray.vertices[0] + corner).cell);
    EXPECT_TRUE(std::ranges::binary_search(mesh.openCells, cell));
  }
  EXPECT_LT(mesh.openCells.size(), mesh.cells.size());
  few.degreesOfFreedom = 20000;
  EXPECT_EQ(gridOf(tray, few).openEdges, 0.0);
}

TEST(SplineMesh, WeightsInterpolateLinearFieldsExactly) {
  const SurfaceMesh surface = ellipsoidMesh({0.03, 0.05, 0.04}, 3);
  const SplineMesh mesh = gridOf(surface, cells(0.01));
  std::vector<Vec3> points = surface.vertices;
  Random random(5);
  for (int count = 0; count < 100; ++count)
    points.push_back(0.06 * random.inCube());  // some of them outside
  for (const Vec3& point : points) {
    const CellPoint found = locate(mesh, point);
    Vec3 sum = Vec3::Zero();
    for (std::size_t function = 0; function < found.weights.size(); ++function)
      sum += found.weights[function] * mesh.nodes[mesh.cells[found.cell].nodes[function]];
    EXPECT_LT((sum - point).norm(), 3e-14);
  }
  for (const Vec3& vertex : surface.vertices)
    for (const double weight : locate(mesh, vertex).weights)
      EXPECT_LT(std::abs(weight), 1.0);
}

// Two cubes with a rod between them, far thinner than a cell.
TEST(SplineMesh, AThinRodHoldsABodyTogether) {
  const auto dumbbell = [](double half) {
    SurfaceMesh mesh = joined(boxAt({-0.05, 0.0, 0.0}, {0.02, 0.02, 0.02}),
                              boxAt({0.05, 0.0, 0.0}, {0.02, 0.02, 0.02}));
    return half > 0.0 ? joined(mesh, boxAt({0.0, 0.0037, 0.0041}, {0.04, half, half})) : mesh;
  };
  EXPECT_EQ(refusal(dumbbell(0.001), cells(0.035)), "");
  EXPECT_THAT(refusal(dumbbell(0.0), cells(0.01)), HasSubstr("2 bodies that do not touch"));
}

TEST(SplineMesh, RefusesWhatIsNoSolid) {
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
  GridSettings settings;
  settings.degreesOfFreedom = 191;
  EXPECT_THAT(refusal(boxMesh({1, 1, 1}), settings), HasSubstr("too few"));
}

}  // namespace
}  // namespace carom
