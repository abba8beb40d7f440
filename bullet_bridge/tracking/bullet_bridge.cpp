#include "carom/bullet/bullet_bridge.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <btBulletDynamicsCommon.h>

#include "bullet_bridge/tracking/blow.h"
#include "bullet_bridge/tracking/body_tracker.h"
#include "bullet_bridge/tracking/impact_finder.h"
#include "bullet_bridge/tracking/lasting_contact.h"
#include "bullet_bridge/tracking/near_boxes.h"
#include "bullet_bridge/tracking/pair_records.h"
#include "bullet_bridge/tracking/solved_contact.h"
#include "bullet_bridge/tracking/swept_bounds.h"
#include "bullet_bridge/tracking/tick_hook.h"

namespace carom {

using namespace bullet;

namespace {

// Substeps without load after which a lasting contact has ended.
constexpr int kIdleSubsteps = 3;
// Substeps in which Bullet may act on an impact that no longer approaches.
constexpr int kSolvedSubsteps = 2;
// Longest time that an event waits for the end of its impact: in s and in substeps, whichever is
// longer.
constexpr double kLongestWait = 0.02;
constexpr double kLongestWaitSubsteps = 3.0;
// Distance, relative to the sum of the radii, within which Bullet may have solved two spheres as
// touching, because of its rounding.
constexpr double kTouching = 1.0 + 1e-5;
// Time (s) within which landing corners of a body count as one impact: about the duration of a hard
// contact.
constexpr double kOneBlow = 2e-4;
// Fraction of the speed that restitution demands after an impact; a slower bounce counts as
// swallowed.
constexpr double kSwallowed = 0.5;
// Least speed of an impact during a lasting contact of shapes other than spheres and planes,
// relative to what acceleration adds in a substep: held at several points, such a contact rocks at
// that speed.
constexpr double kRocking = 2.0;
// Two impacts of a pair are separate if the cosine of the angle between their normals is below
// this.
constexpr double kOtherSide = 0.5;
constexpr double kAnyGap = std::numeric_limits<double>::infinity();

// Upper bound (m) of the travel of a body within which Bullet's solver may act: it acts where
// approach and rebound together would close the gap in one substep.
double reachOf(const SubstepMotion& motion, double dt) {
  return 2.0 * dt *
         (motion.velocityBefore.norm() + motion.velocityAfter.norm() +
          dt * motion.acceleration.norm());
}

// True if a body may touch a plane in the substep, or be acted on by Bullet's solver above it.
bool mayMeetPlane(const TrackedBody& body, const TrackedBody& plane, double dt) {
  if (plane.kind == BodyKind::kinematic) return true;  // Bullet may have put it ahead of its path
  const SubstepMotion& motion = body.current;
  const double height = motion.start.dot(plane.planeNormal) - plane.planeOffset - body.radius;
  const Vec3& moves = plane.current.velocityBefore;
  const double spin =
      body.shape == ContactShape::sphere
          ? 0.0
          : body.radius * (motion.angularBefore.norm() + motion.angularAfter.norm());
  const double falls = std::max(-(motion.velocityBefore - moves).dot(plane.planeNormal), 0.0) +
                       std::max(-(motion.velocityAfter - moves).dot(plane.planeNormal), 0.0) +
                       dt * std::abs(motion.acceleration.dot(plane.planeNormal)) + spin;
  // Bullet's friction may act on a contact that it holds even without load.
  return height <= std::max(2.0 * dt * falls, body.margin);
}

// True if Bullet may act on a body across any gap: by its continuous detection, or where it has put
// a kinematic body ahead of its path.
bool mayActAnywhere(const TrackedBody& body) {
  return body.continuous || body.kind == BodyKind::kinematic;
}

// True for two spheres that stay apart on their paths, as most near pairs do; false for all other
// pairs.
bool stayApart(const TrackedBody& body, const TrackedBody& other, double dt) {
  if (body.shape != ContactShape::sphere || other.shape != ContactShape::sphere) return false;
  if (mayActAnywhere(body) || mayActAnywhere(other)) return false;
  const SubstepMotion& motion = body.current;
  const SubstepMotion& otherMotion = other.current;
  if (motion.acceleration != otherMotion.acceleration) return false;
  const Vec3 apart = motion.start - otherMotion.start;
  const Vec3 velocity = motion.velocityAfter - otherMotion.velocityAfter;
  const double touching = kTouching * (body.radius + other.radius);
  const double outside = apart.squaredNorm() - touching * touching;
  if (!(outside > 0.0)) return false;
  const double closing = -apart.dot(velocity);
  if (closing <= 0.0) return true;
  const double nearest = std::min(dt, closing / velocity.squaredNorm());
  return (apart + nearest * velocity).squaredNorm() > touching * touching;
}

// Upper bound (m/s) of the speed at which any two points of the pair approach each other at the
// start of the substep.
double fastest(const ContactPair& pair, Vec3 SubstepMotion::*velocity,
               Vec3 SubstepMotion::*angular) {
  const SubstepMotion& body = pair.body->current;
  const SubstepMotion& other = pair.other->current;
  double speed = (body.*velocity - other.*velocity).norm();
  if (pair.isClosedForm()) return speed;
  speed += (body.*angular).norm() * pair.body->radius;
  if (pair.other->shape != ContactShape::plane) {
    const double reach = (body.start - other.start).norm() + pair.body->radius;
    speed += (other.*angular).norm() * std::min(pair.other->radius, reach);
  }
  return speed;
}

ImpulseEvent eventOf(const FoundImpact& found, const Blow& blow) {
  ImpulseEvent event;
  event.body = found.motion.pair().body->id;
  event.other = found.motion.pair().other->id;
  event.impulse = blow.impulse;
  event.position = blow.position;
  event.normal = blow.normal;
  event.approachSpeed = blow.approachSpeed;
  event.effectiveMass = blow.effectiveMass;
  event.radius = found.radius;
  event.otherRadius = found.otherRadius;
  return event;
}

void setState(ImpulseEvent& event, const RigidMotion& motion, double s) {
  event.bodyPosition = motion.centre.positionAt(s);
  event.bodyVelocity = motion.centre.velocityAt(s);
  event.bodyOrientation = motion.orientationAt(s);
  event.bodyAngularVelocity = motion.angularVelocity;
}

ImpulseEvent otherShare(const ImpulseEvent& body) {
  ImpulseEvent other = body;
  std::swap(other.body, other.other);
  std::swap(other.radius, other.otherRadius);
  other.normal = -body.normal;
  other.impulse = -body.impulse;
  return other;
}

// Returns -1 if the pair's bodies have changed roles since the record was made, as when the host
// makes one of them kinematic.
double signOf(const PairRecord& record, const PairMotion& now) {
  return record.body == now.pair().body->id ? 1.0 : -1.0;
}

// Returns the same contact seen from the other body.
ContactState mirrored(const ContactState& state) {
  ContactState other = state;
  std::swap(other.body, other.other);
  std::swap(other.bodyPosition, other.otherPosition);
  std::swap(other.bodyOrientation, other.otherOrientation);
  std::swap(other.bodyVelocity, other.otherVelocity);
  std::swap(other.pathStart, other.otherPathStart);
  std::swap(other.pathEnd, other.otherPathEnd);
  other.normal = -state.normal;
  other.appliedImpulse = -state.appliedImpulse;
  other.slipVelocity = -state.slipVelocity;
  return other;
}

}  // namespace

class BulletBridge::Impl : public TickHook {
 public:
  Impl(btDynamicsWorld& world, const BulletBridgeSettings& settings)
      : TickHook(world), settings_(settings), reader_(world) {
    tracker_.beginSubstep(world, 1.0);  // assigns the ids, in the world's order
  }

