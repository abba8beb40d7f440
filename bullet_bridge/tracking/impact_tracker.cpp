#include "bullet_bridge/tracking/impact_tracker.h"

#include <algorithm>

namespace carom::bullet {
namespace {

// Substeps in which Bullet may act on an impact that no longer approaches.
constexpr int kSolvedSubsteps = 2;
// Longest time that an event waits for the end of its impact: in s and in substeps, whichever is
// longer.
constexpr double kLongestWait = 0.02;
constexpr double kLongestWaitSubsteps = 3.0;
// Fraction of the speed that restitution demands after an impact; a slower rebound counts as lost.
constexpr double kLeastRebound = 0.5;

// Returns -1 if the pair's bodies have changed roles since the record was made, as when the host
// makes one of them kinematic.
double signOf(const PairRecord& record, const PairMotion& now) {
  return record.body == now.pair().body->id ? 1.0 : -1.0;
}

}  // namespace

Vec3 ImpactTracker::normalOf(const PairRecord& record, const PairMotion& now) {
  return signOf(record, now) * record.impact.points.front().body.normal;
}

void ImpactTracker::begin(PairRecord& record, const FoundImpact& found, double restitution) {
  const double threshold =
      static_cast<double>(context_.world.getSolverInfo().m_restitutionVelocityThreshold);
  const bool bounces = found.nodeSpeed >= threshold;  // below it, Bullet does not
  Impact& impact = record.impact;
  impact.applied = Vec3::Zero();
  impact.solved = 0;
  impact.parted = impact.delivered = false;
  impact.restitution = bounces ? restitution : 0.0;
  impact.foundAt = context_.clock.latest().start + found.since;
  events_.set(impact, found, context_.clock.latest());
  if (impact.points.empty()) return record.suppressImpacts();
  record.beginImpact();
  count(impact, found);
  if (!bounces && restitution > 0.0) ++context_.counters.belowThreshold;
  if (context_.settings.delivery == EventDelivery::prompt) log_.deliver(impact);
}

void ImpactTracker::count(const Impact& impact, const FoundImpact& found) {
  BulletBridgeCounters& counters = context_.counters;
  counters.collisions += impact.points.size();
  counters.merged += found.points.size() - impact.points.size();
  if (found.solved && found.offset > 0.0) ++counters.speculative;
}

void ImpactTracker::addApplied(PairRecord& record, const PairMotion& now,
                               const SolvedContact& solved) {
  record.impact.applied += signOf(record, now) * solved.applied;
  if (solved.impulse > 0.0) ++record.impact.solved;
}

void ImpactTracker::update(PairRecord& record, const PairMotion& now, const SolvedContact& solved) {
  addApplied(record, now, solved);
  const double dt = context_.clock.current().length;
  Proximity end = now.proximityAt(dt);
  if (!now.pair().isClosedForm()) end.normal = normalOf(record, now);
  const double approach = approachWithNode(now, MotionKind::actual, end, dt);
  endIfOver(record, {approach, end.gap, end.gap > now.pair().body->radius});
  const Impact& impact = record.impact;
  const double rebound = impact.restitution * impact.points.front().body.approachSpeed;
  if (!record.isImpacting() && impact.solved > 0 && -approach < kLeastRebound * rebound)
    ++context_.counters.lostRebound;
}

void ImpactTracker::endIfOver(PairRecord& record, const Separation& after) {
  Impact& impact = record.impact;
  const SubstepTime& substep = context_.clock.current();
  const double waited = substep.start + substep.length - impact.foundAt;
  const bool waitedLong =
      waited >= std::max(kLongestWait, (kLongestWaitSubsteps - 0.5) * substep.length);
  const bool approaches = after.approach > context_.settings.restSpeed;
  if (!approaches) {
    impact.parted = true;
    if (after.gap > 0.0 || impact.solved >= kSolvedSubsteps || waitedLong) end(record);
  } else if (after.isFarApart) {
    end(record);
  } else if (waitedLong) {
    end(record);
    record.suppressImpacts();
  }
}

void ImpactTracker::end(PairRecord& record) {
  record.endImpact();
  if (record.impact.solved == 0) ++context_.counters.unsolved;
  log_.deliver(record.impact);
}

}  // namespace carom::bullet
