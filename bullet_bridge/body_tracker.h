#pragma once

#include <cstddef>
#include <unordered_map>
#include <vector>

#include <btBulletDynamicsCommon.h>

#include "bullet_bridge/rigid_motion.h"
#include "bullet_bridge/to_vec3.h"
#include "carom/audio/impulse_event.h"

class btMultiBody;
class btMultiBodyLinkCollider;

namespace carom::bullet {

inline Quat toQuat(const btTransform& pose) {
  const btQuaternion q = pose.getRotation();
  return Quat(static_cast<double>(q.w()), static_cast<double>(q.x()), static_cast<double>(q.y()),
              static_cast<double>(q.z()))
      .normalized();
}

/// What one body did in one substep, as Bullet's own numbers say.
struct SubstepMotion {
  Vec3 start = Vec3::Zero();            ///< m, centre of mass at the start
  Vec3 velocityBefore = Vec3::Zero();   ///< m/s, at the start, before the solver
  Vec3 velocityFree = Vec3::Zero();     ///< m/s, after a solver that finds no contacts
  Vec3 velocityAfter = Vec3::Zero();    ///< m/s, after the solver: what carries the body to the end
  Vec3 acceleration = Vec3::Zero();     ///< m/s^2, total force over mass
  Quat orientation = Quat::Identity();  ///< body to world, at the start; not kept of spheres
  Vec3 angularBefore = Vec3::Zero();    ///< rad/s, world frame, before the solver
  Vec3 angularFree = Vec3::Zero();      ///< rad/s, as velocityFree; of spheres as before
  Vec3 angularAfter = Vec3::Zero();     ///< rad/s, after the solver
  bool known = false;                   ///< the body was in the world for the whole substep

  /// The way its centre went.
  Motion actual(double dt) const {
    return {start, velocityAfter - (0.5 * dt) * acceleration, acceleration};
  }
  /// The way it would have gone had the solver not touched it.
  Motion unhindered(double dt) const {
    return {start, velocityFree - (0.5 * dt) * acceleration, acceleration};
  }
};

/// How the bridge follows a body's shape: in closed form, or by its convex pieces. `none` touches
/// nothing: no contact response, or not a rigid body.
enum class ContactShape { none, sphere, plane, other };

/// What moves a body: its own motion (rigid), its joints (link), the host (kinematic), nothing.
enum class BodyKind { fixed, rigid, link, kinematic };

struct TrackedBody {
  const btCollisionObject* object = nullptr;
  int proxyId = -1;  ///< tells a new object at an old address from the old one
  BodyId id = 0;
  BodyKind kind = BodyKind::fixed;
  ContactShape shape = ContactShape::none;
  bool awake = false;        ///< may move in this substep
  bool continuous = false;   ///< Bullet may stop it short (CCD) and solve predicted contacts
  double inverseMass = 0.0;  ///< 1/kg; 0 where it has none of its own: fixed, kinematic, links

  double radius = 0.0;               ///< m: of a sphere; of a ball around another shape's centre
  double margin = 0.0;               ///< m, gap below which Bullet may hold a contact
  Vec3 planeNormal = Vec3::UnitY();  ///< world frame, of a plane
  double planeOffset = 0.0;          ///< m, from the world's origin along the normal

  /// s, kinematic: until it is where Bullet has put it already, from the start of the substep.
  double arrival = 0.0;

  SubstepMotion current;

  /// Its whole motion in this substep of length dt.
  RigidMotion actual(double dt) const;
  RigidMotion unhindered(double dt) const;

 private:
  Quat orientationAtStart(double dt) const;
};

/// The motion of every body of a world over one substep. [physics thread]
///
/// Bullet puts a kinematic body where the host wants it in the first of a stepSimulation's
/// substeps, with the velocity that would take it there in all of them. It is followed on that way
/// instead, from where it was.
class BodyTracker {
 public:
  void beginSubstep(const btCollisionWorld& world, double dt);
  void endSubstep(const btCollisionWorld& world, double dt);
  /// nullptr for an object that was not in the world for the whole substep.
  const TrackedBody* find(const btCollisionObject& object) const;
  /// nullptr when it is no longer in the world.
  const TrackedBody* find(BodyId id) const;
  /// In the order of the world's own array.
  const std::vector<TrackedBody>& bodies() const { return bodies_; }
  /// What a body of another shape than sphere and plane did in the substep before, if it was there.
  const SubstepMotion& previous(const TrackedBody& body) const;
  /// Whether any body is followed by its pieces, is a plane, or may be stopped short.
  bool hasOtherShapes() const { return hasOtherShapes_; }
  bool hasPlanes() const { return hasPlanes_; }
  bool hasContinuous() const { return hasContinuous_; }

 private:
  // Of a body that the bridge does not follow by Bullet's own node states alone.
  struct Trail {
    SubstepMotion previous;
    bool followed = false;  // kinematic: the rest of this is in use
    Vec3 place = Vec3::Zero();
    Quat turn = Quat::Identity();
    btTransform target = btTransform::getIdentity();  // where Bullet has put it
    Vec3 acceleration = Vec3::Zero();                 // link: latest without a push
    Vec3 bend = Vec3::Zero();  // likewise, m/s: its mean velocity less that at the end
  };

  void matchWorld(const btCollisionWorld& world);
  void beginBody(TrackedBody& body, Trail& trail, double dt);
  void readShape(TrackedBody& body) const;
  void beginKinematic(TrackedBody& body, Trail& trail, double dt);
  void endBody(TrackedBody& body, Trail& trail, double dt);
  void endLink(const btMultiBodyLinkCollider& link, SubstepMotion& motion, Trail& trail, double dt);
  void findPushedMultibodies(const btCollisionWorld& world);

  std::vector<TrackedBody> bodies_;
  std::vector<Trail> trails_;  // as bodies_
  std::unordered_map<BodyId, std::size_t> indexOf_;
  BodyId nextId_ = 0;
  bool hasOtherShapes_ = false;
  bool hasPlanes_ = false;
  bool hasContinuous_ = false;
  bool relativeMargin_ = true;  // of contacts: Bullet takes it from the shape's size
  bool hasLinks_ = false;
  std::vector<const btMultiBody*> pushed_;  // in this substep; kept for its memory
};

}  // namespace carom::bullet
