#include "bullet_bridge/bodies/body_tracker.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <numbers>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include <BulletCollision/CollisionShapes/btConvexPointCloudShape.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>

#include "bullet_bridge/bodies/multibody_link.h"
#include "bullet_bridge/bodies/object_identity.h"

namespace carom::bullet {
namespace {

// True if Bullet's solver applied an impulse in this substep; points that it skipped hold stale
// numbers.
bool isSolved(const btPersistentManifold& manifold) {
  for (int i = 0; i < manifold.getNumContacts(); ++i) {
    const btManifoldPoint& point = manifold.getContactPoint(i);
    const bool solved = point.getDistance() <= manifold.getContactProcessingThreshold();
    if (solved && point.getAppliedImpulse() > 0) return true;
  }
  return false;
}

// `isInPlace`: the object is where the body was in the world's array.
bool isSame(const TrackedBody& body, const btCollisionObject& object, bool isInPlace = false) {
  return body.object == &object && isSameObject(body.identity, identityOf(object), isInPlace);
}

Vec3 positionOf(const btCollisionObject& object) {
  return toVec3(object.getWorldTransform().getOrigin());
}

// Gap (m) up to which Bullet holds a contact (btCollisionShape::getContactBreakingThreshold); the
// narrowphase reports none beyond.
double contactMargin(const btCollisionShape& shape) {
  return static_cast<double>(shape.getContactBreakingThreshold(gContactBreakingThreshold));
}

bool usesRelativeMargin(const btCollisionWorld& world) {
  const auto* dispatcher = dynamic_cast<const btCollisionDispatcher*>(world.getDispatcher());
  return dispatcher != nullptr &&
         (dispatcher->getDispatcherFlags() &
          btCollisionDispatcher::CD_USE_RELATIVE_CONTACT_BREAKING_THRESHOLD) != 0;
}

void readPlane(TrackedBody& body) {
  const auto& plane = static_cast<const btStaticPlaneShape&>(*body.object->getCollisionShape());
  const btTransform& pose = body.object->getWorldTransform();
  body.planeNormal = toVec3(pose.getBasis() * plane.getPlaneNormal()).normalized();
  body.planeOffset = static_cast<double>(plane.getPlaneConstant()) +
                     body.planeNormal.dot(toVec3(pose.getOrigin()));
}

// Radius (m) of a ball around a shape's centre that holds it.
double radiusAround(const btCollisionShape& shape) {
  btVector3 centre(0, 0, 0);
  btScalar radius = 0;
  shape.getBoundingSphere(centre, radius);
  return static_cast<double>(radius) + toVec3(centre).norm();
}

// FNV-1a, by words. Signs are the highest bits, which a product does not carry down.
std::uint64_t mixed(std::uint64_t hash, std::uint64_t word) {
  hash = (hash ^ word) * 1099511628211U;
  return hash ^ (hash >> 32U);
}

std::uint64_t mixed(std::uint64_t hash, const btVector3& vector) {
  for (int axis = 0; axis < 3; ++axis)
    hash = mixed(hash, std::bit_cast<std::uint64_t>(static_cast<double>(vector[axis])));
  return hash;
}

// s, after which a kinematic body that has a velocity, but stays where it is, is a belt: its
// surface moves, as Bullet takes it to.
constexpr double kBelt = 0.1;

// Children of a compound that are looked at in each substep. Of more, the first ones count, and
// what Bullet itself has been told of the others.
constexpr int kMostChildren = 256;

// A number that another shape at the same address, or another state of the shape, will not have.
std::uint64_t revisionOf(const btCollisionShape& shape) {
  if (shape.getShapeType() == CONVEX_HULL_SHAPE_PROXYTYPE) {
    const auto& hull = static_cast<const btConvexHullShape&>(shape);
    const std::size_t address = std::hash<const btVector3*>()(hull.getUnscaledPoints());
    return mixed(address, static_cast<std::uint64_t>(hull.getNumPoints()));
  }
  if (shape.getShapeType() == CONVEX_POINT_CLOUD_SHAPE_PROXYTYPE) {
    const auto& cloud = static_cast<const btConvexPointCloudShape&>(shape);
    const std::size_t address = std::hash<const btVector3*>()(cloud.getUnscaledPoints());
    return mixed(address, static_cast<std::uint64_t>(cloud.getNumPoints()));
  }
  if (shape.getShapeType() != COMPOUND_SHAPE_PROXYTYPE) return 0;
  const auto& compound = static_cast<const btCompoundShape&>(shape);
  const int children = compound.getNumChildShapes();
  auto hash = mixed(static_cast<std::uint64_t>(compound.getUpdateRevision()),
                    static_cast<std::uint64_t>(children));
  for (int child = 0; child < std::min(children, kMostChildren); ++child) {
    const btCollisionShape* const part = compound.getChildShape(child);
    const btTransform& place = compound.getChildTransform(child);
    hash = mixed(hash, std::hash<const btCollisionShape*>()(part));
    hash = mixed(hash, place.getOrigin());
    for (int row = 0; row < 2; ++row)  // which decide the third
      hash = mixed(hash, place.getBasis()[row]);
    hash = mixed(hash, part->getLocalScaling());
    hash = mixed(hash, revisionOf(*part));
  }
  return hash;
}

bool touchesNothing(const btCollisionObject& object) {
  return !object.hasContactResponse() ||
         (object.getInternalType() &
          (btCollisionObject::CO_RIGID_BODY | btCollisionObject::CO_FEATHERSTONE_LINK |
           btCollisionObject::CO_COLLISION_OBJECT | btCollisionObject::CO_GHOST_OBJECT)) == 0;
}

BodyKind kindOf(const btCollisionObject& object) {
  if (object.isKinematicObject()) return BodyKind::kinematic;
  if (btMultiBodyLinkCollider::upcast(&object) != nullptr) return BodyKind::link;
  const bool moves = btRigidBody::upcast(&object) != nullptr && !object.isStaticObject();
  return moves ? BodyKind::rigid : BodyKind::fixed;
}

// Upper bound of how far a turn from one basis to the other takes a point at unit distance.
double turnBetween(const btMatrix3x3& from, const btMatrix3x3& to) {
  double squared = 0.0;
  for (int row = 0; row < 3; ++row)
    squared += toVec3(to[row] - from[row]).squaredNorm();
  return std::sqrt(squared);
}

// The fraction of a velocity that Bullet's damping leaves after dt (btRigidBody::applyDamping).
double damping(btScalar perSecond, double dt) {
  return perSecond == 0 ? 1.0 : std::pow(1.0 - static_cast<double>(perSecond), dt);
}

// Angular velocity (rad/s, world frame) that the solver leaves a body that touches nothing: it adds
// torque and gyroscopic terms (btSequentialImpulseConstraintSolver::convertBodies).
Vec3 freeSpin(const btRigidBody& rigid, double dt) {
  const auto step = static_cast<btScalar>(dt);
  const double kept = damping(rigid.getAngularDamping(), dt);
  Vec3 spin = kept * toVec3(rigid.getAngularVelocity());
  if (rigid.getTotalTorque().length2() > 0) {
    spin += dt * toVec3(rigid.getInvInertiaTensorWorld() * rigid.getTotalTorque());
  }
  if (rigid.getAngularVelocity().length2() == 0) return spin;
  if ((rigid.getFlags() & BT_ENABLE_GYROSCOPIC_FORCE_EXPLICIT) != 0) {
    spin -= dt * toVec3(rigid.getInvInertiaTensorWorld() *
                        rigid.computeGyroscopicForceExplicit(btScalar(1e30)));
  }
  if ((rigid.getFlags() & BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_WORLD) != 0)
    spin += toVec3(rigid.computeGyroscopicImpulseImplicit_World(step));
  if ((rigid.getFlags() & BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_BODY) != 0)
    spin += toVec3(rigid.computeGyroscopicImpulseImplicit_Body(step));
  return spin;
}

// Angular velocity (rad/s) at which Bullet really turns a body in a substep
// (btTransformUtil::integrateTransform): it clamps the angle to a quarter of pi, beyond which the
// quaternion's two parts no longer belong to the same angle.
Vec3 turnedAt(const Vec3& angularVelocity, double dt) {
  constexpr double kLimit = 0.25 * std::numbers::pi;
  const double speed = angularVelocity.norm();
  if (speed * dt <= kLimit) return angularVelocity;
  const double angle =
      2.0 * std::atan2(speed * dt / kLimit * std::sin(0.5 * kLimit), std::cos(0.5 * kLimit));
  return angularVelocity * (angle / (speed * dt));
}

// Angular velocity (rad/s, world frame) that leads from one orientation to the other within dt.
Vec3 turnRate(const Quat& from, const Quat& to, double dt) {
  const Eigen::AngleAxisd turn((to * from.conjugate()).normalized());
  const double angle = std::remainder(turn.angle(), 2.0 * std::numbers::pi);
  return angle / dt * turn.axis();
}

}  // namespace

// The way of a kinematic body to its target, and the velocities that the host has given it.
struct BodyTracker::KinematicMove {
  Vec3 shift;     // m
  Vec3 turn;      // rad, along its axis
  Vec3 velocity;  // m/s
  Vec3 angular;   // rad/s

