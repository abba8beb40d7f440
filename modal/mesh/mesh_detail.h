#pragma once

#include <cstddef>

#include "carom/audio/result.h"
#include "carom/audio/surface_mesh.h"

namespace carom::modal {

/// A subdivision that would give more triangles than this is refused.
inline constexpr std::size_t kMostTriangles = 4'000'000;

/// Returns the same surface in more triangles: every edge longer than `longestEdge` (m) is halved,
/// for both of its triangles, until none is left. So a closed surface stays closed, without cracks,
/// and area and volume stay. A triangle becomes two, three or four; its longest edge is halved
/// first (Rivara 1984), which keeps angles from falling below about half of the smallest one.
/// Error: a length that is not positive, or too many triangles. Needs indices in range and finite
/// coordinates. [any thread]
Result<SurfaceMesh> subdivided(const SurfaceMesh& mesh, double longestEdge);

/// Subdivides the mesh until there are at least `least` vertices, the longest edges first. Returns
/// the mesh as it is if it has as many, or no edge of any length. Error: too many triangles. [any
/// thread]
Result<SurfaceMesh> subdividedTo(const SurfaceMesh& mesh, std::size_t least);

/// Reduces the mesh to at most `most` vertices, by collapsing edges where that moves the surface
/// least (quadric error metric, Garland and Heckbert 1997; meshoptimizer does it). A closed surface
/// stays closed, a border stays near where it was. Returns the mesh as it is if it is small enough.
/// Error: it cannot be made so small without tearing the surface or losing one of its parts, or
/// `most` is less than 4; in a build without meshoptimizer, whenever there is something to do. [any
/// thread]
Result<SurfaceMesh> simplified(const SurfaceMesh& mesh, std::size_t most);

}  // namespace carom::modal
