#pragma once

#include <cstddef>
#include <vector>

#include "native/jello/jello_world.h"

namespace carom::bench {

/// The same lattice in the obvious form: points as structs, springs that point to two of them, the
/// classic Runge-Kutta step over it. It has no walls, fields or balls.
class PointerJello {
 public:
  explicit PointerJello(const native::JelloWorld& world);
  void step(double h);
  Vec3 position(std::size_t point) const { return points_[point].position; }

 private:
  struct Point {
    Vec3 position;
    Vec3 velocity;
    Vec3 force = Vec3::Zero();
  };
  struct Spring {
    Point* a;
    Point* b;
    double length;
  };
  void findForces();

  double mass_;
  double stiffness_;
  double damping_;
  Vec3 gravity_;
  std::vector<Point> points_;
  std::vector<Spring> springs_;
};

}  // namespace carom::bench
