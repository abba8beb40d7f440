#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace carom::bullet {

/// Box around the path of a body over a substep; low <= high.
struct SweptBox {
  std::array<float, 3> low{};   ///< m, world frame, rounded down
  std::array<float, 3> high{};  ///< m, world frame, rounded up
  std::uint32_t body = 0;       ///< number by which pairs name the body
  bool active = false;          ///< false: immovable or asleep
};

/// True if the boxes overlap or touch.
inline bool overlap(const SweptBox& a, const SweptBox& b) {
  // Computed without branches, which the processor could not predict here.
  const auto apart = [&](std::size_t axis) {
    return static_cast<unsigned>(a.low[axis] > b.high[axis]) |
           static_cast<unsigned>(b.low[axis] > a.high[axis]);
  };
  return (apart(0) | apart(1) | apart(2)) == 0;
}

}  // namespace carom::bullet
