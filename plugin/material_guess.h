#pragma once

#include "carom/audio/material.h"

namespace carom::plugin {

/// What something is probably made of: the common material (materialTable) whose density is
/// nearest in ratio to this one, kg/m^3, > 0. [any thread]
const Material& materialByDensity(double density);

}  // namespace carom::plugin
