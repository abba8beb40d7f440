#pragma once

#include <random>

#include "bullet_bridge/rigid_motion.h"

namespace carom {

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine_);
  }
  Vec3 vector(double scale) {
    const double x = between(-scale, scale), y = between(-scale, scale);
    return {x, y, between(-scale, scale)};
  }
  Vec3 direction() {
    for (;;) {
      const Vec3 v = vector(1.0);
      if (v.norm() < 1.0 && v.norm() > 0.1) return v.normalized();
    }
  }
  Quat orientation() {
    const double angle = between(0.0, 3.14);
    return Quat(Eigen::AngleAxisd(angle, direction()));
  }

 private:
  std::mt19937 engine_;
};

/// A body that tumbles towards the origin from `distance` m away.
inline RigidMotion tumbling(Random& random, double distance, double speed, double spin) {
  RigidMotion motion;
  const Vec3 from = random.direction();
  motion.centre.position = distance * from;
  motion.centre.velocity = speed * (random.vector(0.2) - from);
  motion.centre.acceleration = Vec3(0, -9.81, 0);
  motion.orientation = random.orientation();
  motion.angularVelocity = spin * random.direction();
  return motion;
}

}  // namespace carom
