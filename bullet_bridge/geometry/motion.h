#pragma once

#include "carom/audio/vector.h"

namespace carom::bullet {

/// Motion of a point under constant acceleration, which is exactly Bullet's motion within one
/// substep: with the velocity w after the solver and the acceleration a, symplectic Euler lands on
/// the nodes of
///
///     x(s) = x0 + (w - a dt/2) s + a s^2/2,   0 <= s <= dt
///
/// which joins up smoothly from step to step.
struct Motion {
  Vec3 position = Vec3::Zero();      ///< m, at s = 0
  Vec3 velocity = Vec3::Zero();      ///< m/s, at s = 0
  Vec3 acceleration = Vec3::Zero();  ///< m/s^2

  Vec3 positionAt(double s) const { return position + s * (velocity + (0.5 * s) * acceleration); }
  Vec3 velocityAt(double s) const { return velocity + s * acceleration; }
};

inline Motion operator-(const Motion& of, const Motion& relativeTo) {
  return {of.position - relativeTo.position, of.velocity - relativeTo.velocity,
          of.acceleration - relativeTo.acceleration};
}

}  // namespace carom::bullet