  std::vector<ImpulseEvent> events;
  std::vector<ContactState> contacts;
  BulletBridgeCounters counters;

  double time() const { return time_; }
  double settledTime();
  void flush();
  const BodyTracker& tracker() const { return tracker_; }

 private:
  void onStepStart(double dt) override { tracker_.beginSubstep(world(), dt); }
  void onStepEnd(double dt) override;

  void addToClock(double dt);
  void sortEvents(std::size_t first);
  void gatherBodies(double dt);
  void resolveNear(double dt);
  void resolvePlanes(double dt);
  void resolve(const ContactPair& pair, double dt);
  void resolveContact(const PairMotion& now, const Proximity& start, PairRecord* record);
  const FoundImpact* find(const PairMotion& now, const Proximity& start,
                          const SolvedContact* solved, const PairRecord* record);
  void followOrReopen(PairRecord& record, const PairMotion& now, const Proximity& start,
                      const SolvedContact& solved);
  bool mayCollide(const ContactPair& pair) const;
  bool hitsElsewhere(const PairRecord& record, const PairMotion& now,
                     const SolvedContact& solved) const;
  bool isRest(const FoundImpact& found) const { return found.onset <= settings_.restSpeed; }
  double impactSpeed(const ContactPair& pair, const PairRecord* record) const;
  double holdDistance(const ContactPair& pair) const;

