#pragma once

#include <vector>

#include "native/jello/jello_kernels.h"

namespace carom::native {

/// Returns the kernels of instruction sets that fuse a multiplication and an addition, the widest
/// first; other sets would round twice.
std::vector<JelloKernel> simdJelloKernels();

}  // namespace carom::native
