#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <meshoptimizer.h>

#include "modal/mesh/mesh_detail.h"
#include "modal/mesh/mesh_edges.h"

namespace carom::modal {
namespace {

constexpr std::size_t kFewest = 4;  // vertices of a solid
constexpr float kAnyError = 1.0F;   // relative to the extent: no limit
constexpr std::size_t kStep = 16;   // the target falls by a 16th until it is met

/// Scales the positions into a unit box at the origin: meshoptimizer works in single precision.
std::vector<float> unitPositions(const SurfaceMesh& mesh) {
  const double extent = extentOf(mesh);
  std::vector<float> positions;
  positions.reserve(3 * mesh.vertices.size());
  for (const Vec3& vertex : mesh.vertices)
    for (const double coordinate : (vertex - mesh.vertices.front()) / extent)
      positions.push_back(static_cast<float>(coordinate));
  return positions;
}

SurfaceMesh collapsed(const SurfaceMesh& mesh, const std::vector<float>& positions,
                      std::size_t triangles) {
  std::vector<std::uint32_t> corners;
  corners.reserve(3 * mesh.triangles.size());
  for (const auto& triangle : mesh.triangles)
    corners.insert(corners.end(), triangle.begin(), triangle.end());
  std::vector<std::uint32_t> kept(corners.size());
  kept.resize(meshopt_simplify(kept.data(), corners.data(), corners.size(), positions.data(),
                               mesh.vertices.size(), 3 * sizeof(float), 3 * triangles, kAnyError));
  SurfaceMesh result{mesh.vertices, {}};
  for (std::size_t corner = 0; corner + 2 < kept.size(); corner += 3)
    result.triangles.push_back({kept[corner], kept[corner + 1], kept[corner + 2]});
  return withoutUnused(std::move(result));
}

/// Number of parts of a mesh without unused vertices.
std::size_t partCount(const SurfaceMesh& mesh) {
  const std::vector<std::uint32_t> parts = partsOf(mesh);
  return parts.empty() ? 0 : std::ranges::max(parts) + std::size_t{1};
}

}  // namespace

Result<SurfaceMesh> simplified(const SurfaceMesh& mesh, std::size_t most) {
  if (most < kFewest)
    return Error{"simplification: expected at least " + std::to_string(kFewest) + " vertices"};
  if (mesh.vertices.size() <= most) return mesh;
  const bool wasClosed = closedSurface(mesh);
  const std::size_t parts = partCount(withoutUnused(mesh));
  const std::vector<float> positions = unitPositions(mesh);
  SurfaceMesh result = mesh;
  // A closed surface has about two triangles to a vertex, one with a border fewer.
  for (std::size_t target = 2 * most; target >= kFewest; target -= target / kStep + 1) {
    result = collapsed(mesh, positions, target);
    if (result.vertices.size() > most) continue;
    if ((wasClosed && !closedSurface(result)) || partCount(result) < parts) break;
    return result;
  }
  return Error{"simplification: the surface of " + std::to_string(mesh.vertices.size()) +
               " vertices cannot be told by " + std::to_string(most) +
               " without tearing it or losing a part (" + std::to_string(result.vertices.size()) +
               " are left); expected more vertices"};
}

}  // namespace carom::modal
