#pragma once

#include <cstddef>

#include "carom/audio/surface_mesh.h"

namespace carom::audio {

/// Returns a closed mesh with fewer triangles, `most` if it can be done, by moving one end of an
/// edge to the other, shortest edges first (edge collapse): so triangles become about equally
/// large. No vertex goes whose planes the rest would leave by more than `deviation` (m, root mean
/// square over their areas: Garland and Heckbert 1997), nor does a triangle turn over: flat sides
/// and straight edges stay as they are, however thin the body is. [any thread]
SurfaceMesh collapsedSurface(const SurfaceMesh& mesh, std::size_t most, double deviation);

}  // namespace carom::audio
