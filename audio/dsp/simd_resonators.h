#pragma once

#include <vector>

#include "audio/dsp/resonator_kernels.h"

namespace carom::audio {

/// The vectorised kernels that this machine can run, the widest first.
std::vector<ResonatorKernels> simdResonators();

}  // namespace carom::audio