  PairRecord& recordOf(const ContactPair& pair, PairRecord* record);
  void open(PairRecord& record, const FoundImpact& found, double restitution);
  void addLandings(Impact& impact, const FoundImpact& found);
  Landing landingOf(const FoundImpact& found, const Blow& blow, double delay) const;
  static void addApplied(PairRecord& record, const PairMotion& now, const SolvedContact& solved);
  void follow(PairRecord& record, const PairMotion& now, const SolvedContact& solved);
  void close(PairRecord& record);
  void deliver(PairRecord& record);
  void keepContact(PairRecord& record, const PairMotion& now, const Proximity& start,
                   const SolvedContact& solved);
  void endContact(PairRecord& record);
  void revisit(PairRecord& record);
  void leave(PairRecord& record);

  BulletBridgeSettings settings_;
  BodyTracker tracker_;
  std::vector<SweptBox> boxes_;
  NearBoxes nearBoxes_;
  ContactReader reader_;
  ImpactFinder finder_;
  BlowSolver blows_;
  MultibodyMass multibodies_;
  PairRecords records_;
  // A ball that holds all that a body which may meet a plane can reach in this substep.
  struct Ball {
    Vec3 centre;
    double radius = 0.0;
    const TrackedBody* body = nullptr;
  };
  std::vector<const TrackedBody*> planes_;  // of this substep, as balls_; kept for their memory
  std::vector<Ball> balls_;
  std::vector<std::pair<double, std::size_t>> order_;
  std::vector<ImpulseEvent> sorted_;
  double time_ = 0.0;      // s, at the start of the substep under way
  double timeRest_ = 0.0;  // s, what rounding has left out of time_
  double dt_ = 0.0;        // s, length of the substep under way
  double previousDt_ = 0.0;
  double previousTime_ = 0.0;
};

void BulletBridge::Impl::onStepEnd(double dt) {
  ++counters.substeps;
  counters.substepsWithoutStart = static_cast<std::uint64_t>(startsMissed());
  dt_ = dt;
  tracker_.endSubstep(world(), dt);
  reader_.beginReading(tracker_.hasContinuous());
  const std::size_t first = events.size();
  gatherBodies(dt);
  resolveNear(dt);
  resolvePlanes(dt);
  records_.forEach([this](PairRecord& record) {
    if (!record.visited) revisit(record);
  });
  records_.endSubstep();
  sortEvents(first);
  previousTime_ = time_;
  previousDt_ = dt;
  addToClock(dt);
  if (settings_.onSubstep) settings_.onSubstep();
}

// Adds with compensation (Kahan 1965, Commun. ACM 8, 40): the roundings of millions of equal steps,
// as of a host in double precision that runs for a day, are mostly to one side.
void BulletBridge::Impl::addToClock(double dt) {
  const double step = dt + timeRest_;
  const double next = time_ + step;
  timeRest_ = step - (next - time_);
  time_ = next;
}

// Sorts the events of this substep by time; those at equal times keep their order.
void BulletBridge::Impl::sortEvents(std::size_t first) {
  order_.clear();
  for (std::size_t i = first; i < events.size(); ++i)
    order_.emplace_back(events[i].time, i);
  if (std::is_sorted(order_.begin(), order_.end())) return;
  std::sort(order_.begin(), order_.end());
  sorted_.clear();
  for (const auto& [time, i] : order_)
    sorted_.push_back(events[i]);
  std::copy(sorted_.begin(), sorted_.end(), events.begin() + static_cast<std::ptrdiff_t>(first));
}

// Collects what every body may reach in this substep.
void BulletBridge::Impl::gatherBodies(double dt) {
  boxes_.clear();
  planes_.clear();
  balls_.clear();
  const std::vector<TrackedBody>& bodies = tracker_.bodies();
  const bool speculative = tracker_.hasOtherShapes() || tracker_.hasContinuous();
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const TrackedBody& body = bodies[i];
    if (!body.current.known || body.shape == ContactShape::none) continue;
    if (body.shape == ContactShape::plane) {
      planes_.push_back(&body);
      continue;
    }
    boxes_.push_back(sweptBox(body, dt, speculative));
    boxes_.back().body = static_cast<std::uint32_t>(i);
    if (tracker_.hasPlanes())
      balls_.push_back({body.current.start,
                        body.radius + std::max(body.margin, reachOf(body.current, dt)), &body});
  }
}

