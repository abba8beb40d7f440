#pragma once

#include "carom/audio/surface_mesh.h"
#include "scenes/format/solid_shape.h"

namespace carom::scenes {

/// Returns the surface of a solid in m, body frame. A cylinder becomes a polyhedron of equal
/// volume, as shapeSurface makes it. [any thread], allocates.
SurfaceMesh surfaceOf(const SolidShape& solid);

}  // namespace carom::scenes
