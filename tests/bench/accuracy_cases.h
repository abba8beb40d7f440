#pragma once

#include <functional>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "tests/bench/pair_world.h"

namespace carom::bench {

/// Numbers that are the same everywhere.
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  double between(double low, double high) {
    return low + (high - low) * double(engine_() >> 11) * 0x1p-53;
  }
  int below(int limit) { return int(between(0.0, double(limit))); }
  Vec3 inCube() { return {between(-1, 1), between(-1, 1), between(-1, 1)}; }
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

/// What many runs of a pair of bodies have in common.
struct PairCase {
  std::string name;
  int runs = 0;
  bool firstOnly = false;  ///< only the first touch of each run is compared
  double duration = 0.3;   ///< s, at most
  double barRms = std::numeric_limits<double>::infinity();      ///< us
  double barMax = 0.0;                                          ///< us
  double barImpulse = std::numeric_limits<double>::infinity();  ///< fraction
  /// Adds the two bodies of one run; what it returns describes the run.
  std::function<std::string(PairWorld& world, Random& random, int run, double dt)> build;
};

/// Spheres on a plane and in pairs.
std::vector<PairCase> sphereCases();
/// Tumbling boxes, capsules, cylinders, hulls and compounds, on planes, on boxes, on each other.
std::vector<PairCase> shapeCases();

}  // namespace carom::bench