void BulletBridge::Impl::resolveNear(double dt) {
  const std::vector<TrackedBody>& bodies = tracker_.bodies();
  for (const auto& [first, second] : nearBoxes_.find(boxes_)) {
    if (stayApart(bodies[first], bodies[second], dt)) continue;
    resolve(ContactPair::of(bodies[first], bodies[second]), dt);
  }
}

// Planes have no box: they are tested against every body.
void BulletBridge::Impl::resolvePlanes(double dt) {
  for (const TrackedBody* plane : planes_) {
    const double reach = reachOf(plane->current, dt) + plane->planeOffset;
    const bool anywhere = plane->kind == BodyKind::kinematic;
    for (const Ball& ball : balls_) {
      if (!anywhere && ball.centre.dot(plane->planeNormal) > ball.radius + reach) continue;
      if (!ball.body->awake && !plane->awake) continue;
      if (mayMeetPlane(*ball.body, *plane, dt)) resolve({ball.body, plane}, dt);
    }
  }
}

bool BulletBridge::Impl::mayCollide(const ContactPair& pair) const {
  const auto immovable = [](const TrackedBody& body) {
    return body.kind == BodyKind::fixed || body.kind == BodyKind::kinematic;
  };
  return !(immovable(*pair.body) && immovable(*pair.other)) && reader_.collides(pair);
}

// Gap (m) above which Bullet's solver does not act.
double BulletBridge::Impl::holdDistance(const ContactPair& pair) const {
  if (mayActAnywhere(*pair.body) || mayActAnywhere(*pair.other)) return kAnyGap;
  if (pair.isOnPlane()) return pair.body->margin;
  if (!pair.isClosedForm()) return std::max(pair.body->margin, pair.other->margin);
  return (kTouching - 1.0) * (pair.body->radius + pair.other->radius);
}

double BulletBridge::Impl::impactSpeed(const ContactPair& pair, const PairRecord* record) const {
  if (pair.isClosedForm() || record == nullptr || !record->lasting) return settings_.restSpeed;
  const double acceleration =
      std::max(pair.body->current.acceleration.norm(), pair.other->current.acceleration.norm());
  return std::max(settings_.restSpeed, kRocking * acceleration * dt_);
}

void BulletBridge::Impl::resolve(const ContactPair& pair, double dt) {
  PairRecord* record = records_.find(pair.key());
  const PairMotion now(pair, Way::actual, dt, dt, finder_.pieces());
  if (!now.isFollowed()) {
    if (!reader_.read(pair).points.empty()) ++counters.unsupported;
    return;
  }
  const Proximity start = now.proximityAt(0.0);
  if (record != nullptr || start.gap <= holdDistance(pair)) {
    resolveContact(now, start, record);
    return;
  }
  if (const FoundImpact* found = find(now, start, nullptr, nullptr)) {
    PairRecord& added = recordOf(pair, nullptr);
    added.spent = isRest(*found);
    if (!added.spent) open(added, *found, combinedRestitution(pair));
  }
}

