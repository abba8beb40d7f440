#pragma once

#include "audio/material.h"

namespace carom {

/// What something is probably made of: the common material (materialTable) whose density is
/// nearest in ratio to this one, kg/m^3, > 0. [any thread]
const Material& materialByDensity(double density);

}  // namespace carom
