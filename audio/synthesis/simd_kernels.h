#pragma once

#include <vector>

#include "audio/synthesis/click_kernels.h"

namespace carom::audio {

/// The vectorised kernels that this machine can run, the widest first.
std::vector<ClickKernels> simdKernels();

}  // namespace carom::audio