// Resolves a pair on which Bullet's solver may have acted.
void BulletBridge::Impl::resolveContact(const PairMotion& now, const Proximity& start,
                                        PairRecord* record) {
  const SolvedContact& solved = reader_.read(now.pair());
  if (record != nullptr) record->visited = true;
  if (record != nullptr && record->open) {
    followOrReopen(*record, now, start, solved);
    return;
  }
  if (record != nullptr && record->spent) {
    const double speed = approachAtNode(now.pair(), Way::actual, start.point, start.normal);
    record->spent = speed > settings_.restSpeed && start.gap <= now.pair().body->radius;
  } else if (const FoundImpact* found = find(now, start, &solved, record)) {
    PairRecord& opened = recordOf(now.pair(), record);
    opened.spent = isRest(*found);
    if (!opened.spent) open(opened, *found, solved.restitution);
    if (found->solved && opened.open) {
      follow(opened, now, solved);
      return;
    }
    record = &opened;  // the impulses up to now are from before the impact
  }
  // Bullet's friction may act where its normal impulse has come back to zero.
  if (!solved.applied.isZero(0.0) || (record != nullptr && record->lasting)) {
    keepContact(recordOf(now.pair(), record), now, start, solved);
  }
}

// An impact is under way: what Bullet has applied belongs to it, unless the pair has met again.
void BulletBridge::Impl::followOrReopen(PairRecord& record, const PairMotion& now,
                                        const Proximity& start, const SolvedContact& solved) {
  // The bodies may have grazed, or passed through each other, before Bullet could act.
  const bool passed = start.gap > 0.0 && approachAtNode(now.pair(), Way::unhindered, start.point,
                                                        start.normal) <= settings_.restSpeed;
  const bool mayMeetAgain = record.impact.parted || passed || start.gap > now.pair().body->radius ||
                            hitsElsewhere(record, now, solved);
  const FoundImpact* again = mayMeetAgain ? find(now, start, &solved, &record) : nullptr;
  const double first = record.impact.landings.front().body.time;
  if (again == nullptr || time_ + again->offset < first + kOneBlow) {
    follow(record, now, solved);
    return;
  }
  if (!again->solved) addApplied(record, now, solved);  // still belongs to the old impact
  close(record);
  open(record, *again, solved.restitution);
  if (again->solved) follow(record, now, solved);
}

// True if the pair meets from another side while an impact is under way, as a ball that lands on a
// mesh and then hits a wall of it.
bool BulletBridge::Impl::hitsElsewhere(const PairRecord& record, const PairMotion& now,
                                       const SolvedContact& solved) const {
  const Vec3 normal = signOf(record, now) * record.impact.landings.front().body.normal;
  return std::ranges::any_of(solved.points, [&](const SolvedPoint& point) {
    const double speed = approachAtNode(now.pair(), Way::unhindered, point.position, point.normal);
    return point.impulse > 0.0 && point.normal.dot(normal) < kOtherSide &&
           speed > record.impact.landings.front().body.approachSpeed;
  });
}

const FoundImpact* BulletBridge::Impl::find(const PairMotion& now, const Proximity& start,
                                            const SolvedContact* solved, const PairRecord* record) {
  const ContactPair& pair = now.pair();
  const ImpactFinder::Substep substep{dt_, impactSpeed(pair, record)};
  const double speed =
      std::max(fastest(pair, &SubstepMotion::velocityBefore, &SubstepMotion::angularBefore),
               fastest(pair, &SubstepMotion::velocityAfter, &SubstepMotion::angularAfter));
  if (speed <= substep.restSpeed) return nullptr;

  const FoundImpact* found = nullptr;
  if (start.gap > 0.0) {
    if (solved != nullptr) found = finder_.prevented(now, start, *solved, substep);
    if (found == nullptr) found = finder_.within(now, start, substep);
  } else if (pair.isClosedForm()) {
    found = finder_.overlapping(now, substep);
  } else {
    found = finder_.newPoints(
        now, *solved, substep,
        {tracker_.previous(*pair.body), tracker_.previous(*pair.other), previousDt_});
  }
  return found != nullptr && mayCollide(pair) ? found : nullptr;
}

PairRecord& BulletBridge::Impl::recordOf(const ContactPair& pair, PairRecord* record) {
  if (record != nullptr) return *record;
  PairRecord& added = records_.add(pair.key());
  added.body = pair.body->id;
  added.other = pair.other->id;
  added.visited = true;
  return added;
}

