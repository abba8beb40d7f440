#pragma once

#include <array>
#include <cstdint>

#include "carom/audio/surface_mesh.h"
#include "carom/audio/vector.h"

namespace carom::modal {

/// Returns the three corners (m). [any thread]
inline std::array<Vec3, 3> cornersOf(const SurfaceMesh& mesh, std::size_t triangle) {
  const auto& [first, second, third] = mesh.triangles[triangle];
  return {mesh.vertices[first], mesh.vertices[second], mesh.vertices[third]};
}

/// Returns the barycentric coordinates, one for each corner, of the triangle's point that is
/// closest to `point`. The triangle must have an area. [any thread]
Vec3 closestOnTriangle(const std::array<Vec3, 3>& corners, const Vec3& point);

/// Returns the point of these barycentric coordinates.
inline Vec3 pointOf(const std::array<Vec3, 3>& corners, const Vec3& barycentric) {
  return barycentric[0] * corners[0] + barycentric[1] * corners[1] + barycentric[2] * corners[2];
}

}  // namespace carom::modal
