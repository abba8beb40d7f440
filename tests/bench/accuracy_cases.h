#pragma once

#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "tests/bench/pair_world.h"
#include "tests/support/random.h"

namespace carom::bench {

/// The common properties of many runs of a pair of bodies.
struct PairCase {
  std::string name;
  int runs = 0;
  bool firstOnly = false;  ///< only the first touch of each run is compared
  double duration = 0.3;   ///< s, at most
  double barRms = std::numeric_limits<double>::infinity();      ///< us
  double barMax = 0.0;                                          ///< us
  double barImpulse = std::numeric_limits<double>::infinity();  ///< fraction
  /// Adds the two bodies of one run; returns a description of the run.
  std::function<std::string(PairWorld& world, Random& random, int run, double dt)> build;
};

/// Cases of spheres on a plane and in pairs.
std::vector<PairCase> sphereCases();
/// Cases of tumbling boxes, capsules, cylinders, hulls and compounds, on planes, on boxes and on
/// each other.
std::vector<PairCase> shapeCases();

}  // namespace carom::bench
