#pragma once

#include <cstdint>
#include <vector>

#include "tests/bench/figures.h"

namespace carom::bench {

/// A fixed piece of work that has nothing in common with ours: arithmetic in double on an array in
/// the first cache, a chase of indices through the second one, a sort. A pass takes some 50 us.
/// Whoever has no peer of his own is measured beside it, so that the ratio leaves the speed of the
/// machine out. Whoever changes it makes all stored ratios useless.
class MachineWork {
 public:
  MachineWork();
  /// Returns what no compiler may leave out.
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

/// Passes per second, times `perPass`.
Work machineRate(double perPass = 1.0);
/// CPU time of a pass in seconds, divided by `perPass`.
Work machineTime(double perPass = 1.0);

}  // namespace carom::bench
