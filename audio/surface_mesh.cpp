#include "audio/surface_mesh.h"

#include <map>
#include <utility>

namespace carom {
namespace {

// Six times the volume of the tetrahedron on a triangle, and its corners' sum, both from `apex`:
// from a point near the surface less is lost than from a far origin.
struct Tetrahedron {
  double sixfold;
  Vec3 sum;
};

Vec3 apexOf(const SurfaceMesh& mesh) {
  return mesh.vertices.empty() ? Vec3::Zero() : mesh.vertices.front();
}

Tetrahedron tetrahedronOn(const SurfaceMesh& mesh, const std::array<std::uint32_t, 3>& triangle,
                          const Vec3& apex) {
  const Vec3 a = mesh.vertices[triangle[0]] - apex;
  const Vec3 b = mesh.vertices[triangle[1]] - apex;
  const Vec3 c = mesh.vertices[triangle[2]] - apex;
  return {a.dot(b.cross(c)), a + b + c};
}

}  // namespace

double signedVolume(const SurfaceMesh& mesh) {
  double sixfold = 0.0;
  for (const auto& triangle : mesh.triangles)
    sixfold += tetrahedronOn(mesh, triangle, apexOf(mesh)).sixfold;
  return sixfold / 6.0;
}

Vec3 volumeCentroid(const SurfaceMesh& mesh) {
  double sixfold = 0.0;
  Vec3 moment = Vec3::Zero();
  for (const auto& triangle : mesh.triangles) {
    const Tetrahedron part = tetrahedronOn(mesh, triangle, apexOf(mesh));
    sixfold += part.sixfold;
    moment += 0.25 * part.sixfold * part.sum;
  }
  return apexOf(mesh) + moment / sixfold;
}

double surfaceArea(const SurfaceMesh& mesh) {
  double twofold = 0.0;
  for (const auto& [first, second, third] : mesh.triangles) {
    const Vec3& corner = mesh.vertices[first];
    twofold += (mesh.vertices[second] - corner).cross(mesh.vertices[third] - corner).norm();
  }
  return 0.5 * twofold;
}

bool closedSurface(const SurfaceMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> balance;
  for (const auto& triangle : mesh.triangles) {
    for (std::size_t side = 0; side < 3; ++side) {
      const std::uint32_t from = triangle[side];
      const std::uint32_t to = triangle[(side + 1) % 3];
      if (from < to) ++balance[{from, to}];
      if (to < from) --balance[{to, from}];
    }
  }
  for (const auto& [edge, surplus] : balance) {
    if (surplus != 0) return false;
  }
  return true;
}

}  // namespace carom
