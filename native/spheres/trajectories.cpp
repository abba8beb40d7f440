#include "native/spheres/trajectories.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "native/math/sort_unique.h"
#include "native/math/vector_math.h"
#include "native/mechanics/resting.h"

namespace carom::native {
namespace {

constexpr double kHeldSpeed = 1e-12;  ///< relative to the speed: less along a normal is rounding

/// Walls that hold a sphere, with their normals and their speeds (m/s) along these.
struct HoldingWalls {
  std::array<std::uint32_t, Holds::kMost> walls{};
  std::array<Vec3, Holds::kMost> normals;
  std::array<double, Holds::kMost> speeds{};
  std::uint32_t count = 0;

  void add(std::uint32_t wall, const Vec3& normal, double speed) {
    walls[count] = wall;
    normals[count] = normal;
    speeds[count++] = speed;
  }
};

/// The holding walls that the sphere, at this velocity, neither leaves nor runs into.
HoldingWalls keptWalls(const Bodies& bodies, const Holds& holds, const Vec3& velocity) {
  HoldingWalls kept;
  for (const std::uint32_t index : holds.all()) {
    const Wall& wall = bodies.walls[index];
    const double speed = dotInOrder(wall.plane.normal, velocity);
    const double rounding = kHeldSpeed * (lengthOf(velocity) + std::abs(wall.speed));
    if (std::abs(speed - wall.speed) <= rounding) kept.add(index, wall.plane.normal, wall.speed);
  }
  return kept;
}

}  // namespace

Trajectories::Trajectories(const Parts& parts)
    : bodies_(parts.bodies),
      properties_(parts.properties),
      linkage_(parts.linkage),
      scheduler_(parts.scheduler),
      ledger_(parts.ledger),
      recorder_(parts.recorder) {
  if (linkage_.groupCount() > 0) freeAccelerations_.assign(bodies_.count(), bodies_.gravity);
  if (!properties_.hasFriction()) return;
  spins_.resize(bodies_.count());
  for (std::size_t sphere = 0; sphere < spins_.size(); ++sphere)
    spins_[sphere].velocity = properties_.friction(sphere).spin;
}

void Trajectories::begin() {
  for (std::uint32_t group = 0; group < linkage_.groupCount(); ++group) {
    restarts_.push_back(group);
    settleGroup(group);
  }
  ledger_.open();
  restartGroups();
  changed_.clear();
  for (std::uint32_t sphere = 0; sphere < bodies_.count(); ++sphere)
    scheduler_.predict(sphere, now_);
}

std::vector<Motion> Trajectories::groupMotions(std::uint32_t group, const Instant& instant) const {
  std::vector<Motion> motions;
  for (const std::uint32_t member : linkage_.members(group))
    motions.push_back(bodies_.at(member, instant));
  return motions;
}

Vec3 Trajectories::spin(std::size_t sphere, const Instant& instant) const {
  if (spins_.empty()) return Vec3::Zero();
  const Spin& spin = spins_[sphere];
  return spin.velocity + elapsed(bodies_.motions[sphere].since, instant) * spin.acceleration;
}

// ---- Changes

void Trajectories::changeMotion(std::uint32_t sphere, const Motion& motion) {
  (void)rebase(sphere, motion);
  if (isLinked(sphere)) restarts_.push_back(linkage_.groupOf(sphere));
}

/// Changes the motion without a new step of the sphere's group. Returns how long (s) it goes on so:
/// see `roll`.
double Trajectories::rebase(std::uint32_t sphere, const Motion& motion) {
  if (!spins_.empty()) spins_[sphere] = {spin(sphere, motion.since), Vec3::Zero()};
  const Motion before = bodies_.at(sphere, motion.since);
  if (bodies_.accelerations[sphere] != bodies_.gravity) ledger_.recordForces(sphere, before);
  bodies_.motions[sphere] = motion;
  moveAlongWalls(sphere);
  const double lasts = roll(sphere);
  ledger_.recordChange(sphere, before.velocity, bodies_.motions[sphere].velocity);
  scheduler_.forget(sphere);
  changed_.push_back(sphere);
  return lasts;
}

/// Releases the walls that the sphere leaves or runs into at its new velocity, and sets its
/// velocity and acceleration along the others. A sleeping sphere stands still.
void Trajectories::moveAlongWalls(std::uint32_t sphere) {
  Motion& motion = bodies_.motions[sphere];
  if (bodies_.isAsleep(sphere)) {
    motion.velocity.setZero();
    bodies_.setAcceleration(sphere, Vec3::Zero());
    return;
  }
  Holds& holds = bodies_.holds[sphere];
  const Vec3 pull = freeAcceleration(sphere);
  if (holds.count == 0) {
    bodies_.setAcceleration(sphere, pull);
    return;
  }
  const HoldingWalls kept = keptWalls(bodies_, holds, motion.velocity);
  const Carried carried = carriedBy(pull, {kept.normals.data(), kept.count});
  HoldingWalls touching;
  for (std::uint32_t k = 0; k < kept.count; ++k) {
    if ((carried.touching >> k & 1U) != 0)
      touching.add(kept.walls[k], kept.normals[k], kept.speeds[k]);
  }
  holds.walls = touching.walls;
  holds.count = touching.count;
  motion.velocity = heldVelocity(motion.velocity, {touching.normals.data(), touching.count},
                                 {touching.speeds.data(), touching.count});
  bodies_.setAcceleration(sphere, carried.acceleration);
}

void Trajectories::hold(std::uint32_t sphere, std::uint32_t wall, Motion& motion) {
  Holds& holds = bodies_.holds[sphere];
  if (holds.count < Holds::kMost) {
    holds.walls[holds.count++] = wall;
  } else {  // between so many walls nothing moves
    holds.walls.back() = wall;
    motion.velocity.setZero();
  }
}

/// Sets the motion of a sphere along the one plane that holds it: sliding, rolling, or still.
/// Returns the time (s) after which that becomes another.
double Trajectories::roll(std::uint32_t sphere) {
  if (spins_.empty()) return kNever;
  Spin& spin = spins_[sphere];
  if (!isLinked(sphere)) scheduler_.setTurn(sphere, Instant::never());
  if (bodies_.isAsleep(sphere)) spin.velocity.setZero();
  const Holds& holds = bodies_.holds[sphere];
  if (holds.count != 1 || linkage_.hasRods(sphere) || bodies_.isAsleep(sphere)) return kNever;
  const Plane& plane = bodies_.walls[holds.walls[0]].plane;
  RollingContact contact;
  contact.sliding = properties_.slidingFriction(sphere, plane);
  if (contact.sliding == 0.0) return kNever;
  contact.normal = plane.normal;
  contact.radius = bodies_.radii[sphere];
  contact.support = std::max(-bodies_.alongNormal(plane.normal, freeAcceleration(sphere)), 0.0);
  if (contact.support == 0.0) return kNever;  // it is not pressed against this wall
  contact.pull = bodies_.accelerations[sphere];
  contact.rolling = properties_.friction(sphere).rolling;
  contact.pivoting = properties_.friction(sphere).pivoting;
  Motion& motion = bodies_.motions[sphere];
  const RollingCourse course =
      rollingCourse(contact, motion.velocity - plane.velocity, spin.velocity);
  motion.velocity = course.velocity + plane.velocity;
  spin = course.spin;
  bodies_.setAcceleration(sphere, course.acceleration);
  if (!isLinked(sphere)) scheduler_.setTurn(sphere, after(now_, course.duration));
  return course.duration;
}

void Trajectories::turn(std::uint32_t sphere) {
  if (isLinked(sphere)) {
    restarts_.push_back(linkage_.groupOf(sphere));
  } else {
    changeMotion(sphere, motion(sphere));
  }
}

void Trajectories::predictChanged() {
  if (!restarts_.empty()) restartGroups();
  sortUnique(changed_);
  for (const std::uint32_t sphere : changed_) {
    recorder_.addMotion(sphere);
    scheduler_.predict(sphere, now_);
  }
  changed_.clear();
}

// ---- Springs, rods and fields

void Trajectories::restartGroups() {
  sortUnique(restarts_);
  for (const std::uint32_t group : restarts_)
    restartGroup(group);
  restarts_.clear();
}

/// Begins a new step of the group at now().
void Trajectories::restartGroup(std::uint32_t group) {
  const std::span<const std::uint32_t> members = linkage_.members(group);
  const std::vector<Motion> motions = groupMotions(group, now_);
  const Linkage::Step step = linkage_.step(group, motions);
  for (std::size_t i = 0; i < members.size(); ++i) {
    freeAccelerations_[members[i]] = step.accelerations[i];
    const double lasts = rebase(members[i], motions[i]);
    scheduler_.setTurn(members[i], after(now_, std::min(step.duration, lasts)));
  }
}

void Trajectories::settleRods(std::span<const std::uint32_t> spheres) {
  std::vector<std::uint32_t> groups;
  for (const std::uint32_t sphere : spheres) {
    if (linkage_.hasRods(sphere)) groups.push_back(linkage_.groupOf(sphere));
  }
  sortUnique(groups);
  for (const std::uint32_t group : groups)
    settleGroup(group);
}

void Trajectories::settleGroup(std::uint32_t group) {
  const std::span<const std::uint32_t> members = linkage_.members(group);
  if (!linkage_.hasRods(members.front())) return;
  std::vector<Motion> motions = groupMotions(group, now_);
  std::vector<Vec3> momenta;
  for (std::size_t i = 0; i < members.size(); ++i)
    momenta.push_back(properties_.mass(members[i]) * motions[i].velocity);
  const std::vector<Vec3> velocities = linkage_.response(group, motions, momenta);
  for (std::size_t i = 0; i < members.size(); ++i) {
    motions[i].velocity = velocities[i];
    changeMotion(members[i], motions[i]);
  }
}

}  // namespace carom::native
