#pragma once

#include "carom/audio/result.h"
#include "carom/audio/surface_mesh.h"

namespace carom::audio {

/// What a mesh from outside has to go through before panels are made of it: vertices within 1e-6 of
/// its extent are one; it must be closed and enclose a volume; bodies that are inside out are
/// turned round; cavities and bodies that lie inside another one are left out, since no outside air
/// moves there (what they hold moves along). Error, with what was found: indices out of range,
/// coordinates that are not finite, an open surface, no volume. Bodies whose surfaces cross each
/// other are not noticed. [any thread]
Result<SurfaceMesh> cleanSurface(const SurfaceMesh& mesh);

/// Fewer triangles, at most `most`, by vertex clustering (Rossignac and Borrel 1993): one vertex
/// per cell of a grid, where it fits the planes of its triangles best (Lindstrom 2000). Closed
/// stays closed. What is thinner than a cell, about sqrt(area / most), may collapse and be lost. A
/// mesh that is small enough is returned as it is. [any thread]
SurfaceMesh clusteredSurface(const SurfaceMesh& mesh, std::size_t most);

/// At least `least` triangles on the same surface: those with the longest edges are halved, without
/// regard to their neighbours, so the outcome fits together as a surface but not edge by edge.
SurfaceMesh halvedSurface(SurfaceMesh mesh, std::size_t least);

/// Each triangle in four similar ones, on the same surface.
SurfaceMesh quarteredSurface(const SurfaceMesh& mesh);

/// m, total length of edges where the normal turns by more than 45 degrees; of a closed mesh.
double sharpEdgeLength(const SurfaceMesh& mesh);

}  // namespace carom::audio
