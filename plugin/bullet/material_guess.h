#pragma once

#include "carom/audio/material.h"

namespace carom::plugin {

/// Returns the material that a body of this density (kg/m^3, > 0) is probably made of. Applications
/// set masses by feel, so the guess is among the four solids that they mean most: wood, plastic,
/// granite and steel; never what is soft, as a rubber by guess reads as a fault of the sound.
///
/// Stiffness, damping and roughness between two of these are interpolated over the logarithm of the
/// density, so that bodies of nearly the same density sound nearly the same; below wood and above
/// steel they are theirs. The name is that of the nearest in ratio, the density is the body's.
/// [any thread]
Material materialByDensity(double density);

}  // namespace carom::plugin
