#pragma once

#include "carom/audio/surface_mesh.h"

namespace carom::lab {

/// Returns the median distance (m) from a triangle of a closed surface inward to the opposite side:
/// the thickness of a wall, where a body has one. 0 if the surface is empty. [any thread]
double wallThickness(const SurfaceMesh& mesh);

/// Moves each vertex along its normal, so far that the sides around it move outward by half of `by`
/// (m, either sign): walls get thicker by `by`, and boxes keep their edges. [any thread]
SurfaceMesh thickened(const SurfaceMesh& mesh, double by);

}  // namespace carom::lab
