#pragma once

#include <cmath>
#include <cstdint>
#include <random>

#include "carom/audio/vector.h"

namespace carom {

/// Random numbers that depend on the seed alone and are the same with every standard library.
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  double between(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_() >> 11) * 0x1p-53;
  }
  /// A log-uniform number: each order of magnitude is as likely as the next.
  double logBetween(double low, double high) {
    return std::exp(between(std::log(low), std::log(high)));
  }
  int below(int limit) { return static_cast<int>(between(0.0, static_cast<double>(limit))); }
  bool chance(double probability) { return between(0.0, 1.0) < probability; }

  Vec3 inCube() {
    const double x = between(-1, 1);
    const double y = between(-1, 1);
    return {x, y, between(-1, 1)};
  }
  Vec3 direction() {
    for (;;) {
      const Vec3 point = inCube();
      if (point.norm() <= 1.0 && point.norm() > 0.1) return point.normalized();
    }
  }
  Quat orientation() {
    const Vec3 axis = direction();
    return Quat(Eigen::AngleAxisd(between(0.0, 2.0 * 3.141592653589793), axis));
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace carom
