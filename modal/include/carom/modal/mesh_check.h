#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include <carom/audio/result.h>
#include <carom/audio/surface_mesh.h>

namespace carom {

/// A fault of a surface.
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

/// Returns the name of a fault, "open_surface" and so on, which does not change. [any thread]
std::string_view nameOf(MeshFault fault);

/// One kind of fault that was found.
struct MeshFinding {
  MeshFault fault = MeshFault::empty;
  std::size_t count = 0;  ///< number of edges, triangles or parts; 1 for a fault of the whole
  std::string text;  ///< one sentence: the fault, its number, the place of the first, the remedy
};

/// The properties of a surface, and its faults.
struct MeshReport {
  std::vector<MeshFinding> findings;  ///< in the order of MeshFault
  double extent = 0.0;                ///< m, the longest side of the box around it
  double area = 0.0;                  ///< m^2
  double volume = 0.0;                ///< m^3, signed; means nothing if the surface is open
  /// Number of triangles in each part, the largest first; triangles joined by a vertex are one
  /// part.
  std::vector<std::size_t> parts;

  const MeshFinding* find(MeshFault fault) const;  ///< nullptr if there is no such fault
  bool has(MeshFault fault) const { return find(fault) != nullptr; }
};

/// Checks a surface, which may be anything. Indices and coordinates come first; if they are bad,
/// nothing else is checked. Vertices are told apart by index: those that coincide are not the same.
/// The check does not find out if the surface crosses itself. Time n log n. [any thread]
MeshReport checkMesh(const SurfaceMesh& mesh);

/// Succeeds if the mesh can be the surface of a solid: not empty, indices in range, finite, closed,
/// facing outwards, something inside. Error: all its faults, in one sentence. [any thread]
Status needSolid(const MeshReport& report);

/// A surface after all faults that can be mended without guessing were mended.
struct MendedMesh {
  SurfaceMesh surface;
  std::size_t degenerate = 0;  ///< triangles dropped
  std::size_t duplicate = 0;   ///< triangles dropped
  std::size_t flipped = 0;  ///< edges turned in their quadrangle, to mend a triangle without area
  std::size_t turned = 0;   ///< triangles turned to face the other way
};

/// Drops triangles that have a corner twice, and all but one of equal ones that face the same way;
/// where a triangle is a needle (three vertices on a line), flips the edge between it and its
/// neighbour; turns triangles to face as their neighbours do, the minority of each part, and closed
/// parts outward, but for parts that lie in the box of another part, which may be cavities.
/// Vertices that no triangle uses are dropped. Needs indices in range and finite coordinates. [any
/// thread]
MendedMesh mended(const SurfaceMesh& mesh);

}  // namespace carom
