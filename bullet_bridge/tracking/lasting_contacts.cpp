#include "bullet_bridge/tracking/lasting_contacts.h"

#include <algorithm>
#include <utility>

#include "bullet_bridge/tracking/contact_kinematics.h"

namespace carom::bullet {
namespace {

// Substeps without load after which a lasting contact has ended.
constexpr int kIdleSubsteps = 3;
// Ratio of loads beyond which a contact that lies still has changed.
constexpr double kNewLoad = 2.0;
// Way of the bodies, relative to the smaller one's radius, in which a contact keeps its curvature.
constexpr double kSameCurvature = 0.05;

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

// True if the bodies have hardly moved on each other since a contact's curvature was found, or it
// can change only between faces, edges and corners.
bool keepsCurvature(const PairCurvature& curvature, const ContactPair& pair) {
  const bool isRim = curvature.body.rimRadius > 0.0 || curvature.other.rimRadius > 0.0;
  if (curvature.turned < 0.0 || isRim) return false;
  const auto isRoundOrFlat = [](const TrackedBody& body) {
    return body.parts == nullptr || body.parts->isRoundOrFlat();
  };
  if (isRoundOrFlat(*pair.body) && isRoundOrFlat(*pair.other)) return true;
  const Vec3 apart = pair.body->current.start - pair.other->current.start;
  const double gone =
      pair.body->turned + pair.other->turned - curvature.turned + (apart - curvature.apart).norm();
  return gone <= kSameCurvature * std::min(pair.body->radius, pair.other->radius);
}

// Returns the deepest of the points at which Bullet holds a pair.
Proximity deepestOf(const SolvedContact& solved) {
  const SolvedPoint& point = *std::ranges::min_element(solved.points, {}, &SolvedPoint::gap);
  return {.gap = point.gap,
          .normal = point.normal,
          .point = point.position + point.gap * point.normal,
          .otherPoint = point.position};
}

}  // namespace

// True if no point of either body moves fast enough.
bool LastingContacts::liesStill(const ContactPair& pair) const {
  return pair.body->fastest + pair.other->fastest <= context_.settings.stillSpeed;
}

bool LastingContacts::carryStill(PairRecord& record, const ContactPair& pair,
                                 double impulse) const {
  const int idle = impulse > 0.0 ? 0 : record.idle + 1;
  if (!record.isTold || idle >= kIdleSubsteps || !liesStill(pair) || isNews(record, impulse))
    return false;
  record.idle = idle;
  return true;
}

// True if the contact point moves over neither body fast enough, and the bodies not on each other.
bool LastingContacts::liesStill(const ContactState& state) const {
  const double still = context_.settings.stillSpeed;
  const double way = still * state.duration;
  return state.slipVelocity.squaredNorm() <= still * still &&
         (state.pathEnd - state.pathStart).squaredNorm() <= way * way &&
         (state.otherPathEnd - state.otherPathStart).squaredNorm() <= way * way;
}

// True if the load is no longer about what was told last.
bool LastingContacts::isNews(const PairRecord& record, double impulse) const {
  const double told = record.state.normalLoad * context_.clock.current().length;
  return impulse > kNewLoad * told || kNewLoad * impulse < told;
}

bool LastingContacts::carry(PairRecord& record, const ContactPair& pair,
                            const SolvedContact& solved) {
  if (record.body != pair.body->id || solved.points.empty()) return false;
  if (!keepsCurvature(record.curvature, pair)) return false;
  const double dt = context_.clock.current().length;
  const PairMotion now(pair, pair.body->actual(dt), pair.other->actual(dt));
  ContactState state =
      contactStateOf(now, deepestOf(solved), record.curvature, solved, context_.clock.current());
  record.idle = solved.impulse > 0.0 ? 0 : record.idle + 1;
  const bool isOver = record.idle >= kIdleSubsteps;
  const bool isStill = liesStill(state);
  if (!isOver && isStill && record.isTold && !isNews(record, solved.impulse)) return true;
  state.phase = isOver ? ContactPhase::end : ContactPhase::during;
  if (isOver) record.endContact();
  record.isTold = isStill;
  record.state = state;
  states_.push_back(state);
  return true;
}

void LastingContacts::update(PairRecord& record, const PairMotion& now, const Proximity& start,
                             const SolvedContact& solved) {
  const bool begins = !record.isInContact();
  if (begins) record.beginContact();
  record.idle = begins || solved.impulse > 0.0 ? 0 : record.idle + 1;
  record.curvature = curvatureOf(now, start);
  const double dt = context_.clock.current().length;
  const ContactPair& pair = now.pair();
  const PairMotion turning =
      pair.isClosedForm() ? PairMotion(pair, pair.body->actual(dt), pair.other->actual(dt)) : now;
  record.state = contactStateOf(turning, start, record.curvature, solved, context_.clock.current());
  if (record.state.body != record.body) record.state = mirrored(record.state);
  record.state.phase = begins ? ContactPhase::begin : ContactPhase::during;
  if (begins) ++context_.counters.contactsBegun;
  if (record.idle >= kIdleSubsteps) {
    record.endContact();
    record.state.phase = ContactPhase::end;
  }
  record.isTold = context_.settings.stillSpeed > 0.0 && liesStill(record.state);
  states_.push_back(record.state);
}

void LastingContacts::end(PairRecord& record) {
  tellUnloaded(record, ContactPhase::end);
  record.endContact();
}

void LastingContacts::carryUnloaded(PairRecord& record) {
  if (++record.idle >= kIdleSubsteps) return end(record);
  tellUnloaded(record, ContactPhase::during);
  record.state = states_.back();
  record.isTold = false;
}

void LastingContacts::tellUnloaded(const PairRecord& record, ContactPhase phase) {
  ContactState state = record.state;
  state.time = context_.clock.current().start;
  state.duration = context_.clock.current().length;
  state.phase = phase;
  state.normalLoad = 0.0;
  state.appliedImpulse = state.slipVelocity = state.rollingVelocity = Vec3::Zero();
  state.pathStart = state.pathEnd;
  state.otherPathStart = state.otherPathEnd;
  states_.push_back(state);
}

}  // namespace carom::bullet
