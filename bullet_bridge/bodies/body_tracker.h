#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

#include <btBulletDynamicsCommon.h>

#include "bullet_bridge/bodies/object_identity.h"
#include "bullet_bridge/geometry/rigid_motion.h"
#include "bullet_bridge/geometry/to_vec3.h"
#include "bullet_bridge/shapes/shape_parts.h"
#include "carom/audio/impulse_event.h"

class btMultiBody;
class btMultiBodyLinkCollider;

namespace carom::bullet {

/// The motion of one body over one substep, from Bullet's own numbers.
struct SubstepMotion {
  Vec3 start = Vec3::Zero();            ///< m, centre of mass at the start
  Vec3 velocityBefore = Vec3::Zero();   ///< m/s, at the start, before the solver
  Vec3 velocityFree = Vec3::Zero();     ///< m/s, as the solver leaves it without contacts
  Vec3 velocityAfter = Vec3::Zero();    ///< m/s, after the solver: carries the body to the end
  Vec3 acceleration = Vec3::Zero();     ///< m/s^2, total force over mass
  Quat orientation = Quat::Identity();  ///< body to world, at the start; not kept for spheres
  Vec3 angularBefore = Vec3::Zero();    ///< rad/s, world frame, before the solver
  Vec3 angularFree = Vec3::Zero();      ///< rad/s, as velocityFree; angularBefore for spheres
  Vec3 angularAfter = Vec3::Zero();     ///< rad/s, after the solver
  bool known = false;                   ///< the body was in the world for the whole substep

  /// The path that its centre took.
  Motion actual(double dt) const {
    return {start, velocityAfter - (0.5 * dt) * acceleration, acceleration};
  }
  /// The path that its centre would have taken without contacts.
  Motion contactFree(double dt) const {
    return {start, velocityFree - (0.5 * dt) * acceleration, acceleration};
  }
};

/// The way in which the bridge follows a body's shape: in closed form, or by its convex pieces. A
/// body of shape `none` touches nothing: it has no contact response, or is not rigid.
enum class ContactShape { none, sphere, plane, other };

/// The cause of a body's motion: its own dynamics (rigid), its joints (link), the host (kinematic),
/// or none (fixed).
enum class BodyKind { fixed, rigid, link, kinematic };

/// The numbers that tell that the host has changed a body's shape.
struct ShapeTrace {
  const btCollisionShape* shape = nullptr;
  double radius = 0.0;  ///< m, as TrackedBody::radius
  double margin = 0.0;  ///< m, Bullet's collision margin
  /// Hash of the place and number of a hull's corners, or of a compound's children and their
  /// places.
  std::uint64_t revision = 0;
  bool operator==(const ShapeTrace&) const = default;
};

struct TrackedBody {
  const btCollisionObject* object = nullptr;
  ObjectIdentity identity;
  BodyId id = 0;
  BodyKind kind = BodyKind::fixed;
  ContactShape shape = ContactShape::none;
  bool awake = false;        ///< may move in this substep
  bool continuous = false;   ///< Bullet may stop it short (CCD) and solve predicted contacts
  double inverseMass = 0.0;  ///< 1/kg; 0 where it has none of its own: fixed, kinematic, links

  /// m, of the sphere; for other shapes, of a ball around the centre that holds the shape.
  double radius = 0.0;
  double margin = 0.0;                      ///< m, gap below which Bullet may hold a contact
  ShapeTrace trace;                         ///< of the shape as it was read last
  std::uint32_t shapeNumber = 0;            ///< number of times that the trace has changed
  std::shared_ptr<const ShapeParts> parts;  ///< of the shape; none for planes and for `none`
  Vec3 planeNormal = Vec3::UnitY();         ///< unit, world frame; planes only
  double planeOffset = 0.0;                 ///< m, from the world's origin along planeNormal

  /// Time (s, from the start of the substep) until a kinematic body reaches the place where Bullet
  /// has put it already.
  double arrival = 0.0;

  SubstepMotion current;

  int restingFor = 0;      ///< substeps in which it has moved no faster than rest, up to now
  bool rests = false;      ///< it has rested for a while and goes on, or does not move at all
  bool isPartial = false;  ///< not all is known of it: see BodyTracker::complete
  /// m/s, upper bound of the speeds of all its points at both nodes of the substep.
  double fastest = 0.0;
  /// m, upper bound of how far turning takes any of its points on the path of this substep; 0 for
  /// spheres.
  double turning = 0.0;
  /// m, upper bound of the sum of what turning did from node to node, up to the start of the
  /// substep; the host's own turns count.
  double turned = 0.0;

  /// The body's motion in this substep of length dt (s), with rotation.
  RigidMotion actual(double dt) const;
  RigidMotion contactFree(double dt) const;

