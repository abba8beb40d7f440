#pragma once

#include <vector>

#include "native/jello_kernels.h"

namespace carom::native {

/// Those of instruction sets that fuse a multiplication and an addition, the widest first: others
/// would round twice.
std::vector<JelloKernel> simdJelloKernels();

}  // namespace carom::native
