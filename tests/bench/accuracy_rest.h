#pragma once

#include <string>
#include <vector>

namespace carom::bench {

/// Bodies that rest on the ground for a while: no collision may be reported.
struct RestCase {
  enum class Shape { sphere, box };
  enum class Ground { plane, box };
  Shape shape = Shape::sphere;
  Ground ground = Ground::plane;
  int bodies = 0;
  bool maySleep = true;
  std::string name() const;
};

struct RestResult {
  int events = 0;
  double speed = 0.0;  ///< m/s, greatest speed of a body's surface in Bullet
  bool unsupported = false;
};

/// Returns cases with `bodies` bodies each, and cases with ten times as many that may sleep.
std::vector<RestCase> restCases(int bodies);
/// Runs the case for 10 s in steps of `dt` (s).
RestResult runRest(const RestCase& which, double dt);

}  // namespace carom::bench