 private:
  Quat orientationAtStart(double dt) const;
};

/// The motion of every body of a world over one substep. [physics thread]
///
/// Bullet puts a kinematic body at the host's target in the first of a stepSimulation's substeps,
/// with the velocity that would take it there in all of them. The tracker instead follows it from
/// its old place at that velocity.
class BodyTracker {
 public:
  /// Bodies that move no faster than `speed` (m/s) are followed at less cost: their damping and
  /// gyroscopic terms are left out. With 0, as at first, none are.
  void setRest(double speed) { restSpeed_ = speed; }
  void beginSubstep(const btCollisionWorld& world, double dt);
  void endSubstep(const btCollisionWorld& world, double dt);
  /// Works out what was left out of a body that seemed to rest, or not to move at all: its
  /// orientation, its motion in the substep before and TrackedBody::turned. Until then, a body that
  /// is `isPartial` has only its place, its velocities, its force and their bounds.
  void complete(const TrackedBody& body);
  /// Takes bodies for unknown in this substep that are no longer in the world, and perhaps gone.
  void leaveOutRemoved(const btCollisionWorld& world);
  /// Returns nullptr for an object that was not in the world for the whole substep.
  const TrackedBody* find(const btCollisionObject& object) const;
  /// Returns nullptr if the body is no longer in the world. `place` is where it was found before,
  /// and is set to where it is found.
  const TrackedBody* find(BodyId id, std::size_t& place) const;
  /// All bodies, in the order of the world's own array.
  const std::vector<TrackedBody>& bodies() const { return bodies_; }
  /// Motion in the substep before, if the body was in the world.
  const SubstepMotion& previous(const TrackedBody& body) const;
  /// True if any body is followed by its pieces, is a plane, or may be stopped short.
  bool hasOtherShapes() const { return hasOtherShapes_; }
  bool hasPlanes() const { return hasPlanes_; }
  bool hasContinuous() const { return hasContinuous_; }
  bool hasSoft() const {
    return hasSoft_;
  }  ///< true if there are soft bodies, which it does not follow

 private:
  // State of earlier substeps, for bodies that Bullet's own node states alone do not suffice to
  // follow.
  struct MotionHistory {
    SubstepMotion previous;
    bool followed = false;  // kinematic: position, orientation and target are in use
    Vec3 position = Vec3::Zero();
    Quat orientation = Quat::Identity();
    btTransform target = btTransform::getIdentity();  // where Bullet has put the body
    double fixedFor = 0.0;                            // s, for which it has been there
    btMatrix3x3 node = btMatrix3x3::getIdentity();    // basis at the node up to which turns count
    btMatrix3x3 start = btMatrix3x3::getIdentity();   // partial bodies: basis at the start
    // Links, of the latest substep without a push: acceleration (m/s^2), and mean velocity less
    // that at the end (m/s).
    Vec3 acceleration = Vec3::Zero();
    Vec3 bend = Vec3::Zero();
  };

  void matchWorld(const btCollisionWorld& world);
  void beginBody(TrackedBody& body, MotionHistory& history, double dt);
  void readShape(TrackedBody& body);
  struct ShapeSize;
  const ShapeSize& sizeOf(const btCollisionShape& shape);
  bool mayRest(const TrackedBody& body) const;
  bool beginResting(TrackedBody& body, MotionHistory& history, double dt) const;
  void completeBody(TrackedBody& body, MotionHistory& history, double dt);
  void countRest(TrackedBody& body) const;
  static void setBounds(TrackedBody& body, double dt);
  static void addTurn(TrackedBody& body, MotionHistory& history, const btMatrix3x3& basis);
  struct KinematicMove;
  void beginKinematic(TrackedBody& body, MotionHistory& history, double dt);
  static void advance(MotionHistory& history, const KinematicMove& move, bool arrives, double dt);
  void endBody(TrackedBody& body, MotionHistory& history, double dt);
  void endLink(const btMultiBodyLinkCollider& link, SubstepMotion& motion, MotionHistory& history,
               double dt);
  void findPushedMultibodies(const btCollisionWorld& world);

  struct ShapeSize {
    const btCollisionShape* shape = nullptr;
    double radius = 0.0;         // m, as TrackedBody::radius
    double margin = 0.0;         // m, as TrackedBody::margin
    std::uint64_t revision = 0;  // as ShapeTrace::revision
  };

  std::vector<TrackedBody> bodies_;
  std::vector<MotionHistory> histories_;  // parallel to bodies_
  std::unordered_map<BodyId, std::size_t> indexOf_;
  BodyId nextId_ = 0;
  bool hasOtherShapes_ = false;
  bool hasPlanes_ = false;
  bool hasContinuous_ = false;
  bool hasSoft_ = false;
  double restSpeed_ = 0.0;
  double dt_ = 0.0;  // s, of the current substep
  // The sizes of some shapes that were read in the current substep, as many bodies share a shape.
  // The place of each follows from the shape's address.
  std::array<ShapeSize, 64> sizes_;
  bool relativeMargin_ = true;  // Bullet takes the contact margin from the shape's size
  bool hasLinks_ = false;
  std::vector<const btMultiBody*> pushed_;  // in this substep; kept for its memory
};

}  // namespace carom::bullet
