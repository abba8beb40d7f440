#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <Eigen/Geometry>

#include "carom/audio/surface_mesh.h"
#include "carom/audio/vector.h"

namespace carom::audio {

/// A point of a surface as a mean of vertices: weights at least 0, of sum 1.
struct SurfacePoint {
  std::array<std::uint32_t, 3> vertices{};
  std::array<double, 3> weights{1.0, 0.0, 0.0};
  std::uint32_t triangle = 0;  ///< index in the mesh; that of the vertex if there are no triangles
};

/// Finds the point of a surface that is nearest to a given one. Immutable. [any thread]
///
/// A tree of boxes about triangles. Lookups allocate nothing.
class SurfaceLocator {
 public:
  /// `mesh` must outlive the locator, and have vertices. Without triangles a vertex is found.
  explicit SurfaceLocator(const SurfaceMesh& mesh);

  SurfacePoint nearest(const Vec3& point) const;

 private:
  /// A node of the tree: the items [begin, end); those of its two halves follow each other.
  struct Node {
    Eigen::AlignedBox3d box;
    std::uint32_t begin = 0;
    std::uint32_t end = 0;
    std::uint32_t right = 0;  // node of its second half, the first being next to it; 0: a leaf
  };
  struct Best {
    double distance2 = std::numeric_limits<double>::infinity();
    SurfacePoint point;
  };
  std::array<std::uint32_t, 3> cornersOf(std::uint32_t item) const;
  Eigen::AlignedBox3d boxOf(std::uint32_t item) const;
  void build(std::uint32_t begin, std::uint32_t end);
  void search(const Vec3& point, const Node& node, Best& best) const;
  void look(const Vec3& point, std::uint32_t item, Best& best) const;

  const SurfaceMesh& mesh_;
  std::vector<std::uint32_t> items_;  // triangles, or vertices
  std::vector<Node> nodes_;           // the root first
};

}  // namespace carom::audio
