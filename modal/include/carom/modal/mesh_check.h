#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include <carom/audio/result.h>
#include <carom/audio/surface_mesh.h>

namespace carom {

/// What can be the matter with a surface.
enum class MeshFault {
  empty,         ///< no triangles
  badIndex,      ///< a triangle names a vertex that is not there
  notFinite,     ///< a vertex is not finite
  open,          ///< edges that an odd number of triangles share: a border, mostly
  inconsistent,  ///< edges whose triangles face opposite ways
  insideOut,     ///< closed, and of negative volume
  noVolume,      ///< closed, and nothing inside: a sheet with two sides
  degenerate,    ///< triangles without area
  duplicate,     ///< triangles of the same three vertices as another one
  parts,         ///< more than one piece
  nonManifold,   ///< edges that more than two triangles share
  tooLarge,      ///< more than 10 m from end to end
  tooSmall,      ///< less than 1 mm from end to end
};

/// "open_surface" and so on: does not change. [any thread]
std::string_view nameOf(MeshFault fault);

/// One thing that was found.
struct MeshFinding {
  MeshFault fault = MeshFault::empty;
  std::size_t count = 0;  ///< of edges, triangles or parts; 1 of what is there or not
  std::string text;       ///< one sentence: what, how many, where the first is, what to do
};

/// What a surface is like, and what is the matter with it.
struct MeshReport {
  std::vector<MeshFinding> findings;  ///< in the order of MeshFault
  double extent = 0.0;                ///< m, the longest side of the box around it
  double area = 0.0;                  ///< m^2
  double volume = 0.0;                ///< m^3, signed; means nothing if the surface is open
  /// Triangles in each part, the largest first: what is joined by a vertex is one part.
  std::vector<std::size_t> parts;

  const MeshFinding* find(MeshFault fault) const;  ///< nullptr: is not the matter
  bool has(MeshFault fault) const { return find(fault) != nullptr; }
};

/// Looks at a surface, which may be anything. Indices and coordinates first; if they are bad,
/// nothing else is looked at. By indices: vertices that coincide are not the same. Whether the
/// surface crosses itself is not looked at. Time n log n. [any thread]
MeshReport checkMesh(const SurfaceMesh& mesh);

/// Whether it can be the surface of a solid: not empty, indices in range, finite, closed, facing
/// outwards, something inside. Error: all that is the matter, in one sentence. [any thread]
Status needSolid(const MeshReport& report);

/// A surface after what can be mended without guessing was mended.
struct MendedMesh {
  SurfaceMesh surface;
  std::size_t degenerate = 0;  ///< triangles dropped
  std::size_t duplicate = 0;   ///< triangles dropped
  std::size_t flipped = 0;     ///< edges turned in their quadrangle, for a triangle without area
  std::size_t turned = 0;      ///< triangles
};

/// Drops triangles that have a corner twice, and all but one of equal ones that face the same way;
/// where a triangle is a needle (three vertices on a line), puts the edge of its neighbour the
/// other way; turns triangles to face as their neighbours do, the minority of each part, and closed
/// parts outward, but for what lies in the box of another part, which may be a cavity. Vertices
/// that no triangle uses are dropped. Needs indices in range and finite coordinates. [any thread]
MendedMesh mended(const SurfaceMesh& mesh);

}  // namespace carom