  // Time (s) in which the velocities come nearest to the target.
  double duration() const {
    const bool shifts = velocity.squaredNorm() > 0.0;
    return shifts ? shift.dot(velocity) / velocity.squaredNorm()
                  : turn.dot(angular) / std::max(angular.squaredNorm(), 1e-300);
  }
  // True if a body of that radius (m) reaches its target then.
  bool isOnCourse(double after, double radius) const {
    const double off = (shift - after * velocity).norm() + radius * (turn - after * angular).norm();
    const double size = shift.norm() + radius * turn.norm();
    return off <= 1e-3 * size;
  }
};

Quat TrackedBody::orientationAtStart(double dt) const {
  if (shape != ContactShape::sphere) return current.orientation;
  // The orientation of a sphere is not kept: it is worked back from the present one.
  const Vec3 turn = -dt * turnedAt(current.angularAfter, dt);
  Quat now = toQuat(object->getWorldTransform());
  const double angle = turn.norm();
  if (!(angle > 0.0)) return now;
  return Quat(Eigen::AngleAxisd(-angle, -turn / angle)).normalized() * now;
}

RigidMotion TrackedBody::actual(double dt) const {
  return {current.actual(dt), orientationAtStart(dt), turnedAt(current.angularAfter, dt)};
}

RigidMotion TrackedBody::contactFree(double dt) const {
  return {current.contactFree(dt), orientationAtStart(dt), turnedAt(current.angularFree, dt)};
}

// Bodies come and go between substeps, and removal reorders the world's array.
void BodyTracker::matchWorld(const btCollisionWorld& world) {
  const auto& objects = world.getCollisionObjectArray();
  const auto count = static_cast<std::size_t>(objects.size());
  bool same = bodies_.size() == count;
  for (std::size_t i = 0; same && i < count; ++i) {
    const btCollisionObject* object = objects[static_cast<int>(i)];
    same = isSame(bodies_[i], *object, true);
    if (same) bodies_[i].identity = identityOf(*object);
  }
  if (same) return;

  std::unordered_map<const btCollisionObject*, std::size_t> known;
  for (std::size_t i = 0; i < bodies_.size(); ++i)
    known[bodies_[i].object] = i;
  std::vector<TrackedBody> matched(count);
  std::vector<MotionHistory> trails(count);
  for (std::size_t i = 0; i < count; ++i) {
    btCollisionObject* const object = objects[static_cast<int>(i)];
    const auto found = known.find(object);
    if (found != known.end() && isSame(bodies_[found->second], *object)) {
      matched[i] = bodies_[found->second];
      trails[i] = histories_[found->second];
    } else {
      matched[i].object = object;
      matched[i].identity = identify(*object);
      matched[i].id = nextId_++;
    }
  }
  bodies_ = std::move(matched);
  histories_ = std::move(trails);
  indexOf_.clear();
  for (std::size_t i = 0; i < count; ++i)
    indexOf_[bodies_[i].id] = i;
}

void BodyTracker::readShape(TrackedBody& body) {
  const btCollisionShape& shape = *body.object->getCollisionShape();
  const ShapeTrace before = body.trace;
  std::uint64_t revision = 0;
  if (touchesNothing(*body.object)) {
    body.shape = ContactShape::none;
  } else if (shape.getShapeType() == SPHERE_SHAPE_PROXYTYPE) {
    body.shape = ContactShape::sphere;
    body.radius = static_cast<double>(static_cast<const btSphereShape&>(shape).getRadius());
    // Equals contactMargin for a sphere: Bullet's motion disc is that of the box around it.
    body.margin = double{gContactBreakingThreshold} * std::numbers::sqrt3 * body.radius;
  } else if (shape.getShapeType() == STATIC_PLANE_PROXYTYPE) {
    body.shape = ContactShape::plane;
    readPlane(body);
  } else {
    body.shape = ContactShape::other;
    const ShapeSize& size = sizeOf(shape);
    body.radius = size.radius;
    body.margin = size.margin;
    revision = size.revision;
  }
  if (!relativeMargin_) body.margin = double{gContactBreakingThreshold};
  body.trace = {&shape, body.radius, static_cast<double>(shape.getMargin()), revision};
  if (body.trace == before) return;
  ++body.shapeNumber;
  const bool hasParts = body.shape == ContactShape::sphere || body.shape == ContactShape::other;
  body.parts = hasParts ? std::make_shared<const ShapeParts>(shape) : nullptr;
}

const BodyTracker::ShapeSize& BodyTracker::sizeOf(const btCollisionShape& shape) {
  ShapeSize& size = sizes_[std::hash<const btCollisionShape*>()(&shape) / 64 % sizes_.size()];
  if (size.shape != &shape)
    size = {&shape, radiusAround(shape), contactMargin(shape), revisionOf(shape)};
  return size;
}

void BodyTracker::addTurn(TrackedBody& body, MotionHistory& history, const btMatrix3x3& basis) {
  if (body.shape != ContactShape::other) return;
  body.turned += body.radius * turnBetween(history.node, basis);
  history.node = basis;
}

void BodyTracker::beginSubstep(const btCollisionWorld& world, double dt) {
  matchWorld(world);
  dt_ = dt;
  sizes_.fill({});
  relativeMargin_ = usesRelativeMargin(world);
  hasOtherShapes_ = hasPlanes_ = hasContinuous_ = hasSoft_ = hasLinks_ = false;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    TrackedBody& body = bodies_[i];
    if (!(mayRest(body) && beginResting(body, histories_[i], dt)))
      beginBody(body, histories_[i], dt);
    if (body.kind == BodyKind::kinematic) beginKinematic(body, histories_[i], dt);
    hasOtherShapes_ = hasOtherShapes_ || body.shape == ContactShape::other;
    hasPlanes_ = hasPlanes_ || body.shape == ContactShape::plane;
    hasContinuous_ = hasContinuous_ || body.continuous;
    hasSoft_ = hasSoft_ || body.object->getInternalType() == btCollisionObject::CO_SOFT_BODY;
    hasLinks_ = hasLinks_ || body.kind == BodyKind::link;
  }
}

