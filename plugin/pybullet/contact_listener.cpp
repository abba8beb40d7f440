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
  }
  return point;
}

bool isBefore(const TouchPoint& first, const TouchPoint& second) {
  return pairKey(first.body, first.other) < pairKey(second.body, second.other);
}

}  // namespace

void ContactListener::setBody(BodyId id, const ContactBody& body) {
  bodies_[id] = body;
}

void ContactListener::removeBody(BodyId id) {
  bodies_.erase(id);
  tracks_.erase(id);
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
  Track& track = tracks_[id];
  track.before = std::exchange(track.now, state);
  track.seenBefore = std::exchange(track.seen, count_);
}

std::span<const ImpulseEvent> ContactListener::finish(std::span<const TouchPoint> points,
                                                      const StateAfter& after) {
  events_.clear();
  points_.clear();
  for (const TouchPoint& point : points)
    if (point.impulse > 0.0) points_.push_back(ordered(point));
  std::ranges::stable_sort(points_, isBefore);
  const Points all = points_;
  for (std::size_t first = 0; first < all.size();) {
    std::size_t last = first;
    while (last < all.size() && !isBefore(all[first], all[last]))
      ++last;
    hearPair(all.subspan(first, last - first), after);
    first = last;
  }
  for (const TouchPoint& point : points)
    if (!(point.impulse > 0.0)) stayOpen(ordered(point));
  for (const TouchPoint& point : points_)
    for (const BodyId id : {point.body, point.other})
      if (const auto track = tracks_.find(id); track != tracks_.end())
        track->second.loaded = count_;
  std::erase_if(pairs_, [this](const auto& entry) {
    return std::max(entry.second.touched, entry.second.approached) + kHop <= count_;
  });
  return events_;
}

// Keeps an approach open without an impulse in this substep: a solver may slow a pair down ahead of
// its touch, and leave it alone for a substep in between.
void ContactListener::stayOpen(const TouchPoint& point) {
  const auto found = pairs_.find(pairKey(point.body, point.other));
  if (found == pairs_.end() || found->second.touched == count_) return;
  Pair& pair = found->second;
  if (!isOpen(pair)) return;
  if (approachAt(point, sideOf(point.body).state, sideOf(point.other).state) > restSpeed_)
    pair.approached = count_;
}

bool ContactListener::isHeld(BodyId id) const {
  const auto found = tracks_.find(id);
  if (found == tracks_.end() || substep_.gravity.isZero()) return false;
  const Track& track = found->second;
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

ContactSide ContactListener::sideOf(BodyId id) const {
  ContactSide side;
  side.id = id;
  if (const auto body = bodies_.find(id); body != bodies_.end()) side.body = body->second;
  const auto found = tracks_.find(id);
  side.hasPast = !side.body.isMovable();
  if (found == tracks_.end()) return side;
  const Track& track = found->second;
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

void ContactListener::hearPair(Points points, const StateAfter& after) {
  const ContactSide body = sideOf(points.front().body);
  const ContactSide other = sideOf(points.front().other);
  const TouchPoint mean = meanOf(points);
  Pair& pair = pairs_[pairKey(body.id, other.id)];
  const bool begun = begins(body, other, mean, pair);
  pair.touched = count_;
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
