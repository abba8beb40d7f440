#pragma once

#include "bullet_bridge/geometry/rigid_motion.h"
#include "tests/support/random.h"

namespace carom {

/// A body that tumbles and flies towards the origin from `distance` m away.
inline bullet::RigidMotion tumbling(Random& random, double distance, double speed, double spin) {
  bullet::RigidMotion motion;
  const Vec3 from = random.direction();
  motion.centre.position = distance * from;
  motion.centre.velocity = speed * (0.2 * random.inCube() - from);
  motion.centre.acceleration = Vec3(0, -9.81, 0);
  motion.orientation = random.orientation();
  motion.angularVelocity = spin * random.direction();
  return motion;
}

}  // namespace carom