// True for bodies that have rested for a while, or do not move on their own.
bool BodyTracker::mayRest(const TrackedBody& body) const {
  constexpr int kWhile = 3;  // substeps, in which the contacts of new bodies begin
  const bool isKnown = body.shape == ContactShape::sphere || body.shape == ContactShape::other;
  return restSpeed_ > 0.0 && isKnown && body.restingFor >= kWhile && !body.continuous;
}

// Begins the substep of a body that seems to go on resting; does nothing and returns false if it
// does not.
bool BodyTracker::beginResting(TrackedBody& body, MotionHistory& history, double dt) const {
  const btCollisionObject& object = *body.object;
  const bool isSame = kindOf(object) == body.kind && !touchesNothing(object) &&
                      object.getCollisionShape() == body.trace.shape &&
                      !(object.getCcdSquareMotionThreshold() > 0);
  if (!isSame) return false;
  SubstepMotion& motion = body.current;
  if (body.kind == BodyKind::rigid) {
    const auto& rigid = static_cast<const btRigidBody&>(object);
    const Vec3 velocity = toVec3(rigid.getLinearVelocity());
    const Vec3 angular = toVec3(rigid.getAngularVelocity());
    if (!(velocity.norm() + body.radius * angular.norm() <= restSpeed_)) return false;
    body.inverseMass = static_cast<double>(rigid.getInvMass());
    body.awake = object.isActive();
    motion.acceleration =
        body.awake ? Vec3(body.inverseMass * toVec3(rigid.getTotalForce())) : Vec3::Zero();
    motion.velocityBefore = motion.velocityAfter = velocity;
    motion.velocityFree = velocity + dt * motion.acceleration;
    motion.angularBefore = motion.angularAfter = motion.angularFree = angular;
  }
  motion.known = false;
  motion.start = positionOf(object);
  history.start = object.getWorldTransform().getBasis();
  body.isPartial = body.rests = true;
  return true;
}

