#include "plugin/pybullet/contact_listener.h"

#include <algorithm>
#include <iterator>
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

/// The state of a body; that of one that is not known is rest.
template <class Entry>
const BodyState& stateOf(const Entry* entry) {
  static const BodyState kRest;
  return entry == nullptr ? kRest : entry->track.now;
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
  std::erase_if(pairs_, [id](const Pair& pair) {
    return pair.key >> 32U == id || (pair.key & 0xFFFFFFFFU) == id;
  });
}

void ContactListener::forgetPast() {
  ++count_;  // no state follows another one of the substep before
  for (Pair& pair : pairs_)
    pair.impact = pair.approached = 0;
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
  // Both the pairs that are known and the loads are in the order of their keys.
  const auto lives = [this](const Pair& pair) {
    return std::max(pair.touched, pair.approached) + kHop > count_;
  };
  nextPairs_.clear();
  auto known = pairs_.begin();
  for (std::size_t first = 0; first < loads_.size();) {
    Pair pair{.key = loads_[first].pair};
    for (; known != pairs_.end() && known->key < pair.key; ++known)
      if (lives(*known)) nextPairs_.push_back(*known);
    if (known != pairs_.end() && known->key == pair.key) pair = *known++;
    pairPoints_.clear();
    for (; first < loads_.size() && loads_[first].pair == pair.key; ++first)
      pairPoints_.push_back(points_[loads_[first].point]);
    hearPair(pair, pairPoints_, after);
    nextPairs_.push_back(pair);
  }
  std::copy_if(known, pairs_.end(), std::back_inserter(nextPairs_), lives);
  std::swap(pairs_, nextPairs_);
  for (const TouchPoint& point : points)
    if (!(point.impulse > 0.0)) stayOpen(ordered(point));
  return events_;
}

ContactListener::Entry* ContactListener::find(BodyId id) {
  const auto entry = entries_.find(id);
  return entry == entries_.end() ? nullptr : &entry->second;
}

void ContactListener::load(Entry* entry) const {
  if (entry == nullptr || entry->track.seen == 0 || entry->track.loaded == count_) return;
  entry->track.loadedBefore = std::exchange(entry->track.loaded, count_);
}

// Keeps an approach open without an impulse in this substep: a solver may slow a pair down ahead of
// its touch, and leave it alone for a substep in between.
void ContactListener::stayOpen(const TouchPoint& point) {
  const std::uint64_t key = pairKey(point.body, point.other);
  const auto pair = std::ranges::lower_bound(pairs_, key, {}, &Pair::key);
  if (pair == pairs_.end() || pair->key != key || pair->touched == count_ || !isOpen(*pair)) return;
  if (approachAt(point, stateOf(find(point.body)), stateOf(find(point.other))) > restSpeed_)
    pair->approached = count_;
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
  const std::uint64_t loaded = track.loaded == count_ ? track.loadedBefore : track.loaded;
  if (!hasPast(track) || loaded + 1 == count_) return substep_.gravity;
  return (track.now.velocity - track.before.velocity) / durationBefore_;
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

void ContactListener::hearPair(Pair& pair, Points points, const StateAfter& after) {
  const TouchPoint mean = points.size() == 1 ? points.front() : meanOf(points);
  PairContact& contact = contacts_.emplace_back(PairContact{.mean = mean});
  Entry* const entry = find(mean.body);
  Entry* const otherEntry = find(mean.other);
  load(entry);
  load(otherEntry);
  // Most pairs rest, and need not be looked at more closely.
  if (approachAt(mean, stateOf(entry), stateOf(otherEntry)) <= restSpeed_) {
    pair.touched = count_;
    return;
  }
  const ContactSide body = sideOf(mean.body);
  const ContactSide other = sideOf(mean.other);
  const bool begun = begins(body, other, mean, pair);
  pair.touched = count_;
  // An approach that goes on for longer than an impact is that of a body that trembles as it
  // slides.
  const bool goesOn = pair.impact != 0 && pair.impact + kHop > count_;
  contact.isImpact = !begun && goesOn && pair.approached == count_;
  if (!begun) return;
  const std::optional<Touch> touch = firstTouch(body, other, mean, points);
  if (!touch || touch->approachSpeed <= restSpeed_ || touch->onset <= restSpeed_) return;
  contact.isImpact = true;
  pair.impact = count_;
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
