#include "bullet_bridge/bullet_bridge.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include <btBulletDynamicsCommon.h>

#include "bullet_bridge/body_tracker.h"
#include "bullet_bridge/impact_time.h"
#include "bullet_bridge/tick_hook.h"

namespace carom {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

// A touching pair, told by its shapes: sphere-sphere, or sphere on plane with the sphere first.
struct ContactPair {
  const TrackedBody* sphere = nullptr;
  const TrackedBody* other = nullptr;
  double radius = 0.0;
  double otherRadius = 0.0;         // m; infinite for a plane
  Vec3 planeNormal = Vec3::Zero();  // world frame, planes only
  double planeOffset = 0.0;
  double restitution = 0.0;    // Bullet's, for this pair
  double solverImpulse = 0.0;  // N s, sum over the points, along the normal

  bool onPlane() const { return std::isinf(otherRadius); }
  std::uint64_t key() const {
    const auto [low, high] = std::minmax(sphere->id, other->id);
    return (static_cast<std::uint64_t>(low) << 32) | high;
  }
};

// The relative motion of a pair over one substep: of the sphere's centre, seen from the other's.
class PairMotion {
 public:
  PairMotion(const ContactPair& pair, const Motion& sphere, const Motion& other)
      : pair_(pair), sphere_(sphere), other_(other), relative_(sphere - other) {}

  double gapAt(double s) const {
    return pair_.onPlane() ? height(s) : relative_.positionAt(s).norm() - reach();
  }
  double touchTime(double horizon) const {
    if (!pair_.onPlane()) return sphereTouchTime(relative_, reach(), horizon);
    return planeTouchTime(height(0.0), relative_.velocity.dot(pair_.planeNormal),
                          relative_.acceleration.dot(pair_.planeNormal), horizon);
  }
  // From the other body towards the sphere.
  Vec3 normalAt(double s) const {
    return pair_.onPlane() ? pair_.planeNormal : relative_.positionAt(s).normalized();
  }
  double approachSpeedAt(double s) const { return -relative_.velocityAt(s).dot(normalAt(s)); }

  const Motion& sphere() const { return sphere_; }
  const Motion& other() const { return other_; }

 private:
  double reach() const { return pair_.radius + pair_.otherRadius; }
  double height(double s) const {
    return sphere_.positionAt(s).dot(pair_.planeNormal) - pair_.planeOffset - pair_.radius;
  }