void BodyTracker::complete(const TrackedBody& body) {
  if (!body.isPartial) return;
  const auto index = static_cast<std::size_t>(&body - bodies_.data());
  completeBody(bodies_[index], histories_[index], dt_);
}

void BodyTracker::completeBody(TrackedBody& body, MotionHistory& history, double dt) {
  body.isPartial = false;
  readShape(body);
  addTurn(body, history, history.start);
  SubstepMotion& motion = body.current;
  if (body.shape != ContactShape::sphere) motion.orientation = toQuat(history.start);
  history.previous = motion;
  history.previous.start -= dt * motion.velocityBefore;
  history.previous.acceleration.setZero();
  history.previous.velocityAfter = motion.velocityBefore;
  history.previous.angularAfter = motion.angularBefore;
}

void BodyTracker::beginBody(TrackedBody& body, MotionHistory& history, double dt) {
  const btCollisionObject& object = *body.object;
  body.isPartial = body.rests = false;
  history.previous = body.current;
  body.kind = kindOf(object);
  body.awake = object.isActive() && body.kind != BodyKind::fixed;
  body.continuous = object.getCcdSquareMotionThreshold() > 0;
  body.inverseMass = 0.0;
  body.arrival = 0.0;
  readShape(body);
  addTurn(body, history, object.getWorldTransform().getBasis());

  SubstepMotion& motion = body.current;
  motion.known = false;
  motion.start = positionOf(object);
  motion.velocityBefore = motion.velocityAfter = motion.velocityFree = Vec3::Zero();
  motion.acceleration = Vec3::Zero();
  motion.angularBefore = motion.angularAfter = motion.angularFree = Vec3::Zero();
  if (body.shape != ContactShape::sphere) motion.orientation = toQuat(object.getWorldTransform());
  if (body.kind == BodyKind::rigid) {
    const auto& rigid = static_cast<const btRigidBody&>(object);
    body.inverseMass = static_cast<double>(rigid.getInvMass());
    motion.velocityBefore = toVec3(rigid.getLinearVelocity());
    motion.angularBefore = toVec3(rigid.getAngularVelocity());
    motion.velocityFree = motion.velocityBefore;
    motion.angularFree = motion.angularBefore;
    if (body.awake) {
      motion.acceleration = body.inverseMass * toVec3(rigid.getTotalForce());
      motion.velocityFree =
          damping(rigid.getLinearDamping(), dt) * motion.velocityBefore + dt * motion.acceleration;
      if (body.shape == ContactShape::other) motion.angularFree = freeSpin(rigid, dt);
    }
  } else if (body.kind == BodyKind::link) {
    const LinkVelocity velocity = linkVelocity(static_cast<const btMultiBodyLinkCollider&>(object));
    motion.velocityBefore = motion.velocityFree = velocity.linear;
    motion.angularBefore = motion.angularFree = velocity.angular;
  }
}

