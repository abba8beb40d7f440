#pragma once

#include <limits>
#include <numbers>

namespace carom::test {

inline constexpr double kPi = std::numbers::pi;
inline constexpr double kRate = 48000.0;  ///< Hz, sample rate of most sounds in tests
inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

}  // namespace carom::test
