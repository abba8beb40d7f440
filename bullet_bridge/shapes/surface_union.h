#pragma once

#include <optional>
#include <vector>

#include "carom/audio/surface_mesh.h"

namespace carom::bullet {

/// Returns the surface of the union of convex solids, each closed and outward: the parts of each
/// that lie in none of the others. Faces that coincide are kept once if they look the same way, not
/// at all if they touch back to back. Points nearer than `tolerance` (m) count as one. Returns
/// nothing if the parts do not close. Time grows with the square of the number of triangles. [any
/// thread]
std::optional<SurfaceMesh> unionOfConvex(const std::vector<SurfaceMesh>& solids, double tolerance);

}  // namespace carom::bullet
