#pragma once

#include <array>
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
  bool forward = false;  ///< true if the triangle passes it from `low` to `high`
};

/// The edges of a mesh, each with the triangles that share it, in the order of their vertices.
/// If a triangle has a corner twice, its edge between the two is left out.
class MeshEdges {
 public:
  explicit MeshEdges(const SurfaceMesh& mesh);

  std::size_t size() const { return firsts_.size() - 1; }
  /// Returns the uses of an edge: at least one, sorted by triangle.
  std::span<const EdgeUse> operator[](std::size_t edge) const {
    return std::span(uses_).subspan(firsts_[edge], firsts_[edge + 1] - firsts_[edge]);
  }

 private:
  std::vector<EdgeUse> uses_;
  std::vector<std::size_t> firsts_;  // first of uses_ for each edge, and past the last
};

/// Returns the part of each vertex: 0, 1, ... in the order of the parts' first vertices. A vertex
/// that no triangle uses is a part of its own.
std::vector<std::uint32_t> partsOf(const SurfaceMesh& mesh);

/// Returns the mesh without the vertices that no triangle uses; the others keep their order.
SurfaceMesh withoutUnused(SurfaceMesh mesh);

/// An edge at which two triangles of a closed surface meet at an angle of more than 45 degrees to
/// their common plane, with the body on the wider side: where stress is singular. A fillet has none
/// if its facets turn by less.
struct InnerEdge {
  Vec3 from;                    ///< m
  Vec3 to;                      ///< m
  std::array<Vec3, 2> normals;  ///< of the triangles, outwards
  double length() const { return (to - from).norm(); }
};
std::vector<InnerEdge> sharpInnerEdges(const SurfaceMesh& mesh);

/// Longest side (m) of the box around all vertices; 0 if there are none.
double extentOf(const SurfaceMesh& mesh);

}  // namespace carom::modal