// Follows a kinematic body: a new target that its velocity leads to is approached at that velocity;
// any other is a jump.
void BodyTracker::beginKinematic(TrackedBody& body, MotionHistory& history, double dt) {
  const auto* rigid = btRigidBody::upcast(body.object);
  SubstepMotion& motion = body.current;
  if (rigid == nullptr) return;
  const btTransform& target = body.object->getWorldTransform();
  const Vec3 velocity = toVec3(rigid->getLinearVelocity());
  const Vec3 angular = toVec3(rigid->getAngularVelocity());
  if (!history.followed) {
    history.position = motion.start;
    history.orientation = toQuat(target);
    history.followed = true;
  }
  history.fixedFor = history.target == target ? history.fixedFor + dt : 0.0;
  history.target = target;
  const KinematicMove move{motion.start - history.position,
                           turnRate(history.orientation, toQuat(target), 1.0), velocity, angular};
  const double duration = move.duration();
  if (!(duration > 0.5 * dt && move.isOnCourse(duration, body.radius))) {
    history.position = motion.start;
    history.orientation = toQuat(target);
    if (history.fixedFor < kBelt) return;
    motion.velocityBefore = motion.velocityAfter = motion.velocityFree = velocity;
    motion.angularBefore = motion.angularAfter = motion.angularFree = angular;
    return;
  }
  motion.start = history.position;
  motion.orientation = history.orientation;
  motion.velocityBefore = motion.velocityAfter = motion.velocityFree = velocity;
  motion.angularBefore = motion.angularAfter = motion.angularFree = angular;
  body.arrival = duration;
  if (body.shape == ContactShape::plane)
    body.planeOffset += (motion.start - toVec3(target.getOrigin())).dot(body.planeNormal);
  advance(history, move, duration < 1.5 * dt, dt);
}

