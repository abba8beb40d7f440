#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace carom::lab {

/// Returns a ratio of powers in dB; -300 dB for nothing.
inline double decibels(double ratio) {
  return 10.0 * std::log10(std::max(ratio, 1e-30));
}

/// Returns the median, of an even number of values the upper of the two in the middle; 0 of none.
inline double medianOf(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Returns the median of the values from one index up to another, which is not among them.
inline double medianOf(const std::vector<double>& values, std::size_t from, std::size_t to) {
  return medianOf(std::vector<double>(values.begin() + static_cast<std::ptrdiff_t>(from),
                                      values.begin() + static_cast<std::ptrdiff_t>(to)));
}

}  // namespace carom::lab
