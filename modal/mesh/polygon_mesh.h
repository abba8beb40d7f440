#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "carom/audio/vector.h"

namespace carom::modal {

/// Corners that a polygon of a file may have: the time to cut it grows with their square.
inline constexpr std::size_t kMostCorners = 4096;
/// Triangles that a file may have.
inline constexpr std::size_t kMaxTriangles = 10'000'000;

/// The unchecked content of a mesh file: polygons of any number of corners, which may name vertices
/// that do not exist.
struct PolygonMesh {
  std::vector<Vec3> vertices;          ///< units of the file
  std::vector<std::uint32_t> corners;  ///< indices into `vertices`, polygon by polygon
  std::vector<std::size_t> ends;       ///< index in `corners` past the last corner of each polygon
  /// Texture coordinates (1) of each vertex, u to the right and v up; empty, unless all have them.
  std::vector<Vec2> coordinates;
  std::size_t meshes = 0;   ///< number of meshes that it was made of
  std::size_t leftOut = 0;  ///< number of points and lines left out

  std::size_t polygons() const { return ends.size(); }
  std::span<const std::uint32_t> polygon(std::size_t index) const {
    const std::size_t first = index == 0 ? 0 : ends[index - 1];
    return std::span(corners).subspan(first, ends[index] - first);
  }
  /// Ends the polygon whose corners were added since the last one.
  void endPolygon() { ends.push_back(corners.size()); }
};

/// Cuts the polygons of one mesh into triangles. [one thread]
class PolygonCutter {
 public:
  /// Borrows the vertices.
  explicit PolygonCutter(const std::vector<Vec3>& vertices) : vertices_(vertices) {}

  /// Adds the triangles of a simple polygon, two less than it has corners, each the same way round.
  /// The polygon need be neither convex nor quite plane. Ears are cut off (Meisters 1975), which
  /// takes a time that grows with the square of the number of corners. What is left of a polygon
  /// without ears, as it crosses itself or has no area, is cut as a fan, and so are all polygons
  /// after 1e9 looks at a corner, some 10 s: no mesh but one that is made for it takes as many.
  void cut(std::span<const std::uint32_t> polygon,
           std::vector<std::array<std::uint32_t, 3>>& triangles);

 private:
  const std::vector<Vec3>& vertices_;
  std::uint64_t looks_ = 1'000'000'000;  // that are left
};

}  // namespace carom::modal
