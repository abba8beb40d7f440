#include "carom/modal/mesh_check.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/audio/meshes.h"

namespace carom::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::vector<std::string> namesIn(const MeshReport& report) {
  std::vector<std::string> names;
  for (const MeshFinding& finding : report.findings)
    names.emplace_back(nameOf(finding.fault));
  return names;
}

std::string solidRefusal(const SurfaceMesh& mesh) {
  const Status status = needSolid(checkMesh(mesh));
  return status ? "" : status.error().message;
}

SurfaceMesh moved(const SurfaceMesh& mesh, const Vec3& by) {
  return mapped(mesh, [&](const Vec3& vertex) { return Vec3(vertex + by); });
}

MeshFinding only(const MeshReport& report) {
  EXPECT_EQ(report.findings.size(), 1u);
  return report.findings.empty() ? MeshFinding{} : report.findings.front();
}

TEST(MeshCheck, NothingIsTheMatterWithASoundBox) {
  const MeshReport report = checkMesh(boxMesh({0.1, 0.2, 0.3}));
  EXPECT_THAT(report.findings, IsEmpty());
  EXPECT_NEAR(report.extent, 0.6, 1e-12);
  EXPECT_NEAR(report.area, 0.88, 1e-12);
  EXPECT_NEAR(report.volume, 0.048, 1e-12);
  EXPECT_THAT(report.parts, ElementsAre(12u));
  EXPECT_TRUE(needSolid(report));
}

TEST(MeshCheck, ABoxWithoutATriangleIsOpenAtThreeEdges) {
  SurfaceMesh mesh = boxMesh(Vec3::Constant(0.5));
  mesh.triangles.pop_back();
  const MeshFinding finding = only(checkMesh(mesh));
  EXPECT_EQ(finding.fault, MeshFault::open);
  EXPECT_EQ(finding.count, 3u);
  EXPECT_THAT(finding.text, HasSubstr("3 edges, the first at (0.5, "));
  EXPECT_THAT(solidRefusal(mesh), HasSubstr("open at 3 edges"));
}

TEST(MeshCheck, OneTriangleTurnedDisagreesWithThreeNeighbours) {
  SurfaceMesh mesh = boxMesh(Vec3::Constant(0.5));
  std::swap(mesh.triangles[5][0], mesh.triangles[5][1]);
  const MeshReport report = checkMesh(mesh);
  EXPECT_THAT(namesIn(report), ElementsAre("inconsistent_orientation"));
  EXPECT_EQ(only(report).count, 3u);
  const MendedMesh repaired = mended(mesh);
  EXPECT_EQ(repaired.turned, 1u);
  EXPECT_THAT(checkMesh(repaired.surface).findings, IsEmpty());
  EXPECT_NEAR(signedVolume(repaired.surface), 1.0, 1e-12);
}

TEST(MeshCheck, InsideOutIsSeenAndTurned) {
  const SurfaceMesh mesh = turnedInsideOut(boxMesh(Vec3::Constant(0.5)));
  EXPECT_THAT(namesIn(checkMesh(mesh)), ElementsAre("inside_out"));
  EXPECT_THAT(solidRefusal(mesh), HasSubstr("inside out"));
  EXPECT_EQ(mended(mesh).turned, 12u);
  EXPECT_TRUE(needSolid(checkMesh(mended(mesh).surface)));
}

TEST(MeshCheck, PartsAreCountedWithTheirSizes) {
  const SurfaceMesh small = boxMesh(Vec3::Constant(0.1));
  const SurfaceMesh mesh = joined(small, moved(splitMesh(small), Vec3(1, 0, 0)));
  const MeshReport report = checkMesh(mesh);
  EXPECT_THAT(namesIn(report), ElementsAre("disconnected_parts"));
  EXPECT_THAT(report.parts, ElementsAre(48u, 12u));
  EXPECT_TRUE(needSolid(report));
}

// Two bodies side by side are both turned outward; a cavity stays a cavity, even if everything is
// inside out.
TEST(MeshCheck, BodiesAreTurnedAndCavitiesKept) {
  const SurfaceMesh one = boxMesh(Vec3::Constant(0.5));
  const SurfaceMesh beside = joined(one, turnedInsideOut(moved(one, Vec3(3, 0, 0))));
  EXPECT_NEAR(signedVolume(mended(beside).surface), 2.0, 1e-12);
  const SurfaceMesh hollow = joined(one, turnedInsideOut(boxMesh(Vec3::Constant(0.25))));
  EXPECT_NEAR(signedVolume(mended(hollow).surface), 1.0 - 0.125, 1e-12);
  EXPECT_NEAR(signedVolume(mended(turnedInsideOut(hollow)).surface), 1.0 - 0.125, 1e-12);
}

