#pragma once

#include <cstddef>
#include <unordered_map>
#include <vector>

#include <btBulletDynamicsCommon.h>

#include "audio/impulse_event.h"
#include "bullet_bridge/motion.h"

namespace carom {

inline Vec3 toVec3(const btVector3& v) {
  return {static_cast<double>(v.x()), static_cast<double>(v.y()), static_cast<double>(v.z())};
}

/// What one body did in one substep, as Bullet's own numbers say.
struct SubstepMotion {
  Vec3 start = Vec3::Zero();           ///< m, centre of mass at the start
  Vec3 velocityBefore = Vec3::Zero();  ///< m/s, at the start, before the solver
  Vec3 velocityAfter = Vec3::Zero();   ///< m/s, after the solver: what carries the body to the end
  Vec3 acceleration = Vec3::Zero();    ///< m/s^2, total force over mass
  bool known = false;                  ///< the body was in the world for the whole substep

  /// The way it went.
  Motion actual(double dt) const {
    return {start, velocityAfter - (0.5 * dt) * acceleration, acceleration};
  }
  /// The way it would have gone had the solver not touched it.
  Motion unhindered(double dt) const {
    return {start, velocityBefore + (0.5 * dt) * acceleration, acceleration};
  }
};

enum class ContactShape { sphere, plane, other };

struct TrackedBody {
  const btCollisionObject* object = nullptr;
  int proxyId = -1;  ///< tells a new object at an old address from the old one
  BodyId id = 0;
  double inverseMass = 0.0;  ///< 1/kg; 0 for static and kinematic bodies

  ContactShape shape = ContactShape::other;
  double radius = 0.0;               ///< m, of a sphere
  Vec3 planeNormal = Vec3::UnitY();  ///< world frame, of a plane
  double planeOffset = 0.0;          ///< m, from the world's origin along the normal

  SubstepMotion current;
};

/// The motion of every body of a world over one substep. [physics thread]
class BodyTracker {
 public:
  void beginSubstep(const btCollisionWorld& world);
  void endSubstep(const btCollisionWorld& world);
  /// nullptr for an object that was not in the world for the whole substep.
  const TrackedBody* find(const btCollisionObject& object) const;
  /// nullptr when it is no longer in the world.
  const TrackedBody* find(BodyId id) const;
  /// In the order of the world's own array.
  const std::vector<TrackedBody>& bodies() const { return bodies_; }

 private:
  void matchWorld(const btCollisionWorld& world);

  std::vector<TrackedBody> bodies_;
  std::unordered_map<BodyId, std::size_t> indexOf_;
  BodyId nextId_ = 0;
};

}  // namespace carom
