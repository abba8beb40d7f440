// The part of Simulation for springs, rods and fields, which bend the paths of spheres, and for
// friction and spin, which turn them.

#include <algorithm>
#include <cmath>

#include "native/spheres/simulation.h"

namespace carom::native {
namespace {

/// Coulomb's coefficient (1) of a pair: the geometric mean, as for restitutions.
double combinedFriction(double friction, double otherFriction) {
  return std::sqrt(friction * otherFriction);
}

std::size_t memberIndex(std::uint32_t sphere, std::span<const std::uint32_t> members) {
  return static_cast<std::size_t>(std::ranges::lower_bound(members, sphere) - members.begin());
}

}  // namespace

/// Stores only mechanics that the world has: vectors stay empty otherwise.
void Simulation::takeMechanics(const SphereWorld& world) {
  if (linkage_.groupCount() > 0) pulls_.assign(sphereCount(), bodies_.gravity);
  for (std::uint32_t group = 0; group < linkage_.groupCount(); ++group)
    restarts_.push_back(group);
  const auto isLawful = [](const auto& body) {
    return body.restitutionLaw.law != SpeedLaw::constant;
  };
  const bool lawful = std::ranges::any_of(world.spheres, isLawful) ||
                      std::ranges::any_of(world.planes, isLawful) ||
                      std::ranges::any_of(world.boxes, isLawful);
  const bool spinning = std::ranges::any_of(world.spheres, [](const Sphere& sphere) {
    return sphere.friction.sliding > 0.0 || sphere.friction.spin != Vec3::Zero();
  });
  if (lawful) laws_.resize(sphereCount());
  if (spinning) spins_.resize(sphereCount());
  if (spinning) frictions_.resize(sphereCount());
  for (std::size_t listed = 0; listed < world.spheres.size(); ++listed) {
    const Sphere& sphere = world.spheres[listed];
    if (lawful) laws_[order_[listed]] = sphere.restitutionLaw;
    if (spinning) spins_[order_[listed]].velocity = sphere.friction.spin;
    if (spinning) frictions_[order_[listed]] = sphere.friction;
  }
}

double Simulation::wallRestitution(std::uint32_t sphere, const Plane& plane,
                                   double approachSpeed) const {
  const Substance& body = substances_[sphere];
  if (laws_.empty())
    return restitutions_.of(body.surface, body.restitution, plane.surface, plane.restitution);
  return restitutions_.of(
      body.surface, restitutionAt(body.restitution, laws_[sphere], approachSpeed), plane.surface,
      restitutionAt(plane.restitution, plane.restitutionLaw, approachSpeed));
}

/// Handles a change of the sphere's motion by itself: a step of its group ends, or it begins to
/// roll, or stops.
void Simulation::turn(std::uint32_t sphere) {
  if (linked(sphere)) {
    restarts_.push_back(linkage_.groupOf(sphere));
  } else {
    leave(sphere, bodies_.at(sphere, now_));
  }
  predictChanged();
}

// ---- Springs, rods and fields

/// Acceleration (m/s^2) by everything but contacts.
Vec3 Simulation::pullOn(std::uint32_t sphere) const {
  return linked(sphere) ? pulls_[sphere] : bodies_.gravity;
}

std::vector<Motion> Simulation::motionsOf(std::uint32_t group, const Instant& instant) const {
  std::vector<Motion> motions;
  for (const std::uint32_t member : linkage_.members(group))
    motions.push_back(bodies_.at(member, instant));
  return motions;
}

void Simulation::restartGroups() {
  std::ranges::sort(restarts_);
  restarts_.erase(std::unique(restarts_.begin(), restarts_.end()), restarts_.end());
  for (const std::uint32_t group : restarts_)
    restartGroup(group);
  restarts_.clear();
}

/// Begins a new step of the group at now_.
void Simulation::restartGroup(std::uint32_t group) {
  const std::span<const std::uint32_t> members = linkage_.members(group);
  const std::vector<Motion> motions = motionsOf(group, now_);
  const double step = linkage_.step(group, motions);
  const std::vector<Vec3> pulls = linkage_.accelerations(group, motions, step);
  for (std::size_t i = 0; i < members.size(); ++i) {
    pulls_[members[i]] = pulls[i];
    rebase(members[i], motions[i]);
    scheduler_.setTurn(members[i], after(now_, step));
  }
}

/// Returns the effect of 1 N s between the two on them, and on all spheres that rods connect with
/// them.
Simulation::Give Simulation::giveOf(const Pair& pair) const {
  Give give;
  const bool alone = pair.other == EventScheduler::kNobody;
  const std::uint32_t group = linkage_.groupOf(pair.sphere);
  const std::uint32_t otherGroup = alone ? Linkage::kNoGroup : linkage_.groupOf(pair.other);
  const auto respond = [&](std::uint32_t of, bool first, bool second) {
    const std::span<const std::uint32_t> members = linkage_.members(of);
    std::vector<Vec3> impulses(members.size(), Vec3::Zero());
    if (first) impulses[memberIndex(pair.sphere, members)] += pair.normal;
    if (second) impulses[memberIndex(pair.other, members)] -= pair.normal;
    const std::vector<Vec3> changes = linkage_.response(of, motionsOf(of, now_), impulses);
    for (std::size_t i = 0; i < members.size(); ++i) {
      if (members[i] == pair.sphere) {
        give.yield = changes[i];
      } else if (members[i] == pair.other) {
        give.otherYield = changes[i];
      } else {
        give.others.emplace_back(members[i], changes[i]);
      }
    }
  };
  const bool rods = linkage_.hasRods(pair.sphere);
  const bool otherRods = !alone && linkage_.hasRods(pair.other);
  const bool together = rods && otherRods && group == otherGroup;
  if (rods) respond(group, true, together);
  if (otherRods && !together) respond(otherGroup, false, true);
  if (!rods) give.yield = yielding(pair.sphere, pair.normal);
  if (!alone && !otherRods) give.otherYield = yielding(pair.other, -pair.normal);
  return give;
}

/// Applies an impulse to the other spheres that rods connect with the pair.
void Simulation::drag(const Give& give, double impulse) {
  for (const auto& [member, change] : give.others) {
    Motion motion = bodies_.at(member, now_);
    motion.velocity += impulse * change;
    leave(member, motion);
  }
}

// ---- Friction and spin

Vec3 Simulation::spinAt(std::size_t sphere, const Instant& instant) const {
  if (spins_.empty()) return Vec3::Zero();
  const Spin& spin = spins_[sphere];
  return spin.velocity + elapsed(bodies_.motions[sphere].since, instant) * spin.acceleration;
}

/// Applies friction in an impact of two spheres.
void Simulation::rub(const Pair& pair, double impulse, Motion& motion, Motion& otherMotion) {
  if (spins_.empty()) return;
  const auto massOf = [&](std::uint32_t sphere) { return substances_[sphere].mass; };
  const auto inverseMass = [&](std::uint32_t sphere) {
    return substances_[sphere].asleep ? 0.0 : 1.0 / massOf(sphere);
  };
  FrictionContact contact;
  contact.normal = pair.normal;
  contact.velocity = pair.motion.velocity - pair.otherMotion.velocity;
  contact.spin = spinAt(pair.sphere, now_);
  contact.radius = bodies_.radii[pair.sphere];
  contact.inverseMass = inverseMass(pair.sphere);
  contact.otherSpin = spinAt(pair.other, now_);
  contact.otherRadius = bodies_.radii[pair.other];
  contact.otherInverseMass = inverseMass(pair.other);
  contact.friction =
      combinedFriction(frictions_[pair.sphere].sliding, frictions_[pair.other].sliding);
  if (contact.friction == 0.0) return;
  const Vec3 rubbing = frictionImpulse(contact, impulse);
  motion.velocity += contact.inverseMass * rubbing;
  otherMotion.velocity -= contact.otherInverseMass * rubbing;
  // Opposite impulses at opposite arms turn both the same way.
  if (contact.inverseMass > 0.0)
    spins_[pair.sphere].velocity +=
        spinChange(-contact.radius * contact.normal, rubbing, massOf(pair.sphere), contact.radius);
  if (contact.otherInverseMass > 0.0)
    spins_[pair.other].velocity += spinChange(-contact.otherRadius * contact.normal, rubbing,
                                              massOf(pair.other), contact.otherRadius);
}

void Simulation::rubOnWall(std::uint32_t sphere, const Plane& plane, double impulse,
                           Motion& motion) {
  if (spins_.empty() || linkage_.hasRods(sphere)) return;
  const double mass = substances_[sphere].mass;
  FrictionContact contact;
  contact.normal = plane.normal;
  contact.velocity = motion.velocity - plane.velocity;
  contact.spin = spinAt(sphere, now_);
  contact.radius = bodies_.radii[sphere];
  contact.inverseMass = 1.0 / mass;
  contact.friction = combinedFriction(frictions_[sphere].sliding, plane.friction);
  const Vec3 rubbing = frictionImpulse(contact, impulse);
  motion.velocity += rubbing / mass;
  spins_[sphere].velocity +=
      spinChange(-contact.radius * contact.normal, rubbing, mass, contact.radius);
}

/// Sets the motion of a sphere along the one plane that holds it: sliding, rolling, or still.
void Simulation::roll(std::uint32_t sphere) {
  if (spins_.empty()) return;
  Spin& spin = spins_[sphere];
  if (!linked(sphere)) scheduler_.setTurn(sphere, Instant::never());
  if (substances_[sphere].asleep) spin.velocity.setZero();
  const Holds& holds = bodies_.holds[sphere];
  if (holds.count != 1 || linked(sphere) || substances_[sphere].asleep) return;
  const Plane& plane = bodies_.walls[holds.walls[0]].plane;
  RollingContact contact;
  contact.sliding = combinedFriction(frictions_[sphere].sliding, plane.friction);
  if (contact.sliding == 0.0) return;
  contact.normal = plane.normal;
  contact.radius = bodies_.radii[sphere];
  contact.support = std::max(-bodies_.alongNormal(plane.normal, bodies_.gravity), 0.0);
  if (contact.support == 0.0) return;  // it is not pressed against this wall
  contact.pull = bodies_.accelerations[sphere];
  contact.rolling = frictions_[sphere].rolling;
  contact.pivoting = frictions_[sphere].pivoting;
  Motion& motion = bodies_.motions[sphere];
  const RollingCourse course =
      rollingCourse(contact, motion.velocity - plane.velocity, spin.velocity);
  motion.velocity = course.velocity + plane.velocity;
  spin = course.spin;
  bodies_.setAcceleration(sphere, course.acceleration);
  scheduler_.setTurn(sphere, after(now_, course.duration));
}

}  // namespace carom::native