// Moves the place of a kinematic body to where the next substep begins; `arrives` if that is its
// target.
void BodyTracker::advance(MotionHistory& history, const KinematicMove& move, bool arrives,
                          double dt) {
  history.position =
      arrives ? toVec3(history.target.getOrigin()) : Vec3(history.position + dt * move.velocity);
  if (arrives || move.angular.isZero(0.0))
    history.orientation = toQuat(history.target);
  else
    history.orientation =
        Quat(Eigen::AngleAxisd(dt * move.angular.norm(), move.angular.normalized())) *
        history.orientation;
}

void BodyTracker::endSubstep(const btCollisionWorld& world, double dt) {
  findPushedMultibodies(world);
  const auto& objects = world.getCollisionObjectArray();
  for (int i = 0; i < objects.size(); ++i) {
    const auto index = static_cast<std::size_t>(i);
    const bool inPlace = index < bodies_.size() && isSame(bodies_[index], *objects[i], true);
    // A callback may have removed bodies since the start, which reorders the world's array.
    const auto body = inPlace ? bodies_.begin() + i : std::ranges::find_if(bodies_, [&](auto& one) {
      return isSame(one, *objects[i]);
    });
    if (body == bodies_.end()) continue;
    endBody(*body, histories_[static_cast<std::size_t>(body - bodies_.begin())], dt);
  }
}

void BodyTracker::leaveOutRemoved(const btCollisionWorld& world) {
  const auto& objects = world.getCollisionObjectArray();
  std::unordered_set<const btCollisionObject*> there;
  for (int i = 0; i < objects.size(); ++i)
    there.insert(objects[i]);
  for (TrackedBody& body : bodies_) {
    const bool isThere = there.contains(body.object) && isSame(body, *body.object);
    body.current.known = body.current.known && isThere;
  }
}

// Collects the multibodies that Bullet's solver has pushed through a contact in this substep.
void BodyTracker::findPushedMultibodies(const btCollisionWorld& world) {
  pushed_.clear();
  if (!hasLinks_) return;
  auto& dispatcher = const_cast<btDispatcher&>(*world.getDispatcher());  // not const in Bullet
  for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
    const btPersistentManifold& manifold = *dispatcher.getManifoldByIndexInternal(i);
    if (!isSolved(manifold)) continue;
    for (const btCollisionObject* object : {manifold.getBody0(), manifold.getBody1()}) {
      const auto* link = btMultiBodyLinkCollider::upcast(object);
      if (link != nullptr) pushed_.push_back(link->m_multiBody);
    }
  }
}

