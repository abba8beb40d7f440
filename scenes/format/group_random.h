#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>

#include "carom/audio/vector.h"
#include "modal/json/json_reader.h"

namespace carom::scenes {

/// The random numbers of one group of spheres. The standard fixes the bits of the engine, but not
/// those of its distributions, so these are our own. [one thread]
class GroupRandom {
 public:
  GroupRandom(std::uint64_t seed, std::uint64_t group) : engine_(mixed(mixed(seed) + group)) {}

  /// Uniform in [0, 1), with 53 bits.
  double unit() { return static_cast<double>(engine_() >> 11U) * 0x1p-53; }

  double within(const modal::Interval& interval) {
    const double value = interval.min + (interval.max - interval.min) * unit();
    return std::min(value, interval.max);  // rounding can reach past it
  }

  /// Uniform in [0, count), count < 2^32.
  std::size_t index(std::size_t count) { return ((engine_() >> 32U) * count) >> 32U; }

  /// Uniform on the unit sphere, by + - * sqrt only: Marsaglia 1972, "Choosing a point from the
  /// surface of a sphere".
  Vec3 direction() {
    for (;;) {
      const double first = 2.0 * unit() - 1.0;
      const double second = 2.0 * unit() - 1.0;
      const double square = first * first + second * second;
      if (square >= 1.0) continue;
      const double scale = 2.0 * std::sqrt(1.0 - square);
      return {first * scale, second * scale, 1.0 - 2.0 * square};
    }
  }

 private:
  /// The finaliser of SplitMix64 (Steele, Lea, Flood 2014): neighbouring seeds become unrelated.
  static std::uint64_t mixed(std::uint64_t bits) {
    bits += 0x9e3779b97f4a7c15U;
    bits = (bits ^ (bits >> 30U)) * 0xbf58476d1ce4e5b9U;
    bits = (bits ^ (bits >> 27U)) * 0x94d049bb133111ebU;
    return bits ^ (bits >> 31U);
  }

  std::mt19937_64 engine_;
};

}  // namespace carom::scenes
