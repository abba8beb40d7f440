#pragma once

#include <span>
#include <string_view>

namespace carom::bench {

/// How fast this machine multiplies and adds doubles, fused, where nothing has to wait.
struct FmaPeak {
  std::string_view name;  ///< of the instruction set, as ResonatorKernels has it
  double (*work)() =
      nullptr;  ///< does so many of them, each in one lane of a vector, and returns it
};

/// Of each instruction set of this machine that has them, the widest first.
std::span<const FmaPeak> fmaPeaks();

}  // namespace carom::bench