// A link's joints take it along a curve. It is followed on the parabola through its two places
// whose acceleration is that which its joints give it when nothing pushes them. As Bullet moves
// joints at their velocity at the end, that parabola's velocity is not quite the link's at the
// nodes; `bend` is the difference.
void BodyTracker::endLink(const btMultiBodyLinkCollider& link, SubstepMotion& motion,
                          MotionHistory& history, double dt) {
  const Vec3 velocity = linkVelocity(link).linear;
  motion.velocityAfter = (positionOf(link) - motion.start) / dt;
  if (std::ranges::find(pushed_, link.m_multiBody) == pushed_.end()) {
    history.acceleration = (velocity - motion.velocityBefore) / dt;
    history.bend = motion.velocityAfter - velocity;
  }
  motion.acceleration = history.acceleration;
  motion.velocityBefore += history.bend;
  motion.velocityFree = motion.velocityBefore + dt * motion.acceleration;
}

// Sets what is known of the speed and the path of all points of a body.
void BodyTracker::setBounds(TrackedBody& body, double dt) {
  const SubstepMotion& motion = body.current;
  const double after = motion.velocityAfter.norm();
  const double spin = body.radius * motion.angularAfter.norm();
  body.fastest = std::max(motion.velocityBefore.norm() + body.radius * motion.angularBefore.norm(),
                          after + spin);
  body.turning = body.shape == ContactShape::sphere ? 0.0 : dt * spin;
}

// A body that has rested but moves now is one of all others again, in this substep already.
void BodyTracker::countRest(TrackedBody& body) const {
  const bool moves =
      body.kind == BodyKind::kinematic || body.kind == BodyKind::link || body.fastest > restSpeed_;
  body.restingFor = moves ? 0 : body.restingFor + 1;
  body.rests = body.rests && !moves;
}

void BodyTracker::endBody(TrackedBody& body, MotionHistory& history, double dt) {
  SubstepMotion& motion = body.current;
  if (body.kind == BodyKind::rigid) {
    const auto& rigid = static_cast<const btRigidBody&>(*body.object);
    motion.velocityAfter = toVec3(rigid.getLinearVelocity());
    motion.angularAfter = toVec3(rigid.getAngularVelocity());
    body.awake = body.awake || rigid.isActive();  // something may have woken it
  } else if (body.kind == BodyKind::link) {
    const auto& link = static_cast<const btMultiBodyLinkCollider&>(*body.object);
    endLink(link, motion, history, dt);
    motion.angularAfter = linkVelocity(link).angular;
    if (body.shape != ContactShape::sphere) {
      motion.angularAfter = turnRate(motion.orientation, toQuat(link.getWorldTransform()), dt);
    }
  }
  motion.known = true;
  setBounds(body, dt);
  countRest(body);
}

const TrackedBody* BodyTracker::find(const btCollisionObject& object) const {
  const auto index = static_cast<std::size_t>(object.getWorldArrayIndex());  // -1: in no world
  if (index < bodies_.size() && isSame(bodies_[index], object, true)) return &bodies_[index];
  const auto moved = std::ranges::find_if(bodies_, [&](auto& one) { return isSame(one, object); });
  return moved == bodies_.end() ? nullptr : &*moved;
}

const TrackedBody* BodyTracker::find(BodyId id, std::size_t& place) const {
  if (place < bodies_.size() && bodies_[place].id == id) return &bodies_[place];
  const auto found = indexOf_.find(id);
  if (found == indexOf_.end()) return nullptr;
  place = found->second;
  return &bodies_[place];
}

const SubstepMotion& BodyTracker::previous(const TrackedBody& body) const {
  return histories_[static_cast<std::size_t>(&body - bodies_.data())].previous;
}

}  // namespace carom::bullet
