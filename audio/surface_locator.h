#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "audio/surface_mesh.h"
#include "audio/vector.h"

namespace carom {

/// A point of a surface as a mean of vertices: weights at least 0, of sum 1.
struct SurfacePoint {
  std::array<std::uint32_t, 3> vertices{};
  std::array<double, 3> weights{1.0, 0.0, 0.0};
};

/// Finds the point of a surface that is nearest to a given one. Immutable. [any thread]
///
/// A k-d tree finds the nearest vertex (Bentley 1975), and of the triangles at that vertex the
/// nearest point is taken (Ericson 2005, Real-Time Collision Detection, section 5.1.5). On a mesh
/// whose triangles are much longer than wide, another triangle can be nearer; by how much is
/// bounded by the distance to the nearest vertex.
class SurfaceLocator {
 public:
  /// `mesh` outlives it, and has vertices. Without triangles a vertex is found.
  explicit SurfaceLocator(const SurfaceMesh& mesh);

  SurfacePoint nearest(const Vec3& point) const;
  std::uint32_t nearestVertex(const Vec3& point) const;

 private:
  struct Best {
    double distance2;
    std::uint32_t vertex;
  };
  void build(std::size_t begin, std::size_t end);
  void search(const Vec3& point, std::size_t begin, std::size_t end, Best& best) const;

  const SurfaceMesh& mesh_;
  std::vector<std::uint32_t> order_;      // of vertices: a tree whose roots are in the middles
  std::vector<std::uint8_t> axis_;        // of the cut at each of them
  std::vector<std::uint32_t> firstOf_;    // by vertex, into triangles_
  std::vector<std::uint32_t> triangles_;  // around each vertex
};

}  // namespace carom
