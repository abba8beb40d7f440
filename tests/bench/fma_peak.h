#pragma once

#include <span>
#include <string_view>

namespace carom::bench {

/// The rate at which this machine does fused multiply-adds of doubles if none has to wait.
struct FmaPeak {
  std::string_view name;  ///< the instruction set's, as in ResonatorKernels
  double (*work)() =
      nullptr;  ///< does multiply-adds and returns their number, each vector lane counted
};

/// Returns a peak for each instruction set of this machine with fused multiply-add, the widest
/// first.
std::span<const FmaPeak> fmaPeaks();

}  // namespace carom::bench
