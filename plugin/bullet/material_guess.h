#pragma once

#include "carom/audio/material.h"

namespace carom::plugin {

/// Returns the material that a body of this density (kg/m^3, > 0) is probably made of: the common
/// one (materialTable) whose density is nearest in ratio. [any thread]
const Material& materialByDensity(double density);

}  // namespace carom::plugin