void BulletBridge::Impl::open(PairRecord& record, const FoundImpact& found, double restitution) {
  const double threshold =
      static_cast<double>(world().getSolverInfo().m_restitutionVelocityThreshold);
  const bool bounces = found.nodeSpeed >= threshold;  // below it, Bullet does not
  Impact& impact = record.impact;
  impact.applied = Vec3::Zero();
  impact.solved = 0;
  impact.parted = impact.delivered = false;
  impact.restitution = bounces ? restitution : 0.0;
  impact.foundAt = time_;
  addLandings(impact, found);
  record.open = !impact.landings.empty();
  record.spent = !record.open;  // neither body can be moved
  if (!record.open) return;

  counters.collisions += impact.landings.size();
  counters.merged += found.points.size() - impact.landings.size();
  if (found.solved && found.offset > 0.0) ++counters.ahead;
  if (!bounces && restitution > 0.0) ++counters.belowThreshold;
  if (settings_.delivery == EventDelivery::prompt) deliver(record);
}

// Points that land within kOneBlow make one event.
void BulletBridge::Impl::addLandings(Impact& impact, const FoundImpact& found) {
  const PairInertia inertia(found.motion, found.s, multibodies_);
  BlowPoint mean;
  std::span<const BlowPoint> points = found.points;
  if (inertia.hasLink() && points.size() > 1) {
    mean = BlowSolver::meanOf(points);
    points = {&mean, 1};
  }
  const std::span<const double> impulses = blows_.solve(points, inertia, impact.restitution);
  double whole = 0.0;
  impact.landings.clear();
  for (std::size_t begin = 0; begin < points.size();) {
    std::size_t end = begin;
    while (end < points.size() && points[end].delay <= points[begin].delay + kOneBlow)
      ++end;
    const std::size_t count = end - begin;
    const Blow blow = BlowSolver::sum(points.subspan(begin, count), impulses.subspan(begin, count),
                                      impact.restitution);
    if (blow.effectiveMass > 0.0) {
      // The first landing is dated at first touch, even if the corners that follow carry all of its
      // impulse.
      const double delay = impact.landings.empty() ? 0.0 : points[begin].delay;
      impact.landings.push_back(landingOf(found, blow, delay));
      whole += impact.landings.back().part;
    }
    begin = end;
  }
  for (Landing& landing : impact.landings)
    landing.part /= whole;
}

// Makes a landing whose `part` is still its impulse in N s.
Landing BulletBridge::Impl::landingOf(const FoundImpact& found, const Blow& blow,
                                      double delay) const {
  Landing landing;
  landing.part = blow.impulse.norm();
  landing.body = eventOf(found, blow);
  landing.body.time = time_ + found.offset + delay;
  landing.other = otherShare(landing.body);
  setState(landing.body, found.motion.body(), found.s + delay);
  setState(landing.other, found.motion.other(), found.s + delay);
  // The motions on which impacts are found leave out the orientation of spheres.
  const auto turn = [&](ImpulseEvent& event, const TrackedBody& body) {
    if (body.shape == ContactShape::sphere)
      event.bodyOrientation = body.actual(dt_).orientationAt(found.offset + delay);
  };
  turn(landing.body, *found.motion.pair().body);
  turn(landing.other, *found.motion.pair().other);
  return landing;
}

void BulletBridge::Impl::addApplied(PairRecord& record, const PairMotion& now,
                                    const SolvedContact& solved) {
  record.impact.applied += signOf(record, now) * solved.applied;
  if (solved.impulse > 0.0) ++record.impact.solved;
}

// An impact is over when the pair no longer approaches and is apart, or has been solved often
// enough; when it is well apart anyway, because it tunnelled or the host moved it; or after the
// longest wait.
void BulletBridge::Impl::follow(PairRecord& record, const PairMotion& now,
                                const SolvedContact& solved) {
  Impact& impact = record.impact;
  addApplied(record, now, solved);
  Proximity end = now.proximityAt(dt_);
  if (!now.pair().isClosedForm())
    end.normal = signOf(record, now) * impact.landings.front().body.normal;
  const double approach = approachWithNode(now, Way::actual, end, dt_);
  const bool approaches = approach > settings_.restSpeed;
  const double waited = time_ + dt_ - impact.foundAt;
  const bool waitedLong = waited >= std::max(kLongestWait, (kLongestWaitSubsteps - 0.5) * dt_);
  if (!approaches) {
    impact.parted = true;
    if (end.gap > 0.0 || impact.solved >= kSolvedSubsteps || waitedLong) close(record);
  } else if (end.gap > now.pair().body->radius) {
    close(record);
  } else if (waitedLong) {
    close(record);
    record.spent = true;
  }
  const double bounce = impact.restitution * impact.landings.front().body.approachSpeed;
  if (!record.open && impact.solved > 0 && -approach < kSwallowed * bounce) ++counters.swallowed;
}