TEST(MeshCheck, DuplicatesAreDropped) {
  SurfaceMesh mesh = boxMesh(Vec3::Constant(0.5));
  const auto [a, b, c] = mesh.triangles[4];
  mesh.triangles.push_back({b, c, a});
  const MeshReport report = checkMesh(mesh);
  EXPECT_THAT(namesIn(report),
              ElementsAre("open_surface", "duplicate_triangles", "non_manifold_edges"));
  EXPECT_EQ(mended(mesh).duplicate, 1u);
  EXPECT_EQ(mended(mesh).surface, boxMesh(Vec3::Constant(0.5)));
}

TEST(MeshCheck, ASheetWithTwoSidesHasNoVolume) {
  const SurfaceMesh sheet = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 1}}};
  EXPECT_THAT(namesIn(checkMesh(sheet)), ElementsAre("no_volume", "duplicate_triangles"));
  EXPECT_THAT(solidRefusal(sheet), HasSubstr("nothing is inside"));
}

// The mesh has a triangle with a repeated corner and one with three vertices on a line: one face
// contains side 0 to 1 of the box as a whole and the other one its two halves, with a needle
// between them.
TEST(MeshCheck, NeedlesAreMendedWithoutOpeningTheSurface) {
  SurfaceMesh mesh = boxMesh(Vec3::Constant(0.5));
  mesh.triangles.push_back({3, 3, 5});
  const auto middle = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.emplace_back(0.5 * (mesh.vertices[0] + mesh.vertices[1]));
  const auto whole = std::ranges::find(mesh.triangles, std::array<std::uint32_t, 3>{0, 1, 5});
  ASSERT_NE(whole, mesh.triangles.end());
  *whole = {0, middle, 5};
  mesh.triangles.push_back({middle, 1, 5});
  mesh.triangles.push_back({0, 1, middle});
  ASSERT_TRUE(closedSurface(mesh));
  const MeshReport report = checkMesh(mesh);
  ASSERT_TRUE(report.has(MeshFault::degenerate));
  EXPECT_EQ(report.find(MeshFault::degenerate)->count, 2u);
  const MendedMesh repaired = mended(mesh);
  EXPECT_EQ(repaired.degenerate, 1u);
  EXPECT_EQ(repaired.flipped, 1u);
  EXPECT_THAT(checkMesh(repaired.surface).findings, IsEmpty());
  EXPECT_NEAR(signedVolume(repaired.surface), 1.0, 1e-12);
  EXPECT_NEAR(surfaceArea(repaired.surface), 6.0, 1e-12);
}

TEST(MeshCheck, BookOfThreePagesIsNotManifold) {
  const SurfaceMesh book = {{{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {0, 1, 0}, {-1, -1, 0}},
                            {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}}};
  const MeshReport report = checkMesh(book);
  ASSERT_TRUE(report.has(MeshFault::nonManifold));
  EXPECT_EQ(report.find(MeshFault::nonManifold)->count, 1u);
}

TEST(MeshCheck, AsksForTheUnitWhenTheScaleIsStrange) {
  EXPECT_THAT(only(checkMesh(boxMesh({20.0, 1.0, 1.0}))).text,
              "40 m from end to end: is it in millimetres? use --scale 0.001");
  EXPECT_EQ(only(checkMesh(boxMesh(Vec3::Constant(1e-4)))).fault, MeshFault::tooSmall);
  EXPECT_TRUE(needSolid(checkMesh(boxMesh({20.0, 1.0, 1.0}))));
}

TEST(MeshCheck, AnythingMayBeLookedAt) {
  EXPECT_THAT(namesIn(checkMesh({})), ElementsAre("empty"));
  SurfaceMesh range = boxMesh(Vec3::Ones());
  range.triangles[7][2] = 8;
  EXPECT_THAT(only(checkMesh(range)).text,
              "1 triangle, the first is number 7, with a vertex that is not among the 8");
  SurfaceMesh lost = boxMesh(Vec3::Ones());
  lost.vertices[3].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(only(checkMesh(lost)).text, "vertex 3 is not finite");
  EXPECT_THAT(solidRefusal(lost), HasSubstr("vertex 3 is not finite"));
}

}  // namespace
}  // namespace carom::test