  const ContactPair& pair_;
  Motion sphere_, other_, relative_;
};

// The pair as it stands at the start of the substep, with the velocity of that node before or after
// the solver. Velocities at the nodes are free of the g dt/2 by which a resting body bobs between.
PairMotion nodeMotion(const ContactPair& pair, Vec3 SubstepMotion::*velocity) {
  const SubstepMotion& sphere = pair.sphere->current;
  const SubstepMotion& other = pair.other->current;
  return {pair,
          {sphere.start, sphere.*velocity, Vec3::Zero()},
          {other.start, other.*velocity, Vec3::Zero()}};
}

// When a pair touches, on one of its ways.
struct Touch {
  double start = 0.0;      // s, simulation clock, where the way begins
  double offset = 0.0;     // s, after that
  double nodeSpeed = 0.0;  // m/s, approach at the node where Bullet solves: what it goes by
};

const btSphereShape* asSphere(const btCollisionObject& object) {
  const btCollisionShape* shape = object.getCollisionShape();
  return shape->getShapeType() == SPHERE_SHAPE_PROXYTYPE ? static_cast<const btSphereShape*>(shape)
                                                         : nullptr;
}

const btStaticPlaneShape* asPlane(const btCollisionObject& object) {
  const btCollisionShape* shape = object.getCollisionShape();
  return shape->getShapeType() == STATIC_PLANE_PROXYTYPE
             ? static_cast<const btStaticPlaneShape*>(shape)
             : nullptr;
}

void placePlane(const btStaticPlaneShape& shape, const btTransform& pose, ContactPair& pair) {
  pair.planeNormal = toVec3(pose.getBasis() * shape.getPlaneNormal()).normalized();
  pair.planeOffset = static_cast<double>(shape.getPlaneConstant()) +
                     pair.planeNormal.dot(toVec3(pose.getOrigin()));
  pair.otherRadius = kNever;
}

// Restitution and impulse of the points that the solver looked at. A pair that has none yet bounces
// as Bullet will set up its points.
void readPoints(const btPersistentManifold& manifold, ContactPair& pair) {
  if (manifold.getNumContacts() == 0) {
    pair.restitution = static_cast<double>(
        btManifoldResult::calculateCombinedRestitution(pair.sphere->object, pair.other->object));
  }
  for (int i = 0; i < manifold.getNumContacts(); ++i) {
    const btManifoldPoint& point = manifold.getContactPoint(i);
    pair.restitution = std::max(pair.restitution, static_cast<double>(point.m_combinedRestitution));
    if (point.getDistance() > manifold.getContactProcessingThreshold()) continue;
    pair.solverImpulse += static_cast<double>(point.getAppliedImpulse());
  }
}

ImpulseEvent sphereShare(const ContactPair& pair, const PairMotion& motion, double offset) {
  ImpulseEvent event;
  event.body = pair.sphere->id;
  event.other = pair.other->id;
  event.normal = motion.normalAt(offset);
  event.bodyPosition = motion.sphere().positionAt(offset);
  event.bodyVelocity = motion.sphere().velocityAt(offset);
  event.position = event.bodyPosition - pair.radius * event.normal;
  event.approachSpeed = motion.approachSpeedAt(offset);
  event.effectiveMass = 1.0 / (pair.sphere->inverseMass + pair.other->inverseMass);
  event.radius = pair.radius;
  event.otherRadius = pair.otherRadius;
  return event;
}

ImpulseEvent otherShare(const ImpulseEvent& sphere, const PairMotion& motion, double offset) {
  ImpulseEvent other = sphere;
  std::swap(other.body, other.other);
  std::swap(other.radius, other.otherRadius);
  other.normal = -sphere.normal;
  other.impulse = -sphere.impulse;
  other.bodyPosition = motion.other().positionAt(offset);
  other.bodyVelocity = motion.other().velocityAt(offset);
  return other;
}

}  // namespace

class BulletBridge::Impl : public TickHook {
 public:
  Impl(btDynamicsWorld& world, const BulletBridgeSettings& settings)
      : TickHook(world), settings_(settings) {
    tracker_.beginSubstep(world);  // ids are known, and in the world's order, from now on
    tracker_.forgetMotion();
  }

  std::vector<ImpulseEvent> events;
  BulletBridgeCounters counters;

  double time() const { return time_; }
  const BodyTracker& tracker() const { return tracker_; }

 private:
  void onStepStart(double) override { tracker_.beginSubstep(world()); }
  void onStepEnd(double dt) override;

  void readManifold(const btPersistentManifold& manifold, double dt);
  std::optional<ContactPair> contactPair(const btPersistentManifold& manifold);
  void resolve(const ContactPair& pair, double dt);
  bool reportWithin(const ContactPair& pair, const PairMotion& now, double dt);
  bool reportPrevented(const ContactPair& pair, double dt);
  bool reportBehind(const ContactPair& pair, double dt);
  void report(const ContactPair& pair, const PairMotion& motion, const Touch& touch);

  BulletBridgeSettings settings_;
  BodyTracker tracker_;
  double time_ = 0.0;        // s, at the start of the substep under way
  double previousDt_ = 0.0;  // s
  // Pairs whose impact was reported and which the solver had not turned around by the substep
  // given: an impact that Bullet spreads over several substeps is still one.
  std::unordered_map<std::uint64_t, std::uint64_t> open_;
};

