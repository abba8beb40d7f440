#pragma once

#include "carom/audio/surface_mesh.h"
#include "modal/radiation/exterior_solver.h"

namespace carom::modal {

/// A surface by its part on one side of its mirror planes.
struct MirrorPart {
  SurfaceMesh part;  ///< m, where the coordinates across mirrors are positive; open at the mirrors
  ExteriorSolver::Mirrors mirrors = {};
  double area = 0.0;  ///< m^2, of the whole surface
};

/// Finds those of the three coordinate planes that are mirror planes of a closed surface: within
/// 1e-6 of its extent, each vertex has an image among the vertices, and each triangle one among the
/// planes and places of the surface. [any thread]
MirrorPart mirrorPart(const SurfaceMesh& surface);

}  // namespace carom::modal
