// The part of Simulation that brings spheres to rest: SphereStepper documents it under Rest, Sleep
// and Collapse.

#include <algorithm>
#include <cmath>

#include "native/math/contact_time.h"
#include "native/math/vector_math.h"
#include "native/mechanics/resting.h"
#include "native/spheres/simulation.h"

namespace carom::native {
namespace {

// These constants define rest, too, and are documented in SphereStepper.
constexpr double kLeastFlight = 1e-5;         ///< s, a shorter bounce on a wall is none
constexpr double kRubbedHopTime = 0.1e-3;     ///< s, unpaid hop where friction or forces damp
constexpr double kFirstHops = 10.0;           ///< hops of kLeastHopTime that a sphere has unpaid
constexpr double kCollapseInterval = 1e-6;    ///< s, a shorter interval between contacts is rapid
constexpr std::uint16_t kCollapseRun = 1000;  ///< rapid contacts in a row that are a collapse
constexpr std::uint16_t kCrushRun = 5000;     ///< rapid contacts in a row that may have no way out
constexpr double kCrushInterval = 1e-9;       ///< s, no way out below; moving surfaces give energy
constexpr double kStuckInterval = 1e-10;      ///< s, no way out below, if no surface moves
constexpr double kCollapseRestSpeed = 0.005;  ///< m/s, rest speed of a sphere after a collapse
constexpr double kCalmTime = 0.02;            ///< s, of calm before sleep
constexpr double kCalmDrift = 0.25;           ///< relative to the rest speed: slower is calm
constexpr double kRetryTime = 0.005;          ///< s, between two attempts to sleep
constexpr double kSleepPull = 1e-3;           ///< share of gravity that may stay uncarried

constexpr double kHeldSpeed = 1e-12;  ///< relative to the speed: less along a normal is rounding

}  // namespace

// ---- On walls

double Simulation::wallRebound(std::uint32_t sphere, std::uint32_t index, double approachSpeed) {
  const Substance& body = substances_[sphere];
  const Plane& plane = bodies_.walls[index].plane;
  const double restitution = wallRestitution(sphere, plane, approachSpeed);
  const bool slow = approachSpeed < restSpeed(sphere);
  const double rebound = slow && restitution < 1.0 ? 0.0 : restitution * approachSpeed;
  allowHop(sphere, 0.5 * body.mass * (approachSpeed - rebound) * (approachSpeed + rebound));
  const double pressed = -bodies_.alongNormal(plane.normal, bodies_.accelerations[sphere]);
  // A wall does not hold a sphere on rods, nor one that only the friction on another wall presses
  // against it.
  const bool byFriction = pressed > 0.0 && bodies_.alongNormal(plane.normal, pullOn(sphere)) >= 0.0;
  if (linkage_.hasRods(sphere) || byFriction)
    return std::max(slow ? approachSpeed : rebound,
                    0.5 * kRubbedHopTime * lengthOf(bodies_.accelerations[sphere]));
  if (2.0 * rebound < kLeastFlight * pressed) return 0.0;
  if (rebound <= kLeastRebound * lengthOf(bodies_.motions[sphere].velocity)) return 0.0;
  return rebound;
}

/// Makes the wall hold the sphere, as long as it is pressed against it.
void Simulation::hold(std::uint32_t sphere, Motion& motion, std::uint32_t index) {
  Holds& holds = bodies_.holds[sphere];
  if (holds.count < Holds::kMost) {
    holds.walls[holds.count++] = index;
  } else {  // between so many walls nothing moves
    holds.walls.back() = index;
    motion.velocity.setZero();
  }
}

/// After a change of velocity: releases the walls that the sphere leaves or runs into, and moves it
/// along the others.
void Simulation::keepHolds(std::uint32_t sphere, Motion& motion) {
  if (substances_[sphere].asleep) {
    motion.velocity.setZero();
    bodies_.setAcceleration(sphere, Vec3::Zero());
    return;
  }
  Holds& holds = bodies_.holds[sphere];
  const Vec3 pull = pullOn(sphere);
  if (holds.count == 0) {
    bodies_.setAcceleration(sphere, pull);
    return;
  }
  std::array<Vec3, Holds::kMost> normals;
  std::array<double, Holds::kMost> speeds{};
  Holds kept;
  for (const std::uint32_t index : holds.all()) {
    const Wall& wall = bodies_.walls[index];
    const double speed = dotInOrder(wall.plane.normal, motion.velocity);
    const double rounding = kHeldSpeed * (lengthOf(motion.velocity) + std::abs(wall.speed));
    if (std::abs(speed - wall.speed) > rounding) continue;
    normals[kept.count] = wall.plane.normal;
    speeds[kept.count] = wall.speed;
    kept.walls[kept.count++] = index;
  }
  const Carried carried = carriedBy(pull, {normals.data(), kept.count});
  Holds touching;
  for (std::uint32_t k = 0; k < kept.count; ++k) {
    if ((carried.touching >> k & 1U) == 0) continue;
    normals[touching.count] = normals[k];
    speeds[touching.count] = speeds[k];
    touching.walls[touching.count++] = kept.walls[k];
  }
  holds = touching;
  motion.velocity =
      heldVelocity(motion.velocity, {normals.data(), holds.count}, {speeds.data(), holds.count});
  bodies_.setAcceleration(sphere, carried.acceleration);
}

// ---- On other spheres

/// Acceleration (m/s^2) at which the two are drawn into each other.
double Simulation::pull(std::uint32_t sphere, std::uint32_t other, const Vec3& normal) const {
  return -dotInOrder(normal, bodies_.accelerations[sphere] - bodies_.accelerations[other]);
}

void Simulation::grantFirstHops() {
  const double speed = 0.5 * kLeastHopTime * lengthOf(bodies_.gravity);
  for (Substance& substance : substances_)
    substance.hopAllowance = kFirstHops * 0.5 * substance.mass * speed * speed;
}

/// Adds energy that a contact has taken to what hops may give back, up to the energy of one long
/// hop.
void Simulation::allowHop(std::uint32_t sphere, double energy) {
  Substance& body = substances_[sphere];
  const double fastest = restSpeed(sphere);
  const double most = 0.125 * body.mass * fastest * fastest;
  body.hopAllowance = std::max(body.hopAllowance, std::min(body.hopAllowance + energy, most));
}

/// Change of velocity (m/s per N s) of the sphere by a slow impulse along `direction`.
Vec3 Simulation::yielding(std::uint32_t sphere, const Vec3& direction) const {
  const Substance& body = substances_[sphere];
  if (body.asleep) return Vec3::Zero();
  std::array<Vec3, Holds::kMost> normals;
  const Holds& holds = bodies_.holds[sphere];
  for (std::size_t k = 0; k < holds.count; ++k)
    normals[k] = bodies_.walls[holds.walls[k]].plane.normal;
  return carriedBy(direction, {normals.data(), holds.count}).acceleration / body.mass;
}

/// True if friction on the plane below, springs or rods dissipate the energy of a hop. Such a hop
/// needs no payment, and without hops the contacts would never end.
bool Simulation::hopsAreDamped(std::uint32_t sphere) const {
  return linked(sphere) || (!frictions_.empty() && frictions_[sphere].sliding > 0.0);
}

/// Rebound speed in m/s of a pair that is drawn together: the speed of a hop if there is energy for
/// it.
double Simulation::restingRebound(const Pair& pair, double effectiveMass) {
  const double drawn = pull(pair.sphere, pair.other, pair.normal);
  if (drawn <= 0.0) return pair.approachSpeed;
  Substance& one = substances_[pair.sphere];
  Substance& two = substances_[pair.other];
  const bool rubbed = hopsAreDamped(pair.sphere) || hopsAreDamped(pair.other);
  const double least = 0.5 * (rubbed ? kRubbedHopTime : kLeastHopTime) * drawn;
  const double longest = 0.5 * std::max(restSpeed(pair.sphere), restSpeed(pair.other));
  for (const double hop : {std::min(longest, 0.5 * kHopTime * drawn), least}) {
    if (pair.approachSpeed >= hop) return pair.approachSpeed;
    const double needed =
        0.5 * effectiveMass * (hop - pair.approachSpeed) * (hop + pair.approachSpeed);
    if (needed > one.hopAllowance + two.hopAllowance) {
      if (rubbed && hop == least) return hop;
      continue;
    }
    const double paid = std::min(needed, one.hopAllowance);
    one.hopAllowance -= paid;
    two.hopAllowance -= needed - paid;
    return hop;
  }
  return pair.approachSpeed;
}

/// Speed in m/s below which contacts of the sphere are rest.
double Simulation::restSpeed(std::uint32_t sphere) const {
  return substances_[sphere].collapsed ? std::max(restSpeed_, kCollapseRestSpeed) : restSpeed_;
}

/// Keeps track of calm and of rapid contacts; returns true if the sphere has just collapsed.
bool Simulation::noteContact(std::uint32_t sphere, const Motion& motion) {
  Substance& body = substances_[sphere];
  if (body.asleep) return false;
  const Vec3 moved = motion.position - body.calmPlace;
  const double drift = kCalmDrift * restSpeed(sphere) * kCalmTime;
  const bool calm = body.calmSince != kNever && dotInOrder(moved, moved) <= drift * drift;
  if (!calm && !linked(sphere)) {  // linked spheres never sleep
    body.calmSince = now_.seconds;
    body.calmPlace = motion.position;
  }
  const double interval = elapsed(bodies_.motions[sphere].since, now_);
  const bool rapid = interval < kCollapseInterval;
  body.rapidContacts = rapid ? static_cast<std::uint16_t>(body.rapidContacts + 1) : 0;
  if (!rapid || body.rapidContacts % kCollapseRun != 0) return false;
  ++counters_.collapses;
  body.collapsed = true;
  body.hopAllowance = 0.125 * body.mass * restSpeed(sphere) * restSpeed(sphere);
  if (body.rapidContacts == kCrushRun) {
    body.rapidContacts = kCrushRun - kCollapseRun;
    giveUp(sphere, interval);
  }
  return true;
}

/// Gives up a sphere whose contacts leave it no time between them, the last one `interval` s,
/// though it has been stopped. If surfaces move or it is linked, it is jammed: nothing touches it
/// any more. Otherwise it is put to sleep.
void Simulation::giveUp(std::uint32_t sphere, double interval) {
  const bool pressed = std::ranges::any_of(
      bodies_.walls, [](const Wall& wall) { return wall.speed != 0.0 || wall.oscillates(); });
  if (interval >= (pressed ? kCrushInterval : kStuckInterval)) return;
  if (pressed || linked(sphere)) {
    ++counters_.jammed;
    scheduler_.remove(sphere);
  } else {
    ++counters_.laidDown;
  }
  substances_[sphere].asleep = !linked(sphere);  // it stays where it is
}

/// Stops a sphere that has collapsed in rest contacts: it has no room left to move in, and may
/// sleep at once.
void Simulation::stop(std::uint32_t sphere, Motion& motion) {
  if (bodies_.gravity == Vec3::Zero()) return;
  motion.velocity.setZero();
  substances_[sphere].calmSince = now_.seconds - kCalmTime;
}

// ---- Sleep

/// Largest gap in m between two bodies that count as touching, to allow for their hops.
double Simulation::touchingGap(double radius) const {
  const double speed = std::max(restSpeed_, kCollapseRestSpeed);
  return std::min(0.01 * radius, speed * speed / lengthOf(bodies_.gravity)) + 1e-9 * radius;
}

bool Simulation::touches(std::uint32_t sphere, const Vec3& position, std::uint32_t other) const {
  const double radius = bodies_.radii[sphere];
  const double otherRadius = bodies_.radii[other];
  const double reach = radius + otherRadius + touchingGap(std::min(radius, otherRadius));
  const Vec3 separation = position - bodies_.at(other, now_).position;
  return dotInOrder(separation, separation) <= reach * reach;
}

/// The calm spheres that are connected with this one by touching calm spheres, in ascending order,
/// this one among them.
std::vector<std::uint32_t> Simulation::calmNeighbours(std::uint32_t sphere) const {
  std::vector<std::uint32_t> found{sphere};
  for (std::size_t next = 0; next < found.size(); ++next) {
    const std::uint32_t at = found[next];
    const Vec3 position = bodies_.at(at, now_).position;
    scheduler_.visitNear(at, position, touchingGap(bodies_.radii[at]), [&](std::uint32_t other) {
      const Substance& body = substances_[other];
      if (!body.asleep && now_.seconds - body.calmSince >= 0.5 * kCalmTime &&
          touches(at, position, other) && std::ranges::find(found, other) == found.end())
        found.push_back(other);
    });
  }
  std::ranges::sort(found);
  return found;
}

/// True if the sphere is carried by walls and boxes at rest, and by sleeping spheres and candidates
/// (in ascending order) that it touches.
bool Simulation::carried(std::uint32_t sphere, std::span<const std::uint32_t> candidates) const {
  std::array<Vec3, kMostSurfaces> normals;
  std::size_t count = 0;
  const Vec3 position = bodies_.at(sphere, now_).position;
  const double gap = touchingGap(bodies_.radii[sphere]);
  for (const Wall& wall : std::span(bodies_.walls).first(bodies_.steady)) {
    if (count == normals.size() || wall.speed != 0.0) continue;
    if (bodies_.height(sphere, wall, position, now_) <= gap) normals[count++] = wall.plane.normal;
  }
  for (const Solid& solid : bodies_.solids) {
    if (count == normals.size() || solid.box.velocity != Vec3::Zero()) continue;
    const BoxNearest nearest = bodies_.nearest(solid, position, now_);
    if (nearest.distance - bodies_.radii[sphere] <= gap)
      normals[count++] = solid.toWorld(nearest.normal);
  }
  scheduler_.visitNear(sphere, position, gap, [&](std::uint32_t other) {
    if (count == normals.size() || !touches(sphere, position, other)) return;
    if (!substances_[other].asleep && !std::ranges::binary_search(candidates, other)) return;
    const Vec3 separation = position - bodies_.at(other, now_).position;
    normals[count++] = separation / lengthOf(separation);
  });
  const Vec3 left = carriedBy(bodies_.gravity, {normals.data(), count}).acceleration;
  return lengthOf(left) <= kSleepPull * lengthOf(bodies_.gravity);
}

/// True if the sphere rests on walls without the help of other spheres.
bool Simulation::carriedByWalls(std::uint32_t sphere) const {
  return bodies_.holds[sphere].count > 0 && bodies_.accelerations[sphere] == Vec3::Zero();
}

void Simulation::trySleep(std::uint32_t sphere) {
  Substance& body = substances_[sphere];
  if (body.asleep || !(now_.seconds - body.calmSince >= kCalmTime)) return;
  if (bodies_.gravity == Vec3::Zero() || carriedByWalls(sphere)) return;
  std::vector<std::uint32_t> candidates = calmNeighbours(sphere);
  for (bool dropped = true; dropped;) {  // until the remaining spheres carry each other
    // Not std::ranges::partition: Clang 14 does not compile that of libstdc++ 12.
    const auto fallen =
        std::partition(candidates.begin(), candidates.end(),
                       [&, all = candidates](std::uint32_t at) { return carried(at, all); });
    dropped = fallen != candidates.end();
    candidates.erase(fallen, candidates.end());
    std::ranges::sort(candidates);
  }
  if (!std::ranges::binary_search(candidates, sphere))
    body.calmSince = now_.seconds - kCalmTime + kRetryTime;
  for (const std::uint32_t at : candidates)
    layDown(at);
}

void Simulation::layDown(std::uint32_t sphere) {
  ++counters_.laidDown;
  substances_[sphere].asleep = true;
  Motion motion = bodies_.at(sphere, now_);
  motion.velocity.setZero();
  leave(sphere, motion);
}

/// Wakes the sphere, and those that sleep on it if nothing else carries them.
void Simulation::wake(std::uint32_t sphere) {
  if (!substances_[sphere].asleep) return;
  std::vector<std::uint32_t> woken{sphere};
  while (!woken.empty()) {
    const std::uint32_t at = woken.back();
    woken.pop_back();
    Substance& body = substances_[at];
    if (!body.asleep) continue;
    ++counters_.woken;
    body.asleep = false;
    body.calmSince = kNever;
    leave(at, bodies_.at(at, now_));
    const Vec3 position = bodies_.motions[at].position;
    scheduler_.visitNear(at, position, touchingGap(bodies_.radii[at]), [&](std::uint32_t other) {
      if (substances_[other].asleep && touches(at, position, other) && !carried(other, {}))
        woken.push_back(other);
    });
  }
}

}  // namespace carom::native
