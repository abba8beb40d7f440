#include "plugin/pybullet/contact_listener.h"

#include <algorithm>
#include <utility>

namespace carom::plugin {
namespace {

// Tolerances (share of the path, and m) within which a body is where its velocity has brought it:
// for rounding and for the bend in the path of a turning link. Elsewhere the host has put it.
constexpr double kStrayShare = 0.1;
constexpr double kStray = 1e-5;  // m

// Substeps. A pair at rest or sliding trembles: the solver acts on it in some substeps and lets it
// fall in others. A body that has hopped for n of them comes back with the speed that gravity gives
// in n / 2, as from a throw.
constexpr std::uint64_t kHop = 4;

std::uint64_t pairKey(BodyId body, BodyId other) {
  return (static_cast<std::uint64_t>(body) << 32U) | other;
}

TouchPoint ordered(TouchPoint point) {
  if (point.body > point.other) {
    std::swap(point.body, point.other);
    std::swap(point.positionOnBody, point.positionOnOther);
    point.normal = -point.normal;
    point.friction = -point.friction;
  }
  return point;
}

}  // namespace

void ContactListener::setBody(BodyId id, const ContactBody& body) {
  entries_[id].body = body;
}

void ContactListener::removeBody(BodyId id) {
  entries_.erase(id);
  std::erase_if(pairs_, [id](const auto& entry) {
    return entry.first >> 32U == id || (entry.first & 0xFFFFFFFFU) == id;
  });
}

void ContactListener::begin(const ContactSubstep& substep) {
  durationBefore_ = substep_.duration;
  substep_ = substep;
  ++count_;
}

void ContactListener::state(BodyId id, const BodyState& state) {
  Track& track = entries_[id].track;
  track.before = std::exchange(track.now, state);
  track.seenBefore = std::exchange(track.seen, count_);
}

void ContactListener::correct(BodyId id, const BodyState& state) {
  Track& track = entries_[id].track;
  track.now = track.before = state;
  track.seen = count_;
  track.seenBefore = 0;
}

std::span<const ImpulseEvent> ContactListener::finish(std::span<const TouchPoint> points,
                                                      const StateAfter& after) {
  events_.clear();
  points_.clear();
  loads_.clear();
  contacts_.clear();
  for (const TouchPoint& point : points) {
    if (!(point.impulse > 0.0)) continue;
    loads_.push_back({pairKey(std::min(point.body, point.other), std::max(point.body, point.other)),
                      points_.size()});
    points_.push_back(ordered(point));
  }
  std::ranges::sort(loads_, [](const Load& first, const Load& second) {
    return std::pair(first.pair, first.point) < std::pair(second.pair, second.point);
  });
  for (std::size_t first = 0; first < loads_.size();) {
    const std::uint64_t key = loads_[first].pair;
    pairPoints_.clear();
    for (; first < loads_.size() && loads_[first].pair == key; ++first)
      pairPoints_.push_back(points_[loads_[first].point]);
    hearPair(key, pairPoints_, after);
  }
  for (const TouchPoint& point : points)
    if (!(point.impulse > 0.0)) stayOpen(ordered(point));
  for (const Load& each : loads_) {
    load(static_cast<BodyId>(each.pair >> 32U));
    load(static_cast<BodyId>(each.pair & 0xFFFFFFFFU));
  }
  std::erase_if(pairs_, [this](const auto& entry) {
    return std::max(entry.second.touched, entry.second.approached) + kHop <= count_;
  });
  return events_;
}

void ContactListener::load(BodyId id) {
  const auto entry = entries_.find(id);
  if (entry != entries_.end() && entry->second.track.seen != 0) entry->second.track.loaded = count_;
}

// Keeps an approach open without an impulse in this substep: a solver may slow a pair down ahead of
// its touch, and leave it alone for a substep in between.
void ContactListener::stayOpen(const TouchPoint& point) {
  const auto found = pairs_.find(pairKey(point.body, point.other));
  if (found == pairs_.end() || found->second.touched == count_) return;
  Pair& pair = found->second;
  if (!isOpen(pair)) return;
  if (approachAt(point, stateOf(point.body), stateOf(point.other)) > restSpeed_)
    pair.approached = count_;
}

bool ContactListener::isHeld(BodyId id) const {
  const auto found = entries_.find(id);
  if (found == entries_.end() || substep_.gravity.isZero()) return false;
  const Track& track = found->second.track;
  return isFollowed(track) && track.loaded == 0 && track.now.velocity.isZero(0.0) &&
         track.before.velocity.isZero(0.0);
}

// True if the body's states of this substep and of the one before are known.
bool ContactListener::isFollowed(const Track& track) const {
  return track.seen == count_ && track.seenBefore != 0 && track.seenBefore + 1 == count_;
}

bool ContactListener::hasPast(const Track& track) const {
  if (!isFollowed(track)) return false;
  const Vec3 way = track.now.velocity * durationBefore_;
  return (track.now.position - track.before.position - way).norm() <=
         kStrayShare * way.norm() + kStray;
}

Vec3 ContactListener::accelerationOf(const Track& track, const ContactBody& body) const {
  if (!body.isMovable()) return Vec3::Zero();
  if (!hasPast(track) || track.loaded + 1 == count_) return substep_.gravity;
  return (track.now.velocity - track.before.velocity) / durationBefore_;
}

const BodyState& ContactListener::stateOf(BodyId id) const {
  static const BodyState kRest;
  const auto found = entries_.find(id);
  return found == entries_.end() ? kRest : found->second.track.now;
}

ContactSide ContactListener::sideOf(BodyId id) const {
  ContactSide side;
  side.id = id;
  const auto found = entries_.find(id);
  if (found != entries_.end()) side.body = found->second.body;
  side.hasPast = !side.body.isMovable();
  if (found == entries_.end() || found->second.track.seen == 0) return side;
  const Track& track = found->second.track;
  side.state = track.now;
  side.hasPast = side.hasPast || hasPast(track);
  side.acceleration = accelerationOf(track, side.body);
  side.velocityBefore = track.before.velocity;
  return side;
}

std::optional<double> ContactListener::restitutionOf(const ContactSide& body,
                                                     const ContactSide& other,
                                                     const TouchPoint& mean,
                                                     const StateAfter& after) const {
  const bool isKnown = !body.body.isRigid() && !other.body.isRigid();
  if (isKnown || !after) return std::nullopt;
  const auto stateOf = [&](const ContactSide& side) -> std::optional<BodyState> {
    if (!side.body.isMovable()) return side.state;
    std::optional<BodyState> state = after(side.id);
    if (state) state->position = side.state.position;  // the lever is that of the solver
    return state;
  };
  const std::optional<BodyState> bodyAfter = stateOf(body);
  const std::optional<BodyState> otherAfter = stateOf(other);
  if (!bodyAfter || !otherAfter) return std::nullopt;
  return restitutionFrom(body, other, mean, -approachAt(mean, *bodyAfter, *otherAfter),
                         substep_.duration, substep_.solver);
}

void ContactListener::hearPair(std::uint64_t key, Points points, const StateAfter& after) {
  const TouchPoint mean = points.size() == 1 ? points.front() : meanOf(points);
  Pair& pair = pairs_[key];
  PairContact& contact = contacts_.emplace_back(PairContact{.mean = mean});
  // Most pairs rest, and need not be looked at more closely.
  if (approachAt(mean, stateOf(mean.body), stateOf(mean.other)) <= restSpeed_) {
    pair.touched = count_;
    return;
  }
  const ContactSide body = sideOf(mean.body);
  const ContactSide other = sideOf(mean.other);
  const bool begun = begins(body, other, mean, pair);
  pair.touched = count_;
  contact.isImpact = pair.approached == count_;
  if (!begun) return;
  const std::optional<Touch> touch = firstTouch(body, other, mean, points);
  if (!touch || touch->approachSpeed <= restSpeed_ || touch->onset <= restSpeed_) return;
  const Impact impact{mean, *touch, substep_.duration, restitutionOf(body, other, mean, after)};
  for (ImpulseEvent share : sharesOf(body, other, impact, substep_.solver)) {
    share.time += substep_.time;
    events_.push_back(share);
  }
}

// Returns the touch of the mean point, at the time of the point that touches first.
std::optional<Touch> ContactListener::firstTouch(const ContactSide& body, const ContactSide& other,
                                                 const TouchPoint& mean, Points points) const {
  const ContactDurations durations{substep_.duration, durationBefore_};
  std::optional<Touch> touch = touchOf(body, other, mean, durations);
  if (!touch || points.size() == 1) return touch;
  for (const TouchPoint& point : points) {
    if (approachAt(point, body.state, other.state) <= restSpeed_) continue;
    if (const auto one = touchOf(body, other, point, durations))
      touch->s = std::min(touch->s, one->s);
  }
  return touch;
}

bool ContactListener::isOpen(const Pair& pair) const {
  return pair.approached != 0 && pair.approached + 1 == count_;
}

// True if the solver acts on an approach that was not there before.
bool ContactListener::begins(const ContactSide& body, const ContactSide& other,
                             const TouchPoint& mean, Pair& pair) const {
  if (!body.body.isMovable() && !other.body.isMovable()) return false;
  const bool wasOpen = isOpen(pair);
  const bool lasting = !wasOpen && pair.touched != 0 && pair.touched + kHop >= count_;
  const double hop = 0.5 * kHop * substep_.gravity.norm() * substep_.duration;
  const double least = lasting ? std::max(restSpeed_, hop) : restSpeed_;
  if (approachAt(mean, body.state, other.state) <= least) return false;
  pair.approached = count_;
  return !wasOpen;
}

}  // namespace carom::plugin
