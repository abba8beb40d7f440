#include "bullet_bridge/bullet_bridge.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_set>
#include <utility>
#include <vector>

#include <btBulletDynamicsCommon.h>

#include "bullet_bridge/body_tracker.h"
#include "bullet_bridge/impact_time.h"
#include "bullet_bridge/near_spheres.h"
#include "bullet_bridge/tick_hook.h"

namespace carom {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

// Two spheres, or a sphere and a plane.
struct ContactPair {
  const TrackedBody* sphere = nullptr;
  const TrackedBody* other = nullptr;

  bool onPlane() const { return other->shape == ContactShape::plane; }
  double otherRadius() const { return onPlane() ? kNever : other->radius; }
  std::uint64_t key() const {
    const auto [low, high] = std::minmax(sphere->id, other->id);
    return (std::uint64_t{low} << 32) | high;
  }
};

// What Bullet's manifolds say about a pair.
struct SolvedContact {
  double restitution = 0.0;
  double impulse = 0.0;  // N s, sum over the points that the solver looked at, along the normal
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
    return planeTouchTime(height(0.0), relative_.velocity.dot(pair_.other->planeNormal),
                          relative_.acceleration.dot(pair_.other->planeNormal), horizon);
  }
  // From the other body towards the sphere.
  Vec3 normalAt(double s) const {
    return pair_.onPlane() ? pair_.other->planeNormal : relative_.positionAt(s).normalized();
  }
  double approachSpeedAt(double s) const { return -relative_.velocityAt(s).dot(normalAt(s)); }

  const Motion& sphere() const { return sphere_; }
  const Motion& other() const { return other_; }

