#pragma once

#include <limits>

#include "audio/material.h"

namespace carom {

/// What a body radiates as. This version knows rigid spheres, and bodies that do not radiate
/// (planes, anything immovable): those only lend their material to the contact.
struct SoundBody {
  Material material;
  /// kg, > 0; infinite for a body that no impulse moves, which makes no acceleration noise.
  double mass = std::numeric_limits<double>::infinity();
  /// m, > 0, radius of the radiating sphere; not used where the mass is infinite.
  double radius = 0.0;
  /// m, > 0, how blunt its edges and corners are: the radius of curvature where it is hit there,
  /// and of both bodies where two flat faces meet. The default is that of a machined edge.
  double edgeRadius = 1e-3;
};

}  // namespace carom
