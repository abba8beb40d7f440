#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "carom/audio/vector.h"

namespace carom::modal {

/// What a mesh file holds before anybody has looked at it: polygons of any number of corners, which
/// may name vertices that are not there.
struct PolygonMesh {
  std::vector<Vec3> vertices;          ///< units of the file
  std::vector<std::uint32_t> corners;  ///< indices into `vertices`, polygon by polygon
  std::vector<std::size_t> ends;       ///< in `corners`: past the last one of each polygon
  /// 1, by vertex: where on a picture it is, u to the right and v up. Empty, unless all have one.
  std::vector<Vec2> coordinates;
  std::size_t meshes = 0;   ///< how many it was made of
  std::size_t leftOut = 0;  ///< points and lines

  std::size_t polygons() const { return ends.size(); }
  std::span<const std::uint32_t> polygon(std::size_t index) const {
    const std::size_t first = index == 0 ? 0 : ends[index - 1];
    return std::span(corners).subspan(first, ends[index] - first);
  }
  /// Ends the polygon whose corners were put there since the last one.
  void endPolygon() { ends.push_back(corners.size()); }
};

/// Adds the triangles of a simple polygon, two less than it has corners, each the same way round.
/// It need be neither convex nor quite plane. Ears are cut off (Meisters 1975); of a polygon that
/// crosses itself some way of cutting is found as well. Time grows with the square of the number of
/// corners. [any thread]
void triangulate(std::span<const std::uint32_t> polygon, const std::vector<Vec3>& vertices,
                 std::vector<std::array<std::uint32_t, 3>>& triangles);

}  // namespace carom::modal
