#pragma once

#include <cmath>
#include <cstdint>
#include <map>
#include <utility>

#include "carom/audio/surface_mesh.h"

namespace carom {

inline SurfaceMesh boxMesh(const Vec3& half) {
  SurfaceMesh mesh;
  for (int corner = 0; corner < 8; ++corner) {
    mesh.vertices.emplace_back((corner & 1) != 0 ? half.x() : -half.x(),
                               (corner & 2) != 0 ? half.y() : -half.y(),
                               (corner & 4) != 0 ? half.z() : -half.z());
  }
  mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return mesh;
}

/// Splits each triangle in four; neighbours share their vertices.
inline SurfaceMesh splitMesh(const SurfaceMesh& mesh) {
  SurfaceMesh split{mesh.vertices, {}};
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
  const auto middle = [&](std::uint32_t from, std::uint32_t to) {
    const auto next = static_cast<std::uint32_t>(split.vertices.size());
    const auto [found, fresh] = middles.try_emplace(std::minmax(from, to), next);
    if (fresh) split.vertices.push_back(0.5 * (mesh.vertices[from] + mesh.vertices[to]));
    return found->second;
  };
  for (const auto& [first, second, third] : mesh.triangles) {
    const std::uint32_t a = middle(first, second);
    const std::uint32_t b = middle(second, third);
    const std::uint32_t c = middle(third, first);
    split.triangles.push_back({first, a, c});
    split.triangles.push_back({second, b, a});
    split.triangles.push_back({third, c, b});
    split.triangles.push_back({a, b, c});
  }
  return split;
}

/// An octahedron, split `splits` times and projected on the ellipsoid, then enlarged to the
/// ellipsoid's volume.
inline SurfaceMesh ellipsoidMesh(const Vec3& semiAxes, int splits) {
  SurfaceMesh mesh;
  mesh.vertices = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                    {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (int k = 0; k < splits; ++k) {
    mesh = splitMesh(mesh);
    for (Vec3& vertex : mesh.vertices)
      vertex.normalize();
  }
  const double grow = std::cbrt(4.0 / 3.0 * 3.14159265358979323846 / signedVolume(mesh));
  for (Vec3& vertex : mesh.vertices)
    vertex = grow * vertex.cwiseProduct(semiAxes);
  return mesh;
}

template <class Map>
SurfaceMesh mapped(SurfaceMesh mesh, const Map& map) {
  for (Vec3& vertex : mesh.vertices)
    vertex = map(vertex);
  return mesh;
}

/// Returns both meshes as one.
inline SurfaceMesh joined(SurfaceMesh mesh, const SurfaceMesh& other) {
  const auto offset = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), other.vertices.begin(), other.vertices.end());
  for (const auto& [first, second, third] : other.triangles)
    mesh.triangles.push_back({first + offset, second + offset, third + offset});
  return mesh;
}

inline SurfaceMesh turnedInsideOut(SurfaceMesh mesh) {
  for (auto& triangle : mesh.triangles)
    std::swap(triangle[1], triangle[2]);
  return mesh;
}

}  // namespace carom
