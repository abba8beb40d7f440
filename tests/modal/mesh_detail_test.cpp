#include "modal/mesh/mesh_detail.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "modal/mesh/mesh_edges.h"
#include "tests/audio/meshes.h"
#include "tests/support/random.h"
#include "tests/support/revolution_modes.h"

namespace carom::test {

using namespace modal;

namespace {

using testing::HasSubstr;

double longestEdgeOf(const SurfaceMesh& mesh) {
  double longest = 0.0;
  for (const auto& triangle : mesh.triangles)
    for (std::size_t side = 0; side < 3; ++side)
      longest = std::max(
          longest,
          (mesh.vertices[triangle[side]] - mesh.vertices[triangle[(side + 1) % 3]]).norm());
  return longest;
}

double smallestAngleOf(const SurfaceMesh& mesh) {
  double smallest = std::numbers::pi;
  for (const auto& triangle : mesh.triangles) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const Vec3& at = mesh.vertices[triangle[corner]];
      const Vec3 one = (mesh.vertices[triangle[(corner + 1) % 3]] - at).normalized();
      const Vec3 other = (mesh.vertices[triangle[(corner + 2) % 3]] - at).normalized();
      smallest = std::min(smallest, std::acos(std::clamp(one.dot(other), -1.0, 1.0)));
    }
  }
  return smallest;
}

SurfaceMesh sheet(int across) {
  SurfaceMesh mesh;
  for (int row = 0; row <= across; ++row)
    for (int column = 0; column <= across; ++column)
      mesh.vertices.emplace_back(column, row, 0.0);
  for (int row = 0; row < across; ++row) {
    for (int column = 0; column < across; ++column) {
      const auto first = static_cast<std::uint32_t>(row * (across + 1) + column);
      const auto above = first + static_cast<std::uint32_t>(across) + 1;
      mesh.triangles.push_back({first, first + 1, above + 1});
      mesh.triangles.push_back({first, above + 1, above});
    }
  }
  return mesh;
}

TEST(MeshDetail, SubdividingKeepsTheSurfaceAndLeavesNoLongEdge) {
  Random random(1);
  for (const double longest : {1.0, 0.31, 0.1}) {
    const SurfaceMesh crooked = mapped(boxMesh({1.0, 0.2, 0.05}), [&](const Vec3& vertex) {
      return Vec3(vertex + 0.02 * random.inCube());
    });
    const auto fine = subdivided(crooked, longest);
    ASSERT_TRUE(fine) << fine.error().message;
    EXPECT_TRUE(closedSurface(*fine));
    EXPECT_NEAR(surfaceArea(*fine), surfaceArea(crooked), 1e-12);
    EXPECT_NEAR(signedVolume(*fine), signedVolume(crooked), 1e-13);
    EXPECT_LE(longestEdgeOf(*fine), longest);
    EXPECT_GE(smallestAngleOf(*fine), 0.5 * smallestAngleOf(crooked));
    // Euler's formula for the topology of a sphere.
    EXPECT_EQ(fine->triangles.size(), 2 * fine->vertices.size() - 4);
  }
}

TEST(MeshDetail, AMeshThatIsFineEnoughStaysAsItIs) {
  const SurfaceMesh box = boxMesh(Vec3::Ones());
  EXPECT_EQ(*subdivided(box, 3.0), box);
  EXPECT_EQ(*subdividedTo(box, 8), box);
  EXPECT_EQ(*simplified(box, 8), box);
}

TEST(MeshDetail, SubdividesUntilThereAreEnoughVertices) {
  for (const std::size_t least : {9u, 100u, 1000u}) {
    const auto fine = subdividedTo(boxMesh({1, 2, 3}), least);
    ASSERT_TRUE(fine) << fine.error().message;
    EXPECT_GE(fine->vertices.size(), least);
    EXPECT_LE(fine->vertices.size(), 3 * least);
    EXPECT_TRUE(closedSurface(*fine));
    EXPECT_NEAR(signedVolume(*fine), 48.0, 1e-11);
  }
}

