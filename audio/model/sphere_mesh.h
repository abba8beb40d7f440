#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "carom/audio/vector.h"

namespace carom::audio {

/// Up to three of the points of a SphereMesh, and their weights.
struct SphereWeights {
  std::array<std::size_t, 3> index = {0, 0, 0};
  std::array<double, 3> weight = {1.0, 0.0, 0.0};  ///< 0 to 1 each, in sum 1
};

/// Directions triangulated over the sphere (the convex hull, which on a sphere is Delaunay's
/// triangulation), to interpolate between them.
///
/// The weights of a direction are the barycentric coordinates of the place where it passes through
/// the flat triangle of its three neighbours: continuous over the whole sphere, and 1 for one point
/// at that point. Four or more points on one circle can be split in several ways; the points are
/// moved by 1e-6 rad, always in the same way, to settle which one.
class SphereMesh {
 public:
  /// Returns nothing if the points do not surround the origin: fewer than four, two closer than
  /// 1e-4 rad, or a gap between them wider than `kMaxGap` from its middle to its edge. Time grows
  /// with the square of the number of points: some ms for 1000, a second for 20000.
  static std::optional<SphereMesh> create(std::vector<Vec3> unitDirections);

  /// Returns the weights of a direction of any length; of the zero vector or one that is not
  /// finite: the first point alone. [any thread; does not allocate]
  SphereWeights weights(const Vec3& direction) const noexcept;

  const std::vector<Vec3>& points() const { return points_; }
  std::size_t triangles() const { return triangles_.size(); }
  const std::array<std::size_t, 3>& corners(std::size_t triangle) const {
    return triangles_[triangle].corner;
  }

  static constexpr double kMaxGap = 1.3;  ///< rad

 private:
  struct Triangle {
    std::array<std::size_t, 3> corner;     // counter-clockwise from outside
    std::array<std::size_t, 3> neighbour;  // across the edge opposite to the corner
  };
  SphereMesh() = default;
  bool connect();
  void fillCells();
  std::array<double, 3> coordinates(std::size_t triangle, const Vec3& direction) const;
  std::size_t walk(std::size_t start, const Vec3& direction) const;
  std::size_t nearestByAll(const Vec3& direction) const;

  std::vector<Vec3> points_;
  std::vector<Triangle> triangles_;
  std::vector<std::size_t> cells_;  // a triangle to start from, for each cell of a cube
};

}  // namespace carom::audio
