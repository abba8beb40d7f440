#include "plugin/pybullet/lasting_pairs.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "audio/contact/contact_drive.h"

namespace carom::plugin {
namespace {

constexpr std::uint64_t kIdleSubsteps = 3;  // after which a contact without load has ended
constexpr double kNewLoad = 2.0;  // ratio of loads beyond which a still contact has changed

/// Radius (m) of a body that rolls over the contact; infinite where it is flat or has an edge.
double rollingRadius(const ContactBody& body) {
  const bool isRound = body.form == ContactBody::Form::sphere ||
                       body.form == ContactBody::Form::capsule ||
                       body.form == ContactBody::Form::cylinder;
  return isRound ? body.radius : std::numeric_limits<double>::infinity();
}

/// Velocity (m/s) of the contact point: that of the centre of curvature of the more curved body, or
/// of the body itself on another flat one.
Vec3 pointVelocity(const TouchPoint& contact, const SubstepMotion& body, const BodyState& moving,
                   const SubstepMotion& other, const BodyState& otherMoving) {
  const Vec3& place = contact.positionOnOther;
  const double radius = rollingRadius(body.body);
  const double otherRadius = rollingRadius(other.body);
  if (std::isinf(radius) && std::isinf(otherRadius)) return velocityAt(moving, place);
  return radius <= otherRadius ? velocityAt(moving, place + radius * contact.normal)
                               : velocityAt(otherMoving, place - otherRadius * contact.normal);
}

Vec3 toLocal(const BodyState& state, const Vec3& place) {
  return state.orientation.conjugate() * (place - state.position);
}

/// Returns the same contact seen from the other body.
TouchPoint mirrored(TouchPoint point) {
  std::swap(point.body, point.other);
  std::swap(point.positionOnBody, point.positionOnOther);
  point.normal = -point.normal;
  point.friction = -point.friction;
  return point;
}

constexpr double kStill = audio::ContactDrive::kSlowest;  // m/s

/// Bound of the speed (m/s) at which a body moves at a contact.
double speedAt(const TouchPoint& contact, const BodyState* state) {
  if (state == nullptr) return 0.0;
  return state->velocity.norm() +
         state->angularVelocity.norm() * (contact.positionOnOther - state->position).norm();
}

bool liesStill(const ContactState& state) {
  const double way = kStill * state.duration;
  return state.slipVelocity.norm() <= kStill && (state.pathEnd - state.pathStart).norm() <= way &&
         (state.otherPathEnd - state.otherPathStart).norm() <= way;
}

/// Returns the end of a contact.
ContactState ended(ContactState state, double time, double duration) {
  state.time = time;
  state.duration = duration;
  state.phase = ContactPhase::end;
  state.normalLoad = 0.0;
  state.appliedImpulse = state.slipVelocity = state.rollingVelocity = Vec3::Zero();
  state.pathStart = state.pathEnd;
  state.otherPathStart = state.otherPathEnd;
  return state;
}

}  // namespace

ContactState contactStateOf(const TouchPoint& contact, const SubstepMotion& body,
                            const SubstepMotion& other, double duration) {
  // The points at the contact move by the velocities with which the substep ends.
  const auto movingFrom = [](const SubstepMotion& of) {
    return BodyState{of.start.position, of.start.orientation, of.end.velocity,
                     of.end.angularVelocity};
  };
  const BodyState moving = movingFrom(body);
  const BodyState otherMoving = movingFrom(other);
  const Vec3& place = contact.positionOnOther;
  const Vec3 bodyVelocity = velocityAt(moving, place);
  const Vec3 otherVelocity = velocityAt(otherMoving, place);
  const Vec3 velocity = pointVelocity(contact, body, moving, other, otherMoving);
  const auto tangential = [&](const Vec3& v) {
    return Vec3(v - v.dot(contact.normal) * contact.normal);
  };
  ContactState state;
  state.duration = duration;
  state.body = contact.body;
  state.other = contact.other;
  state.normal = contact.normal;
  state.position = place;
  state.normalLoad = contact.impulse / duration;
  state.appliedImpulse = contact.impulse * contact.normal + contact.friction;
  state.radius = curvatureOf(body.body, body.start.orientation, contact.normal);
  state.otherRadius = curvatureOf(other.body, other.start.orientation, contact.normal);
  state.slipVelocity = tangential(bodyVelocity - otherVelocity);
  state.rollingVelocity = tangential(velocity - 0.5 * (bodyVelocity + otherVelocity));
  state.bodyPosition = body.start.position;
  state.bodyOrientation = body.start.orientation;
  state.bodyVelocity = body.end.velocity;
  state.otherPosition = other.start.position;
  state.otherOrientation = other.start.orientation;
  state.otherVelocity = other.end.velocity;
  const Vec3 end = place + duration * velocity;
  state.pathStart = toLocal(body.start, place);
  state.pathEnd = toLocal(body.end, end);
  state.otherPathStart = toLocal(other.start, place);
  state.otherPathEnd = toLocal(other.end, end);
  return state;
}

std::span<const ContactState> LastingPairs::finish(double time, double duration,
                                                   std::span<const PairContact> contacts,
                                                   const SubstepMotions& motions) {
  time_ = time;
  duration_ = duration;
  ++count_;
  states_.clear();
  nextPairs_.clear();
  auto known = pairs_.begin();
  for (const PairContact& contact : contacts) {
    const std::uint64_t key =
        (static_cast<std::uint64_t>(contact.mean.body) << 32U) | contact.mean.other;
    for (; known != pairs_.end() && known->key < key; ++known)
      keep(*known);
    if (contact.isImpact) continue;
    Pair pair{.key = key};
    if (known != pairs_.end() && known->key == key) pair = std::move(*known++);
    tell(pair, contact.mean, motions);
    nextPairs_.push_back(std::move(pair));
  }
  for (; known != pairs_.end(); ++known)
    keep(*known);
  std::swap(pairs_, nextPairs_);
  return states_;
}

std::span<const ContactState> LastingPairs::end(double time) {
  states_.clear();
  for (const Pair& pair : pairs_)
    if (pair.state != nullptr) states_.push_back(ended(*pair.state, time, pair.state->duration));
  pairs_.clear();
  return states_;
}

/// Keeps a pair without load, or ends it.
void LastingPairs::keep(Pair& pair) {
  if (pair.loaded + kIdleSubsteps > count_)
    nextPairs_.push_back(std::move(pair));
  else if (pair.state != nullptr)
    states_.push_back(ended(*pair.state, time_, duration_));
}

void LastingPairs::tell(Pair& pair, const TouchPoint& contact, const SubstepMotions& motions) {
  pair.loaded = count_;
  const double load = contact.impulse / duration_;
  const bool isNews = load > kNewLoad * pair.load || kNewLoad * load < pair.load;
  const bool isTold = pair.state != nullptr && pair.isStill && !isNews;
  // Most pairs that rest are told from others by their bodies' speeds.
  if (isTold && speedAt(contact, motions.endStateOf(contact.body)) +
                        speedAt(contact, motions.endStateOf(contact.other)) <=
                    kStill)
    return;
  std::optional<SubstepMotion> body = motions.motionOf(contact.body);
  std::optional<SubstepMotion> other = motions.motionOf(contact.other);
  if (!body || !other || !(body->body.isMovable() || other->body.isMovable())) return;
  // Two flat sides touch where the one that moves is.
  const bool isMirrored = !body->body.isMovable();
  if (isMirrored) std::swap(body, other);
  ContactState state =
      contactStateOf(isMirrored ? mirrored(contact) : contact, *body, *other, duration_);
  state.time = time_;
  const bool isStill = liesStill(state);
  if (isStill && isTold) return;
  state.phase = pair.state != nullptr ? ContactPhase::during : ContactPhase::begin;
  pair.isStill = isStill;
  pair.load = load;
  pair.state = std::make_unique<ContactState>(state);
  states_.push_back(state);
}

void LastingPairs::removeBody(BodyId id) {
  std::erase_if(pairs_, [id](const Pair& pair) {
    return pair.key >> 32U == id || (pair.key & 0xFFFFFFFFU) == id;
  });
}

}  // namespace carom::plugin
