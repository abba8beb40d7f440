#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "carom/audio/vector.h"

namespace carom::fuzz {

/// Turns the bytes of a fuzzer into numbers and choices, front to back, so that what a byte decides
/// stays the same when later bytes change. Zeros follow the last byte.
class FuzzNumbers {
 public:
  explicit FuzzNumbers(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  bool isEmpty() const { return at_ >= bytes_.size(); }
  std::uint8_t byte() { return at_ < bytes_.size() ? bytes_[at_++] : std::uint8_t{0}; }
  std::size_t below(std::size_t limit) { return byte() % limit; }
  bool chance(unsigned of256) { return byte() < of256; }
  /// As `chance`, but false behind the last byte: for what is no usual case.
  bool rarely(unsigned of256) { return byte() >= 256U - of256; }

  double share() { return static_cast<double>(byte() * 256U + byte()) / 65535.0; }
  double between(double low, double high) { return low + (high - low) * share(); }
  double logBetween(double low, double high) { return low * std::pow(high / low, share()); }
  Vec3 inCube(double half) {
    const double x = between(-half, half);
    const double y = between(-half, half);
    return {x, y, between(-half, half)};
  }

  /// Usually `sound`, in one of eight cases a number that no host should give.
  double wild(double sound) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    constexpr double kMost = std::numeric_limits<double>::max();
    constexpr std::array kWild = {0.0,
                                  -1.0,
                                  1e-300,
                                  1e30,
                                  -1e45,
                                  kMost,
                                  kInfinity,
                                  -kInfinity,
                                  std::numeric_limits<double>::quiet_NaN(),
                                  std::numeric_limits<double>::denorm_min()};
    const std::uint8_t choice = byte();
    return choice < 224 ? sound : kWild[(choice - 224U) % kWild.size()];
  }
  Vec3 wild(const Vec3& sound) { return {wild(sound.x()), wild(sound.y()), wild(sound.z())}; }

 private:
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
};

inline void require(bool promise) {
  if (!promise) __builtin_trap();
}

}  // namespace carom::fuzz
