#pragma once

#include "carom/audio/result.h"
#include "carom/audio/surface_mesh.h"

namespace carom::audio {

/// Prepares a mesh from outside for panels: vertices within 1e-6 of its extent are merged; it must
/// be closed and enclose a volume; bodies that are inside out are turned round; cavities and bodies
/// that lie inside another one are left out, since no outside air moves there (their content moves
/// along). Error, with the fault that was found: indices out of range, coordinates that are not
/// finite, an open surface, no volume. Bodies whose surfaces cross each other are not noticed.
/// [any thread]
Result<SurfaceMesh> cleanSurface(const SurfaceMesh& mesh);

/// Returns the mesh with fewer triangles, at most `most`, by vertex clustering (Rossignac and
/// Borrel 1993): one vertex per cell of a grid, where it fits the planes of its triangles best
/// (Lindstrom 2000). A closed mesh stays closed. Parts thinner than a cell, about
/// sqrt(area / most), may collapse or fold: where that takes 2 % of the volume, or makes two
/// neighbours lie back to back, the mesh is simplified edge by edge instead (collapsedSurface), off
/// its planes by as little as suffices, 1e-4 to 1e-2 of its extent: that keeps the shape of slender
/// and thin bodies, but not their mirror planes. Where that does not suffice either, it stays as
/// clustering has left it, which may be nothing: of many bodies apart. A mesh that is small enough
/// is returned as it is. [any thread]
SurfaceMesh clusteredSurface(const SurfaceMesh& mesh, std::size_t most);

/// True if two neighbours lie back to back: there is no body between them, and no flow around it
/// that their triangles could tell.
bool isFolded(const SurfaceMesh& mesh);

/// Returns at least `least` triangles on the same surface: those with the longest edges are halved,
/// without regard to their neighbours, so the outcome fits together as a surface but not edge by
/// edge.
SurfaceMesh halvedSurface(SurfaceMesh mesh, std::size_t least);

/// Splits each triangle into four similar ones, on the same surface.
SurfaceMesh quarteredSurface(const SurfaceMesh& mesh);

/// Total length in m of the edges of a closed mesh where the normal turns by more than 45 degrees.
double sharpEdgeLength(const SurfaceMesh& mesh);

}  // namespace carom::audio