void BulletBridge::Impl::close(PairRecord& record) {
  record.open = false;
  if (record.impact.solved == 0) ++counters.unseen;
  deliver(record);
}

void BulletBridge::Impl::deliver(PairRecord& record) {
  Impact& impact = record.impact;
  if (impact.delivered) return;
  impact.delivered = true;
  for (Landing& landing : impact.landings) {
    if (settings_.delivery == EventDelivery::complete) {
      landing.body.appliedImpulse = landing.part * impact.applied;
      landing.other.appliedImpulse = -landing.body.appliedImpulse;
      landing.body.hasAppliedImpulse = landing.other.hasAppliedImpulse = true;
    }
    events.push_back(landing.body);
    events.push_back(landing.other);
    ++counters.delivered;
  }
}

void BulletBridge::Impl::keepContact(PairRecord& record, const PairMotion& now,
                                     const Proximity& start, const SolvedContact& solved) {
  const bool begins = !record.lasting;
  record.lasting = true;
  record.idle = begins || solved.impulse > 0.0 ? 0 : record.idle + 1;
  record.state = lastingContact(now, start, solved, {time_, dt_});
  if (record.state.body != record.body) record.state = mirrored(record.state);
  record.state.phase = begins ? ContactPhase::begin : ContactPhase::during;
  if (begins) ++counters.contactsBegun;
  if (record.idle >= kIdleSubsteps) {
    record.lasting = false;
    record.state.phase = ContactPhase::end;
  }
  contacts.push_back(record.state);
}

void BulletBridge::Impl::endContact(PairRecord& record) {
  ContactState end = record.state;
  end.time = time_;
  end.duration = dt_;
  end.phase = ContactPhase::end;
  end.normalLoad = 0.0;
  end.appliedImpulse = end.slipVelocity = end.rollingVelocity = Vec3::Zero();
  end.pathStart = end.pathEnd;
  end.otherPathStart = end.otherPathEnd;
  contacts.push_back(end);
  record.lasting = false;
}

// Resolves a recorded pair that is not so near that it could touch in this substep; drops it if
// that is not possible.
void BulletBridge::Impl::revisit(PairRecord& record) {
  const TrackedBody* body = tracker_.find(record.body);
  const TrackedBody* other = tracker_.find(record.other);
  const bool there = body != nullptr && other != nullptr && body->current.known &&
                     other->current.known && (body->awake || other->awake);
  if (there) resolve(ContactPair::of(*body, *other), dt_);
  if (!record.visited) leave(record);
}

// Closes the impact and the contact of a pair that is asleep, gone or far apart.
void BulletBridge::Impl::leave(PairRecord& record) {
  if (record.open) close(record);
  if (record.lasting) endContact(record);
  record.spent = false;
}

double BulletBridge::Impl::settledTime() {
  // New points of a lasting contact are dated back into the substep before.
  double settled = tracker_.hasOtherShapes() ? previousTime_ : time_;
  records_.forEach([&settled](const PairRecord& record) {
    if (record.open && !record.impact.delivered)
      settled = std::min(settled, record.impact.landings.front().body.time);
  });
  return settled;
}

void BulletBridge::Impl::flush() {
  records_.forEach([this](PairRecord& record) {
    if (record.open) deliver(record);
  });
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
std::span<const ContactState> BulletBridge::contacts() const {
  return impl_->contacts;
}
void BulletBridge::clear() {
  impl_->events.clear();
  impl_->contacts.clear();
}
void BulletBridge::flush() {
  impl_->flush();
}
double BulletBridge::time() const {
  return impl_->time();
}
double BulletBridge::settledTime() const {
  return impl_->settledTime();
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