void BulletBridge::Impl::onStepEnd(double dt) {
  ++counters.substeps;
  counters.substepsWithoutStart = static_cast<std::uint64_t>(startsMissed());
  tracker_.endSubstep(world());
  const std::size_t first = events.size();
  const btDispatcher& dispatcher = *world().getDispatcher();
  for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
    const btPersistentManifold& manifold =
        *const_cast<btDispatcher&>(dispatcher).getManifoldByIndexInternal(i);
    readManifold(manifold, dt);
  }
  std::stable_sort(events.begin() + static_cast<std::ptrdiff_t>(first), events.end(),
                   [](const ImpulseEvent& a, const ImpulseEvent& b) { return a.time < b.time; });
  time_ += dt;
  previousDt_ = dt;
}

std::optional<ContactPair> BulletBridge::Impl::contactPair(const btPersistentManifold& manifold) {
  const TrackedBody* body0 = tracker_.find(manifold.getBody0());
  const TrackedBody* body1 = tracker_.find(manifold.getBody1());
  if (body0 == nullptr || body1 == nullptr || !body0->current.known || !body1->current.known) {
    return std::nullopt;
  }
  if (!body0->object->hasContactResponse() || !body1->object->hasContactResponse()) {
    return std::nullopt;
  }
  if (asSphere(*body0->object) == nullptr) std::swap(body0, body1);
  const btSphereShape* sphere = asSphere(*body0->object);
  ContactPair pair;
  pair.sphere = body0;
  pair.other = body1;
  if (sphere == nullptr) {
    if (manifold.getNumContacts() > 0) ++counters.unsupported;
    return std::nullopt;
  }
  pair.radius = static_cast<double>(sphere->getRadius());
  if (const btSphereShape* otherSphere = asSphere(*body1->object)) {
    pair.otherRadius = static_cast<double>(otherSphere->getRadius());
  } else if (const btStaticPlaneShape* plane = asPlane(*body1->object)) {
    placePlane(*plane, body1->object->getWorldTransform(), pair);
  } else {
    if (manifold.getNumContacts() > 0) ++counters.unsupported;
    return std::nullopt;
  }
  return pair;
}

void BulletBridge::Impl::readManifold(const btPersistentManifold& manifold, double dt) {
  std::optional<ContactPair> pair = contactPair(manifold);
  if (!pair || pair->sphere->inverseMass + pair->other->inverseMass == 0.0) return;
  readPoints(manifold, *pair);
  resolve(*pair, dt);
}

void BulletBridge::Impl::resolve(const ContactPair& pair, double dt) {
  const bool approaching =
      nodeMotion(pair, &SubstepMotion::velocityAfter).approachSpeedAt(0.0) > settings_.restSpeed;
  const auto open = open_.find(pair.key());
  if (open != open_.end()) {
    const bool current = open->second + 1 == counters.substeps;
    if (current && approaching) open->second = counters.substeps;
    if (!current || !approaching) open_.erase(open);
    if (current) return;
  }
  const PairMotion now(pair, pair.sphere->current.actual(dt), pair.other->current.actual(dt));
  const bool reported = now.gapAt(0.0) > 0.0
                            ? reportPrevented(pair, dt) || reportWithin(pair, now, dt)
                            : reportBehind(pair, dt);
  if (reported && approaching) open_[pair.key()] = counters.substeps;
}

// On the way that the bodies went.
bool BulletBridge::Impl::reportWithin(const ContactPair& pair, const PairMotion& now, double dt) {
  const double time = now.touchTime(dt);
  if (time == kNever) return false;
  const Vec3 velocity = pair.sphere->current.velocityAfter - pair.other->current.velocityAfter;
  const double nodeSpeed = -velocity.dot(now.normalAt(time));
  if (nodeSpeed <= settings_.restSpeed) return false;
  report(pair, now, {time_, time, nodeSpeed});
  return true;
}

