#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "carom/audio/surface_mesh.h"

namespace carom::modal {

/// One triangle's side of an edge.
struct EdgeUse {
  std::uint32_t low = 0;   ///< vertex
  std::uint32_t high = 0;  ///< vertex, not below `low`
  std::uint32_t triangle = 0;
  bool forward = false;  ///< the triangle passes it from `low` to `high`
};

/// The edges of a mesh, each with the triangles that share it, in the order of their vertices.
/// Where a triangle has a corner twice, its edge from there to there is left out.
class MeshEdges {
 public:
  explicit MeshEdges(const SurfaceMesh& mesh);

  std::size_t size() const { return firsts_.size() - 1; }
  /// At least one; sorted by triangle.
  std::span<const EdgeUse> operator[](std::size_t edge) const {
    return std::span(uses_).subspan(firsts_[edge], firsts_[edge + 1] - firsts_[edge]);
  }

 private:
  std::vector<EdgeUse> uses_;
  std::vector<std::size_t> firsts_;  // in uses_: of each edge, and past the last
};

/// Which part each vertex belongs to: 0, 1, ... in the order of the parts' first vertices. A vertex
/// that no triangle uses is a part of its own.
std::vector<std::uint32_t> partsOf(const SurfaceMesh& mesh);

/// Without the vertices that no triangle uses; the others in their order.
SurfaceMesh withoutUnused(SurfaceMesh mesh);

/// m, the longest side of the box around all vertices; 0 without any.
double extentOf(const SurfaceMesh& mesh);

}  // namespace carom::modal