 private:
  double reach() const { return pair_.sphere->radius + pair_.other->radius; }
  double height(double s) const {
    return sphere_.positionAt(s).dot(pair_.other->planeNormal) - pair_.other->planeOffset -
           pair_.sphere->radius;
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

// Whether a sphere may touch a plane in the substep, or be acted on by Bullet's solver, which it is
// where approach and rebound together would close the gap in one substep.
bool mayMeetPlane(const TrackedBody& sphere, const TrackedBody& plane, double dt) {
  const SubstepMotion& motion = sphere.current;
  const double height = motion.start.dot(plane.planeNormal) - plane.planeOffset - sphere.radius;
  const double falls = std::max(-motion.velocityBefore.dot(plane.planeNormal), 0.0) +
                       std::max(-motion.velocityAfter.dot(plane.planeNormal), 0.0) +
                       dt * std::abs(motion.acceleration.dot(plane.planeNormal));
  return height <= 2.0 * dt * falls;
}

btBroadphaseProxy* proxyOf(const btCollisionObject& object) {
  return const_cast<btBroadphaseProxy*>(object.getBroadphaseHandle());  // Bullet asks for it so
}

const btCollisionObject& objectOf(const btBroadphaseProxy& proxy) {
  return *static_cast<const btCollisionObject*>(proxy.m_clientObject);
}

// When a pair touches, on one of its ways.
struct Touch {
  double offset = 0.0;     // s, after the start of the substep
  double nodeSpeed = 0.0;  // m/s, approach at the node where Bullet solves: what it goes by
};

ImpulseEvent sphereShare(const ContactPair& pair, const PairMotion& motion, double offset) {
  ImpulseEvent event;
  event.body = pair.sphere->id;
  event.other = pair.other->id;
  event.normal = motion.normalAt(offset);
  event.bodyPosition = motion.sphere().positionAt(offset);
  event.bodyVelocity = motion.sphere().velocityAt(offset);
  event.position = event.bodyPosition - pair.sphere->radius * event.normal;
  event.approachSpeed = motion.approachSpeedAt(offset);
  event.effectiveMass = 1.0 / (pair.sphere->inverseMass + pair.other->inverseMass);
  event.radius = pair.sphere->radius;
  event.otherRadius = pair.otherRadius();
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
  }

  std::vector<ImpulseEvent> events;
  BulletBridgeCounters counters;

  double time() const { return time_; }
  const BodyTracker& tracker() const { return tracker_; }

 private:
  void onStepStart(double) override { tracker_.beginSubstep(world()); }
  void onStepEnd(double dt) override;

  void resolvePlanes(double dt);
  void countUnsupported();
  bool collides(const ContactPair& pair);
  bool readManifolds(const btBroadphasePair& entry);
  SolvedContact solvedContact(const ContactPair& pair);
  bool isOver(std::uint64_t key) const;
  bool approachesAfter(const ContactPair& pair) const;
  void resolve(const ContactPair& pair, double dt);
  bool reportWithin(const ContactPair& pair, const PairMotion& now, double dt);
  bool reportPrevented(const ContactPair& pair, double dt);
  bool reportAtNode(const ContactPair& pair, double dt);
  void report(const ContactPair& pair, const PairMotion& motion, const Touch& touch);

  BulletBridgeSettings settings_;
  BodyTracker tracker_;
  NearSpheres nearSpheres_;
  std::vector<const TrackedBody*> planes_;  // of this substep; kept for its memory
  btManifoldArray manifolds_;               // of one pair; kept for its memory
  double time_ = 0.0;                       // s, at the start of the substep under way
  // Pairs whose impact was reported and is not over: one that Bullet spreads over several substeps
  // is still one.
  std::unordered_set<std::uint64_t> open_;
  std::vector<std::uint64_t> opened_;  // in this substep
};

void BulletBridge::Impl::onStepEnd(double dt) {
  ++counters.substeps;
  counters.substepsWithoutStart = static_cast<std::uint64_t>(startsMissed());
  tracker_.endSubstep(world());
  const std::size_t first = events.size();
  const std::vector<TrackedBody>& bodies = tracker_.bodies();
  for (const auto& [sphere, other] : nearSpheres_.find(bodies, dt)) {
    resolve({&bodies[sphere], &bodies[other]}, dt);
  }
  resolvePlanes(dt);
  std::erase_if(open_, [this](std::uint64_t key) { return isOver(key); });
  open_.insert(opened_.begin(), opened_.end());
  opened_.clear();
  countUnsupported();
  std::stable_sort(events.begin() + static_cast<std::ptrdiff_t>(first), events.end(),
                   [](const ImpulseEvent& a, const ImpulseEvent& b) { return a.time < b.time; });
  time_ += dt;
}

void BulletBridge::Impl::resolvePlanes(double dt) {
  planes_.clear();
  for (const TrackedBody& body : tracker_.bodies()) {
    if (body.shape == ContactShape::plane && body.current.known) planes_.push_back(&body);
  }
  for (const TrackedBody& sphere : tracker_.bodies()) {
    if (sphere.shape != ContactShape::sphere || !sphere.current.known) continue;
    for (const TrackedBody* plane : planes_) {
      if (sphere.inverseMass + plane->inverseMass == 0.0) continue;
      if (mayMeetPlane(sphere, *plane, dt)) resolve({&sphere, plane}, dt);
    }
  }
}

// Contacts of other shapes than spheres and planes, searched only where there are any. By way of
// the broadphase: the bodies of a manifold may be gone.
void BulletBridge::Impl::countUnsupported() {
  const auto other = [](const TrackedBody& body) { return body.shape == ContactShape::other; };
  if (std::none_of(tracker_.bodies().begin(), tracker_.bodies().end(), other)) return;
  btOverlappingPairCache& near = *world().getPairCache();
  for (int i = 0; i < near.getNumOverlappingPairs(); ++i) {
    const btBroadphasePair& entry = near.getOverlappingPairArrayPtr()[i];
    const TrackedBody* body0 = tracker_.find(objectOf(*entry.m_pProxy0));
    const TrackedBody* body1 = tracker_.find(objectOf(*entry.m_pProxy1));
    if (body0 == nullptr || body1 == nullptr || !(other(*body0) || other(*body1))) continue;
    if (readManifolds(entry)) ++counters.unsupported;
  }
}

// Whether Bullet would let the two collide: groups and masks, ignored pairs, bodies without
// response.
bool BulletBridge::Impl::collides(const ContactPair& pair) {
  btDispatcher& dispatcher = *world().getDispatcher();
  const btCollisionObject& sphere = *pair.sphere->object;
  const btCollisionObject& other = *pair.other->object;
  return dispatcher.needsResponse(&sphere, &other) && dispatcher.needsCollision(&sphere, &other) &&
         world().getPairCache()->needsBroadphaseCollision(proxyOf(sphere), proxyOf(other));
}

// Into manifolds_; whether there are any points.
bool BulletBridge::Impl::readManifolds(const btBroadphasePair& entry) {
  manifolds_.resize(0);
  if (entry.m_algorithm == nullptr) return false;
  entry.m_algorithm->getAllContactManifolds(manifolds_);
  for (int i = 0; i < manifolds_.size(); ++i) {
    if (manifolds_[i]->getNumContacts() > 0) return true;
  }
  return false;
}

// A pair that has no points yet will bounce as Bullet sets them up.
SolvedContact BulletBridge::Impl::solvedContact(const ContactPair& pair) {
  SolvedContact contact;
  const btBroadphasePair* entry =
      world().getPairCache()->findPair(proxyOf(*pair.sphere->object), proxyOf(*pair.other->object));
  if (entry == nullptr || !readManifolds(*entry)) {
    contact.restitution = static_cast<double>(
        btManifoldResult::calculateCombinedRestitution(pair.sphere->object, pair.other->object));
    return contact;
  }
  for (int m = 0; m < manifolds_.size(); ++m) {
    const btPersistentManifold& manifold = *manifolds_[m];
    for (int i = 0; i < manifold.getNumContacts(); ++i) {
      const btManifoldPoint& point = manifold.getContactPoint(i);
      contact.restitution =
          std::max(contact.restitution, static_cast<double>(point.m_combinedRestitution));
      if (point.getDistance() > manifold.getContactProcessingThreshold()) continue;
      contact.impulse += static_cast<double>(point.getAppliedImpulse());
    }
  }
  return contact;
}

// An impact is over when the pair does not approach any longer, or is apart: it tunnelled, or the
// host moved it.
bool BulletBridge::Impl::isOver(std::uint64_t key) const {
  const TrackedBody* sphere = tracker_.find(static_cast<BodyId>(key >> 32));
  const TrackedBody* other = tracker_.find(static_cast<BodyId>(key & 0xFFFFFFFF));
  if (sphere == nullptr || other == nullptr) return true;
  if (sphere->shape != ContactShape::sphere) std::swap(sphere, other);
  const ContactPair pair{sphere, other};
  const PairMotion after = nodeMotion(pair, &SubstepMotion::velocityAfter);
  return after.gapAt(0.0) > sphere->radius || !approachesAfter(pair);
}

bool BulletBridge::Impl::approachesAfter(const ContactPair& pair) const {
  const PairMotion after = nodeMotion(pair, &SubstepMotion::velocityAfter);
  return after.approachSpeedAt(0.0) > settings_.restSpeed;
}

void BulletBridge::Impl::resolve(const ContactPair& pair, double dt) {
  if (open_.contains(pair.key())) return;
  const PairMotion now(pair, pair.sphere->current.actual(dt), pair.other->current.actual(dt));
  const bool reported = now.gapAt(0.0) > 0.0
                            ? reportPrevented(pair, dt) || reportWithin(pair, now, dt)
                            : reportAtNode(pair, dt);
  if (reported && approachesAfter(pair)) opened_.push_back(pair.key());
}

// On the way that the bodies went.
bool BulletBridge::Impl::reportWithin(const ContactPair& pair, const PairMotion& now, double dt) {
  const double time = now.touchTime(dt);
  if (time == kNever) return false;
  const Vec3 velocity = pair.sphere->current.velocityAfter - pair.other->current.velocityAfter;
  const double nodeSpeed = -velocity.dot(now.normalAt(time));
  if (nodeSpeed <= settings_.restSpeed || !collides(pair)) return false;
  report(pair, now, {time, nodeSpeed});
  return true;
}

// Bullet's solver acted on a gap, so that the bodies do not touch, or too slowly: without it they
// would have, on the way that they were on.
bool BulletBridge::Impl::reportPrevented(const ContactPair& pair, double dt) {
  const double nodeSpeed = nodeMotion(pair, &SubstepMotion::velocityBefore).approachSpeedAt(0.0);
  if (nodeSpeed <= settings_.restSpeed || !(solvedContact(pair).impulse > 0.0)) return false;
  const PairMotion free(pair, pair.sphere->current.unhindered(dt),
                        pair.other->current.unhindered(dt));
  const double time = free.touchTime(2.0 * free.gapAt(0.0) / nodeSpeed);
  if (time == kNever) return false;
  ++counters.ahead;
  report(pair, free, {time, nodeSpeed});
  return true;
}

// Overlapping at the start without having touched: the host, or rounding, has brought the two
// together.
bool BulletBridge::Impl::reportAtNode(const ContactPair& pair, double dt) {
  const double nodeSpeed = nodeMotion(pair, &SubstepMotion::velocityBefore).approachSpeedAt(0.0);
  if (nodeSpeed <= settings_.restSpeed || !collides(pair)) return false;
  const PairMotion free(pair, pair.sphere->current.unhindered(dt),
                        pair.other->current.unhindered(dt));
  report(pair, free, {0.0, nodeSpeed});
  return true;
}

void BulletBridge::Impl::report(const ContactPair& pair, const PairMotion& motion,
                                const Touch& touch) {
  // Bullet does not bounce below its threshold.
  const double threshold =
      static_cast<double>(world().getSolverInfo().m_restitutionVelocityThreshold);
  const double restitution = touch.nodeSpeed < threshold ? 0.0 : solvedContact(pair).restitution;
  ImpulseEvent event = sphereShare(pair, motion, touch.offset);
  event.time = time_ + touch.offset;
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
  if (const TrackedBody* body = impl_->tracker().find(object)) return body->id;
  return Error{
      "BulletBridge: this object has not been in the world for a substep; expected one "
      "that was there at attach or has been stepped since"};
}

}  // namespace carom
