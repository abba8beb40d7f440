#include "carom/native/recording.h"

#include <algorithm>
#include <bit>
#include <cassert>

#include "native/spheres/event_pair.h"

namespace carom {

using namespace native;

namespace {

/// The hash FNV-1a of 64 bits (Fowler, Noll, Vo; draft-eastlake-fnv).
class BitHash {
 public:
  void add(double value) {
    const auto bits = std::bit_cast<std::uint64_t>(value);
    for (unsigned shift = 0; shift < 64; shift += 8)
      hash_ = (hash_ ^ ((bits >> shift) & 0xFF)) * 0x100000001B3ULL;
  }
  void add(const Vec3& value) {
    for (const double component : value)
      add(component);
  }
  std::uint64_t value() const { return hash_; }

 private:
  std::uint64_t hash_ = 0xCBF29CE484222325ULL;
};

std::vector<std::uint64_t> bitsOf(ImpulseEvent event) {
  std::vector<std::uint64_t> bits{event.body, event.other, event.hasAppliedImpulse ? 1U : 0U};
  visitFields(event, [&](std::span<const double> numbers) {
    for (const double number : numbers)
      bits.push_back(std::bit_cast<std::uint64_t>(number));
  });
  return bits;
}

}  // namespace

Recording::Recording(World world, double begin, std::span<const Segment> segments)
    : world_(std::move(world)), begin_(begin), end_(begin) {
  assert(segments.size() == world_.spheres.size());
  segments_.reserve(segments.size());
  for (const Segment& segment : segments)
    segments_.push_back({segment});
}

std::optional<std::size_t> Recording::sphereOf(BodyId id) const {
  const auto found = std::ranges::lower_bound(world_.spheres, id, {}, &Sphere::id);
  if (found == world_.spheres.end() || found->id != id) return std::nullopt;
  return static_cast<std::size_t>(found - world_.spheres.begin());
}

std::uint32_t Recording::bodyOf(BodyId id) const {
  if (const auto sphere = sphereOf(id)) return static_cast<std::uint32_t>(*sphere);
  const auto wall = std::ranges::find(world_.walls, id, &Wall::id);
  if (wall == world_.walls.end()) return kNobody;
  return static_cast<std::uint32_t>(sphereCount()) +
         static_cast<std::uint32_t>(wall - world_.walls.begin());
}

const Recording::Segment& Recording::segmentAt(std::size_t sphere, double time) const {
  const auto later = std::ranges::upper_bound(
      segments_[sphere], time, {}, [](const Segment& segment) { return segment.since.seconds; });
  return later == segments_[sphere].begin() ? *later : *(later - 1);
}

SphereState Recording::state(std::size_t sphere, double time) const {
  assert(sphere < sphereCount());
  assert(time >= begin_ && time <= end_);
  const double known = std::clamp(time, begin_, end_);
  const Motion motion = segmentAt(sphere, known).at({known, 0.0});
  return {motion.position, motion.velocity, Vec3::Zero()};
}

std::size_t Recording::segmentCount() const {
  std::size_t count = 0;
  for (const auto& segments : segments_)
    count += segments.size();
  return count;
}

std::size_t Recording::collisionsUntil(double time) const {
  const auto later = std::ranges::upper_bound(
      collisions_, time, {}, [](const Collision& collision) { return collision.time.seconds; });
  return static_cast<std::size_t>(later - collisions_.begin());
}

Recording::Events Recording::events(std::size_t collision) const {
  const Collision& found = collisions_[collision];
  return found.exception == kNobody ? rebuilt(found) : exceptions_[found.exception];
}

std::vector<ImpulseEvent> Recording::eventsBetween(double after, double until) const {
  const std::size_t last = collisionsUntil(until);
  std::vector<ImpulseEvent> found;
  for (std::size_t collision = collisionsUntil(after); collision < last; ++collision) {
    const Events both = events(collision);
    found.insert(found.end(), both.begin(), both.end());
  }
  return found;
}

Recording::Events Recording::rebuilt(const Collision& collision) const {
  const auto sideOf = [&](std::uint32_t sphere, std::uint32_t segment) {
    const Motion motion = segments_[sphere][segment].at(collision.time);
    return Side{world_.spheres[sphere].id, world_.spheres[sphere].radius, motion.position,
                motion.velocity};
  };
  const Side first = sideOf(collision.first, collision.firstSegment);
  Side second{.position = first.position - first.radius * collision.normal,
              .velocity = Vec3::Zero()};
  if (collision.second < sphereCount()) {
    second = sideOf(collision.second, collision.secondSegment);
  } else if (collision.second != kNobody) {
    const Wall& wall = world_.walls[collision.second - sphereCount()];
    second.id = wall.id;
    second.velocity = wall.velocity;
  }
  return eventsOf(
      first, second,
      {collision.normal, collision.approachSpeed, collision.effectiveMass, collision.impulse},
      collision.time.seconds);
}

std::uint64_t Recording::trajectoryHash() const {
  BitHash hash;
  for (std::size_t collision = 0; collision < collisions_.size(); ++collision) {
    for (const ImpulseEvent& event : events(collision)) {
      hash.add(event.time);
      hash.add(event.impulse);
      hash.add(event.position);
      hash.add(event.bodyVelocity);
    }
  }
  for (std::size_t sphere = 0; sphere < sphereCount(); ++sphere) {
    const SphereState last = state(sphere, end_);
    hash.add(last.position);
    hash.add(last.velocity);
  }
  return hash.value();
}

void Recording::addSegment(std::uint32_t sphere, const Segment& segment) {
  segments_[sphere].push_back(segment);
  log_.push_back(sphere);
}

void Recording::addCollision(const Events& events, const Instant& instant, double impulse) {
  const ImpulseEvent& event = events.front();
  Collision collision;
  collision.time = instant;
  collision.first = bodyOf(event.body);
  assert(collision.first < sphereCount() && "the first body of a collision is a sphere");
  collision.second = bodyOf(event.other);
  collision.approachSpeed = event.approachSpeed;
  collision.effectiveMass = event.effectiveMass;
  collision.normal = event.normal;
  collision.impulse = impulse;
  addCollision(collision, &events);
}

void Recording::addCollision(const Collision& collision, const Events* exception) {
  Collision& added = collisions_.emplace_back(collision);
  added.firstSegment = static_cast<std::uint32_t>(segments_[added.first].size() - 1);
  if (added.second < sphereCount())
    added.secondSegment = static_cast<std::uint32_t>(segments_[added.second].size() - 1);
  log_.push_back(kNobody);
  if (exception == nullptr) return;
  const Events plain = rebuilt(added);
  const bool same =
      bitsOf(plain[0]) == bitsOf((*exception)[0]) && bitsOf(plain[1]) == bitsOf((*exception)[1]);
  added.exception = kNobody;
  // A collision with an unknown second body cannot be rebuilt from that body, so its events are
  // kept.
  if (same && added.second != kNobody) return;
  added.exception = static_cast<std::uint32_t>(exceptions_.size());
  exceptions_.push_back(*exception);
}

}  // namespace carom