// Bullet's solver acted on a gap, so that the bodies do not touch, or too slowly: without it they
// would have, on the way that they were on.
bool BulletBridge::Impl::reportPrevented(const ContactPair& pair, double dt) {
  if (!(pair.solverImpulse > 0.0)) return false;
  const double nodeSpeed = nodeMotion(pair, &SubstepMotion::velocityBefore).approachSpeedAt(0.0);
  if (nodeSpeed <= settings_.restSpeed) return false;
  const PairMotion free(pair, pair.sphere->current.unhindered(dt),
                        pair.other->current.unhindered(dt));
  const double time = free.touchTime(2.0 * free.gapAt(0.0) / nodeSpeed);
  if (time == kNever) return false;
  ++counters.ahead;
  report(pair, free, {time_, time, nodeSpeed});
  return true;
}

// Overlapping at the start, though no touch was seen: Bullet had no manifold for the pair in the
// substep before; or the host, or rounding, has only now brought the two together.
bool BulletBridge::Impl::reportBehind(const ContactPair& pair, double dt) {
  const double nodeSpeed = nodeMotion(pair, &SubstepMotion::velocityBefore).approachSpeedAt(0.0);
  if (nodeSpeed <= settings_.restSpeed) return false;
  if (pair.sphere->previous.known && pair.other->previous.known) {
    const PairMotion before(pair, pair.sphere->previous.actual(previousDt_),
                            pair.other->previous.actual(previousDt_));
    const double time = before.gapAt(0.0) > 0.0 ? before.touchTime(previousDt_) : kNever;
    if (time < kNever) {
      report(pair, before, {time_ - previousDt_, time, nodeSpeed});
      return true;
    }
  }
  const PairMotion free(pair, pair.sphere->current.unhindered(dt),
                        pair.other->current.unhindered(dt));
  report(pair, free, {time_, 0.0, nodeSpeed});
  return true;
}

void BulletBridge::Impl::report(const ContactPair& pair, const PairMotion& motion,
                                const Touch& touch) {
  // Bullet does not bounce below its threshold.
  const double threshold =
      static_cast<double>(world().getSolverInfo().m_restitutionVelocityThreshold);
  const double restitution = touch.nodeSpeed < threshold ? 0.0 : pair.restitution;
  ImpulseEvent event = sphereShare(pair, motion, touch.offset);
  event.time = touch.start + touch.offset;
  event.impulse = (1.0 + restitution) * event.effectiveMass * event.approachSpeed * event.normal;
  events.push_back(event);
  events.push_back(otherShare(event, motion, touch.offset));
  ++counters.collisions;
}

Result<BulletBridge> BulletBridge::attach(btDynamicsWorld& world,
                                          const BulletBridgeSettings& settings) {
  if (!(settings.restSpeed >= 0.0) || !std::isfinite(settings.restSpeed)) {
    return Error{"BulletBridge: rest speed is " + std::to_string(settings.restSpeed) +
                 "; expected a finite number of m/s, not negative"};
  }
  if (TickHook::isHooked(world)) {
    return Error{
        "BulletBridge: this world has a bridge already; expected one per world, "
        "or the first one destroyed before"};
  }
  return BulletBridge(std::make_unique<Impl>(world, settings));
}

BulletBridge::BulletBridge(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
BulletBridge::BulletBridge(BulletBridge&&) noexcept = default;
BulletBridge& BulletBridge::operator=(BulletBridge&&) noexcept = default;
BulletBridge::~BulletBridge() = default;

std::span<const ImpulseEvent> BulletBridge::events() const {
  return impl_->events;
}
void BulletBridge::clearEvents() {
  impl_->events.clear();
}
double BulletBridge::time() const {
  return impl_->time();
}
const BulletBridgeCounters& BulletBridge::counters() const {
  return impl_->counters;
}

Result<BodyId> BulletBridge::bodyId(const btCollisionObject& object) const {
  if (const TrackedBody* body = impl_->tracker().find(&object)) return body->id;
  return Error{
      "BulletBridge: this object has not been in the world for a substep; expected one "
      "that was there at attach or has been stepped since"};
}

}  // namespace carom
