#pragma once

#include <cstdint>
#include <vector>

#include "tests/bench/figures.h"

namespace carom::bench {

/// A fixed piece of work that has nothing in common with the project's: arithmetic in double on an
/// array in the first-level cache, a chase of indices through the second-level one, a sort. A pass
/// takes some 50 us. Figures without a peer are measured beside it, so that the ratio is
/// independent of the machine's speed. A change of this work makes all stored ratios useless.
class MachineWork {
 public:
  MachineWork();
  /// Does one pass; returns a value that depends on all of it, so that no compiler can leave it
  /// out.
  double pass();

 private:
  double calculate();
  std::uint32_t chase();
  double sort();

  std::vector<double> numbers_;
  std::vector<std::uint32_t> next_;  // one cycle through all places
  std::vector<double> unsorted_;
  std::vector<double> sorted_;
  std::uint32_t place_ = 0;
};

inline constexpr const char* kMachine = "the machine yardstick";

/// Measures passes per second, times `perPass`.
Work machineRate(double perPass = 1.0);
/// Measures the CPU time of a pass in seconds, divided by `perPass`.
Work machineTime(double perPass = 1.0);

}  // namespace carom::bench
