#include "bullet_bridge/tracking/contact_classifier.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "bullet_bridge/geometry/impact_time.h"

namespace carom::bullet {
namespace {

// Least speed of an impact during a lasting contact of shapes other than spheres and planes,
// relative to what acceleration adds in a substep: held at several points, such a contact rocks at
// that speed.
constexpr double kRocking = 2.0;
// Two impacts of a pair are separate if the cosine of the angle between their normals is below
// this.
constexpr double kOtherSide = 0.5;
// Depth of a point of Bullet, relative to the smaller radius, from which on the bodies surely
// overlap.
constexpr double kOverlap = 1e-3;
// s, since the last impact of a pair, within which a host that pushes it together again holds it.
constexpr double kHeld = 0.1;

// Upper bound (m/s) of the speed at which any two points of the pair approach each other at the
// start of the substep.
double maxApproachSpeed(const ContactPair& pair, Vec3 SubstepMotion::*velocity,
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

// Upper bound (m/s) of the same before and after the solver.
double fastestApproach(const ContactPair& pair) {
  return std::max(
      maxApproachSpeed(pair, &SubstepMotion::velocityBefore, &SubstepMotion::angularBefore),
      maxApproachSpeed(pair, &SubstepMotion::velocityAfter, &SubstepMotion::angularAfter));
}

// Upper bound (m/s) of the speed along a normal of their contact, or of what it turns to within the
// substep, at which any two points of the pair approach each other at its start.
double approachAnywhere(const ContactPair& pair, const Vec3& normal, MotionKind kind, double dt) {
  const auto velocity =
      kind == MotionKind::actual ? &SubstepMotion::velocityAfter : &SubstepMotion::velocityBefore;
  const auto angular =
      kind == MotionKind::actual ? &SubstepMotion::angularAfter : &SubstepMotion::angularBefore;
  const SubstepMotion& body = pair.body->current;
  const SubstepMotion& other = pair.other->current;
  const Vec3 relative = body.*velocity - other.*velocity;
  const double turned = dt * ((body.*angular).norm() + (other.*angular).norm());
  return -relative.dot(normal) + (body.*angular).cross(normal).norm() * pair.body->radius +
         (other.*angular).cross(normal).norm() * pair.other->radius + turned * relative.norm();
}

// False for pairs that may be of those which cannot be followed at all.
bool isSurelyFollowed(const ContactPair& pair) {
  const btCollisionShape& body = *pair.body->object->getCollisionShape();
  const btCollisionShape& other = *pair.other->object->getCollisionShape();
  const auto isPlain = [](const btCollisionShape& shape) {
    return shape.isConvex() || shape.getShapeType() == TRIANGLE_MESH_SHAPE_PROXYTYPE ||
           shape.getShapeType() == TERRAIN_SHAPE_PROXYTYPE ||
           shape.getShapeType() == STATIC_PLANE_PROXYTYPE;
  };
  return (body.isConvex() && isPlain(other)) || (other.isConvex() && isPlain(body));
}

bool isImmovable(const TrackedBody& body) {
  return body.kind == BodyKind::fixed || body.kind == BodyKind::kinematic;
}

}  // namespace

void ContactClassifier::resolveAll() {
  reader_.beginReading(bodies_.hasContinuous());
  if (bodies_.hasSoft()) context_.counters.softContacts += reader_.softContacts();
  log_.beginSubstep();
  for (const ContactPair& pair : pairsToResolve())
    resolve(pair);
  records_.forEach([this](PairRecord& record) {
    if (!isResolved(record)) revisit(record);
  });
  records_.endSubstep();
  log_.endSubstep();
}

std::span<const ContactPair> ContactClassifier::pairsToResolve() {
  if (waitsForSolver()) return reader_.pushedPairs(bodies_);
  const auto pairs = candidates_.find(bodies_, context_.clock.current().length);
  gaps_.beginSubstep(pairs.size());
  return pairs;
}

void ContactClassifier::resolve(const ContactPair& pair) {
  PairRecord* record = records_.find(pair.key());
  const bool isCarried =
      record != nullptr ? goesOn(pair, *record) : !waitsForSolver() && staysApart(pair);
  ++(isCarried ? context_.counters.carried : context_.counters.searched);
  if (isCarried) return;
  const double dt = context_.clock.current().length;
  const PairMotion now(pair, MotionKind::actual, dt, dt, finder_.pieces());
  if (!now.isFollowed()) {
    if (!reader_.read(pair).points.empty()) ++context_.counters.unsupported;
    return;
  }
  if (record == nullptr && waitsForSolver()) {
    record = beginBefore(now);
    if (record != nullptr && record->isImpacting())
      return impacts_.update(*record, now, reader_.read(pair));
  } else if (record == nullptr && missesFrom(now)) {
    return;
  }
  const Proximity start = now.proximityAt(0.0);
  if (!pair.isClosedForm() && !waitsForSolver())
    gaps_.remember(pair, start, now.pieces().leftOut());
  if (record != nullptr || waitsForSolver() || start.gap <= solverRange(pair)) {
    resolveContact(now, start, record);
  } else if (const FoundImpact* found = find(now, start, nullptr, nullptr)) {
    beginUnlessRest(recordOf(pair, nullptr), *found, combinedRestitution(pair));
  }
}

// True for a pair of which there is nothing to tell: it does not meet in the substep, or too
// slowly, and Bullet's solver has not acted on it.
bool ContactClassifier::staysApart(const ContactPair& pair) {
  const double range = solverRange(pair);
  if (pair.isClosedForm() || std::isinf(range)) return false;
  const double dt = context_.clock.current().length;
  GapMemory::Gap gap = gaps_.of(pair, dt);
  if (gap.least > 0.0 && gap.atStart > range) return true;
  if (!(gap.least > 0.0)) gap = gaps_.measureAlong(pair, dt);
  if (gap.least > 0.0 && gap.atStart > range) return true;
  const bool isFollowed = isSurelyFollowed(pair);
  const bool isSlow = isFollowed && fastestApproach(pair) <= context_.settings.restSpeed;
  if (gap.least > 0.0 || isSlow) return reader_.impulseOf(pair) < 0.0;
  return isFollowed && !mayCollide(pair);
}

// True for a pair that Bullet's solver has not acted on, or cannot have reached, and that does not
// meet in the substep: its gap need not be known. Leaves the pieces as they were.
bool ContactClassifier::missesFrom(const PairMotion& now) {
  const ContactPair& pair = now.pair();
  const double dt = context_.clock.current().length;
  if (pair.isClosedForm()) return false;
  const bool isBeyond = gaps_.of(pair, dt).atStart > solverRange(pair);
  if (!isBeyond && reader_.impulseOf(pair) >= 0.0) return false;
  now.pieces().guess(gaps_.directionOf(pair));
  const bool misses = now.impactTime(dt) == kNever;
  if (misses) gaps_.setDirection(pair, now.pieces().direction());
  now.pieces().guess(Vec3::Zero());
  return misses;
}

// Begins the impact of a new pair that has met in the substep before, and on which Bullet's solver
// has acted since; returns nullptr if there is none. The gap need not be known for that.
PairRecord* ContactClassifier::beginBefore(const PairMotion& now) {
  const ContactPair& pair = now.pair();
  const SolvedContact& solved = reader_.read(pair);
  const double restSpeed = context_.settings.restSpeed;
  const bool overlaps =
      std::ranges::any_of(solved.points, [](const SolvedPoint& point) { return point.gap <= 0.0; });
  if (!overlaps || fastestApproach(pair) <= restSpeed) return nullptr;
  const FoundImpact* found =
      finder_.before(pair, {context_.clock.current().length, restSpeed}, previousOf(pair));
  if (found == nullptr || !mayCollide(pair)) return nullptr;
  PairRecord& record = recordOf(pair, nullptr);
  beginUnlessRest(record, *found, solved.restitution);
  return &record;
}

ImpactFinder::PreviousSubstep ContactClassifier::previousOf(const ContactPair& pair) const {
  return {bodies_.previous(*pair.body), bodies_.previous(*pair.other),
          context_.clock.previous().length};
}

// Goes on with a lasting contact in which no impact is possible, without the pieces of the pair;
// false if that cannot be told from Bullet's points.
bool ContactClassifier::goesOn(const ContactPair& pair, PairRecord& record) {
  if (!(context_.settings.stillSpeed > 0.0)) return false;
  if (!record.isInContact() || record.isImpacting()) return false;
  const double fastest = fastestApproach(pair);
  if (record.isSuppressed() && fastest > context_.settings.restSpeed) return false;
  const bool isSlow = fastest <= leastSpeed(pair, &record);
  if (!(isSlow && contacts_.carryStill(record, pair, reader_.impulseOf(pair)))) {
    const SolvedContact& solved = reader_.read(pair);
    if (!isSlow && mayHit(pair, record, solved)) return false;
    if (waitsForSolver() && solved.applied.isZero(0.0))
      contacts_.carryUnloaded(record);
    else if (!contacts_.carry(record, pair, solved))
      return false;
  }
  if (record.isSuppressed()) record.allowImpacts();
  record.resolvedIn = context_.clock.number();
  return true;
}

// False for a pair, in contact at some points, of which no points can meet as fast as an impact. If
// they overlap, only those count that Bullet has found; otherwise, along the normal of none of them
// may the bodies approach that fast anywhere.
bool ContactClassifier::mayHit(const ContactPair& pair, const PairRecord& record,
                               const SolvedContact& solved) const {
  const double least = leastSpeed(pair, &record);
  if (waitsForSolver()) return isHit(pair, least, solved);
  if (solved.points.empty()) return true;
  const double dt = context_.clock.current().length;
  const double deep = kOverlap * std::min(pair.body->radius, pair.other->radius);
  if (std::ranges::any_of(solved.points,
                          [&](const SolvedPoint& point) { return point.gap < -deep; })) {
    return isHit(pair, least, solved);
  }
  const bool isConvex = pair.body->object->getCollisionShape()->isConvex() &&
                        pair.other->object->getCollisionShape()->isConvex();
  return !isConvex || std::ranges::any_of(solved.points, [&](const SolvedPoint& point) {
    return approachAnywhere(pair, point.normal, MotionKind::actual, dt) > least ||
           approachAnywhere(pair, point.normal, MotionKind::contactFree, dt) > least;
  });
}

// True if the pair would meet faster than `least` (m/s) at one of Bullet's points, were it not for
// the solver.
bool ContactClassifier::isHit(const ContactPair& pair, double least,
                              const SolvedContact& solved) const {
  return std::ranges::any_of(solved.points, [&](const SolvedPoint& point) {
    return (point.gap <= 0.0 || point.impulse > 0.0) &&
           approachAtNode(pair, MotionKind::contactFree, point.position, point.normal) > least;
  });
}

// Resolves a pair on which Bullet's solver may have acted.
void ContactClassifier::resolveContact(const PairMotion& now, const Proximity& start,
                                       PairRecord* record) {
  const SolvedContact& solved = reader_.read(now.pair());
  if (record != nullptr) record->resolvedIn = context_.clock.number();
  if (record != nullptr && record->isImpacting()) {
    resolveImpacting(*record, now, start, solved);
    return;
  }
  if (record != nullptr && record->isSuppressed()) {
    if (!stillApproaches(now, start)) record->allowImpacts();
  } else if (const FoundImpact* found = find(now, start, &solved, record);
             found != nullptr && !isPushedAgain(now.pair(), *found)) {
    record = &recordOf(now.pair(), record);
    beginUnlessRest(*record, *found, solved.restitution);
    if (found->solved && record->isImpacting()) {
      impacts_.update(*record, now, solved);
      return;
    }  // otherwise, the impulses up to now are from before the impact
  }
  // Bullet's friction may act where its normal impulse has come back to zero.
  if (!solved.applied.isZero(0.0) || (record != nullptr && record->isInContact()))
    contacts_.update(recordOf(now.pair(), record), now, start, solved);
}

// True if a pair that has hit lately, and did not approach as the substep before ended, is pushed
// together: by a host that sets a body's velocity in each frame, or pushes it by impulses, as it
// lets a player walk against a wall. Such a pair is in contact.
bool ContactClassifier::isPushedAgain(const ContactPair& pair, const FoundImpact& found) {
  if (!found.solved || found.since < 0.0 || found.offset < 0.0 || found.points.empty())
    return false;
  Hit& hit = hitOf(pair.key());
  const SubstepTime& substep = context_.clock.current();
  if (hit.key != pair.key() || substep.start - hit.time > kHeld) return false;
  const ContactPoint& point = found.points.front();
  const std::optional<double> before =
      ImpactFinder::approachAtEnd(previousOf(pair), point.position, point.normal);
  if (!before) return false;
  const double gained = substep.length * (pair.body->current.acceleration.norm() +
                                          pair.other->current.acceleration.norm());
  if (!(found.nodeSpeed > std::max(*before, 0.0) + kRocking * gained)) return false;
  hit.time = substep.start;
  return true;
}

void ContactClassifier::begin(PairRecord& record, const FoundImpact& found, double restitution) {
  const std::uint64_t key = found.motion.pair().key();
  hitOf(key) = {key, context_.clock.current().start};
  impacts_.begin(record, found, restitution);
}

ContactClassifier::Hit& ContactClassifier::hitOf(std::uint64_t key) {
  return hits_[(key * 0x9E3779B97F4A7C15U) >> (64U - kHitBits)];
}

// Suppresses the impact of bodies that lie on each other but for rounding.
void ContactClassifier::beginUnlessRest(PairRecord& record, const FoundImpact& found,
                                        double restitution) {
  if (found.initialSpeed <= context_.settings.restSpeed)
    record.suppressImpacts();
  else
    begin(record, found, restitution);
}

// An impact is under way: what Bullet has applied belongs to it, unless the pair has met again.
void ContactClassifier::resolveImpacting(PairRecord& record, const PairMotion& now,
                                         const Proximity& start, const SolvedContact& solved) {
  // The bodies may have grazed, or passed through each other, before Bullet could act.
  const bool passed =
      start.gap > 0.0 && approachAtNode(now.pair(), MotionKind::contactFree, start.point,
                                        start.normal) <= context_.settings.restSpeed;
  const bool mayMeetAgain =
      !(waitsForSolver() && solved.applied.isZero(0.0)) &&
      (record.impact.parted || passed || start.gap > now.pair().body->radius ||
       hitsElsewhere(record, now, solved));
  const FoundImpact* again = mayMeetAgain ? find(now, start, &solved, &record) : nullptr;
  if (again != nullptr && isPushedAgain(now.pair(), *again)) again = nullptr;
  const double first = record.impact.points.front().body.time;
  if (again == nullptr || context_.clock.current().start + again->offset < first + kSameImpact) {
    impacts_.update(record, now, solved);
    return;
  }
  if (!again->solved)  // what Bullet has applied still belongs to the old impact
    ImpactTracker::addApplied(record, now, solved);
  impacts_.end(record);
  begin(record, *again, solved.restitution);
  if (again->solved && record.isImpacting()) impacts_.update(record, now, solved);
}

// True if the pair meets from another side while an impact is under way, as a ball that lands on a
// mesh and then hits a wall of it.
bool ContactClassifier::hitsElsewhere(const PairRecord& record, const PairMotion& now,
                                      const SolvedContact& solved) const {
  const Vec3 normal = ImpactTracker::normalOf(record, now);
  return std::ranges::any_of(solved.points, [&](const SolvedPoint& point) {
    const double speed =
        approachAtNode(now.pair(), MotionKind::contactFree, point.position, point.normal);
    return point.impulse > 0.0 && point.normal.dot(normal) < kOtherSide &&
           speed > record.impact.points.front().body.approachSpeed;
  });
}

// True for a pair that goes on approaching where its impacts are suppressed.
bool ContactClassifier::stillApproaches(const PairMotion& now, const Proximity& start) const {
  const double speed = approachAtNode(now.pair(), MotionKind::actual, start.point, start.normal);
  return speed > context_.settings.restSpeed && start.gap <= now.pair().body->radius;
}

// Speed (m/s) that an impact must exceed.
double ContactClassifier::leastSpeed(const ContactPair& pair, const PairRecord* record) const {
  const double restSpeed = context_.settings.restSpeed;
  if (pair.isClosedForm() || record == nullptr || !record->isInContact()) return restSpeed;
  const double acceleration =
      std::max(pair.body->current.acceleration.norm(), pair.other->current.acceleration.norm());
  return std::max(restSpeed, kRocking * acceleration * context_.clock.current().length);
}

bool ContactClassifier::mayCollide(const ContactPair& pair) const {
  return !(isImmovable(*pair.body) && isImmovable(*pair.other)) && reader_.collides(pair);
}

// Finds the impact of a pair in this substep; `solved` may be left out for a pair that Bullet's
// solver cannot have acted on.
const FoundImpact* ContactClassifier::find(const PairMotion& now, const Proximity& start,
                                           const SolvedContact* solved, const PairRecord* record) {
  const ContactPair& pair = now.pair();
  const ImpactFinder::Substep substep{context_.clock.current().length, leastSpeed(pair, record)};
  if (fastestApproach(pair) <= substep.restSpeed) return nullptr;
  // For a pair without a record, beginBefore has searched the previous substep already.
  const bool looksBack =
      waitsForSolver() && record != nullptr && (!record->isInContact() || pair.isClosedForm());
  const FoundImpact* found = search(now, start, solved, substep, looksBack);
  return found != nullptr && mayCollide(pair) ? found : nullptr;
}

const FoundImpact* ContactClassifier::search(const PairMotion& now, const Proximity& start,
                                             const SolvedContact* solved,
                                             const ImpactFinder::Substep& substep, bool looksBack) {
  const ContactPair& pair = now.pair();
  if (start.gap > 0.0) {
    const FoundImpact* found =
        solved == nullptr ? nullptr : finder_.speculative(now, start, *solved, substep);
    return found != nullptr ? found : finder_.alongPath(now, start.gap, substep);
  }
  const ImpactFinder::PreviousSubstep previous = previousOf(pair);
  if (looksBack) {
    const FoundImpact* found = finder_.before(pair, substep, previous);
    if (found != nullptr) return found;
  }
  if (pair.isClosedForm()) return finder_.overlapping(now, substep);
  return finder_.newPoints(now, start, *solved, substep, previous);
}

PairRecord& ContactClassifier::recordOf(const ContactPair& pair, PairRecord* record) {
  if (record != nullptr) return *record;
  PairRecord& added = records_.add(pair.key(), pair.body->id, pair.other->id);
  added.resolvedIn = context_.clock.number();
  return added;
}

bool ContactClassifier::isResolved(const PairRecord& record) const {
  return record.resolvedIn == context_.clock.number();
}

// Goes on with a contact of bodies that both rest; returns false if there is something to tell.
bool ContactClassifier::restsOn(PairRecord& record, const TrackedBody& body,
                                const TrackedBody& other) {
  constexpr std::uint64_t kEvery = 8;  // substeps in which the load is looked at once
  if (!record.isInContact() || record.isImpacting() || record.isSuppressed() || !record.isTold)
    return false;
  if (!body.rests || !other.rests) return false;
  if ((context_.clock.number() + record.body + record.other) % kEvery != 0) return true;
  const ContactPair pair = ContactPair::of(body, other);
  return contacts_.carryStill(record, pair, reader_.impulseOf(pair));
}

// Resolves a recorded pair that is not so near that it could touch in this substep; drops it if
// that is not possible.
void ContactClassifier::revisit(PairRecord& record) {
  const TrackedBody* body = bodies_.find(record.body, record.bodyPlace);
  const TrackedBody* other = bodies_.find(record.other, record.otherPlace);
  const bool there = body != nullptr && other != nullptr && body->current.known &&
                     other->current.known && (body->awake || other->awake);
  if (there && restsOn(record, *body, *other)) {
    ++context_.counters.carried;
    record.resolvedIn = context_.clock.number();
    return;
  }
  if (there) {
    bodies_.complete(*body);
    bodies_.complete(*other);
    resolve(ContactPair::of(*body, *other));
  }
  if (!isResolved(record)) drop(record);
}

// Ends the impact and the contact of a pair that is asleep, gone or far apart.
void ContactClassifier::drop(PairRecord& record) {
  if (record.isImpacting()) impacts_.end(record);
  if (record.isInContact()) contacts_.end(record);
  if (record.isSuppressed()) record.allowImpacts();
}

double ContactClassifier::settledTime() {
  // New points of a lasting contact are dated back into the substep before.
  const SubstepClock& clock = context_.clock;
  const bool isLate = waitsForSolver() || bodies_.hasOtherShapes();
  double settled = isLate ? clock.previous().start : clock.current().start;
  records_.forEach([&settled](const PairRecord& record) {
    if (record.isImpacting() && !record.impact.delivered)
      settled = std::min(settled, record.impact.points.front().body.time);
  });
  return settled;
}

// Begins the impacts of the latest substep, which is over, on which Bullet's solver has yet to act.
void ContactClassifier::beginUnsolved() {
  bodies_.leaveOutRemoved(context_.world);
  const double dt = context_.clock.current().length;
  const auto pairs = candidates_.find(bodies_, dt);
  gaps_.beginSubstep(pairs.size());
  for (const ContactPair& pair : pairs) {
    if (records_.find(pair.key()) != nullptr) continue;
    const PairMotion now(pair, MotionKind::actual, dt, dt, finder_.pieces());
    if (!now.isFollowed() || missesFrom(now)) continue;
    const Proximity start = now.proximityAt(0.0);
    if (!(start.gap > 0.0)) continue;
    if (const FoundImpact* found = find(now, start, nullptr, nullptr))
      beginUnlessRest(recordOf(pair, nullptr), *found, combinedRestitution(pair));
  }
}

void ContactClassifier::flush(bool isWorldThere) {
  if (waitsForSolver() && isWorldThere && context_.clock.number() > 0) beginUnsolved();
  records_.forEach([this](PairRecord& record) {
    if (record.isImpacting()) impacts_.flush(record);
  });
}

}  // namespace carom::bullet