TEST(MeshDetail, RefusesWhatWouldNotEnd) {
  const auto zero = subdivided(boxMesh(Vec3::Ones()), 0.0);
  ASSERT_FALSE(zero);
  EXPECT_THAT(zero.error().message, HasSubstr("must be positive"));
  const auto tiny = subdivided(boxMesh(Vec3::Ones()), 1e-6);
  ASSERT_FALSE(tiny);
  EXPECT_THAT(tiny.error().message, HasSubstr("more than 4000000 triangles"));
}

// The error of the volume is about that of the best sphere with so few vertices.
TEST(MeshDetail, SimplifyingKeepsAClosedSurfaceClosedAndItsVolume) {
  const SurfaceMesh ball = ellipsoidMesh({1.0, 1.5, 0.5}, 5);
  for (const std::size_t most : {1000u, 200u}) {
    const auto coarse = simplified(ball, most);
    ASSERT_TRUE(coarse) << coarse.error().message;
    EXPECT_LE(coarse->vertices.size(), most);
    EXPECT_GE(coarse->vertices.size(), most / 2);
    EXPECT_TRUE(closedSurface(*coarse));
    EXPECT_NEAR(signedVolume(*coarse), signedVolume(ball),
                20.0 / static_cast<double>(most) * signedVolume(ball));
  }
}

TEST(MeshDetail, SimplifyingAFlatSheetKeepsItsBorder) {
  const auto coarse = simplified(sheet(30), 100);
  ASSERT_TRUE(coarse) << coarse.error().message;
  EXPECT_LE(coarse->vertices.size(), 100u);
  EXPECT_NEAR(surfaceArea(*coarse), 900.0, 1e-3);
}

TEST(MeshDetail, SimplifyingFarFromTheOriginIsNoLessExact) {
  const auto far = [](const Vec3& vertex) { return Vec3(vertex + Vec3(1e5, 0, 0)); };
  const SurfaceMesh ball = ellipsoidMesh(Vec3::Ones(), 4);
  const auto here = simplified(ball, 300);
  const auto there = simplified(mapped(ball, far), 300);
  ASSERT_TRUE(here && there);
  EXPECT_NEAR(signedVolume(*there), signedVolume(*here), 1e-2 * signedVolume(*here));
}

TEST(MeshDetail, RefusesToTearASurface) {
  const auto few = simplified(boxMesh(Vec3::Ones()), 3);
  ASSERT_FALSE(few);
  EXPECT_THAT(few.error().message, HasSubstr("at least 4 vertices"));
  // Many boxes of eight vertices each cannot be represented by ten vertices.
  SurfaceMesh many;
  for (int k = 0; k < 20; ++k)
    many = joined(many, mapped(boxMesh(Vec3::Ones()),
                               [&](const Vec3& v) { return Vec3(v + Vec3(3.0 * k, 0, 0)); }));
  const auto torn = simplified(many, 10);
  ASSERT_FALSE(torn);
  EXPECT_THAT(torn.error().message, HasSubstr("without tearing it"));
}

double lengthOf(const std::vector<InnerEdge>& edges) {
  double sum = 0.0;
  for (const InnerEdge& edge : edges)
    sum += edge.length();
  return sum;
}

TEST(MeshEdges, AreSharpInsideOnlyWhereTheBodyIsMoreThanAHalfSpace) {
  const SurfaceMesh box = boxMesh({1.0, 2.0, 3.0});
  EXPECT_TRUE(sharpInnerEdges(box).empty());
  EXPECT_NEAR(lengthOf(sharpInnerEdges(turnedInsideOut(box))), 8.0 * (1.0 + 2.0 + 3.0),
              1e-12);  // a cavity
  EXPECT_TRUE(sharpInnerEdges(ellipsoidMesh(Vec3::Ones(), 3)).empty());
}

TEST(MeshEdges, OfACupAreSharpInsideWhereWallAndBottomMeet) {
  constexpr int kSides = 32;
  const RevolvedBody cup = revolvedBodies()[2];
  const double radius = cup.outline[4].x();
  const double around = 2.0 * kSides * radius * std::sin(std::numbers::pi / kSides);
  EXPECT_NEAR(lengthOf(sharpInnerEdges(revolvedMesh(cup, kSides))), around, 1e-12);
}

}  // namespace
}  // namespace carom::test
