// The part of Simulation for several contacts at one instant: SphereStepper documents it under
// Simultaneous contacts.

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "native/math/contact_time.h"
#include "native/math/vector_math.h"
#include "native/mechanics/cluster_hertz.h"
#include "native/spheres/simulation.h"

namespace carom::native {
namespace {

constexpr double kTouching = 1e-9;  ///< relative to the smaller radius; documented in Simultaneous
constexpr std::size_t kRoundsPerContact = 100;  ///< rounds of a cluster that count as one contact

std::uint32_t placeIn(const std::vector<std::uint32_t>& sorted, std::uint32_t value) {
  return static_cast<std::uint32_t>(std::ranges::lower_bound(sorted, value) - sorted.begin());
}

void sortUnique(std::vector<std::uint32_t>& values) {
  std::ranges::sort(values);
  values.erase(std::unique(values.begin(), values.end()), values.end());
}

}  // namespace

/// The cluster of bodies that touch each other, and the result of their contacts.
struct Simulation::Cluster {
  struct Touch {
    std::uint32_t sphere = 0;   ///< the lower of two spheres
    std::uint32_t partner = 0;  ///< a sphere, or sphere count + index of a wall
    BodyId id = 0;              ///< id of the partner

    friend bool operator==(const Touch& left, const Touch& right) {
      return left.sphere == right.sphere && left.partner == right.partner;
    }
  };

  std::vector<std::uint32_t> members;    ///< spheres, ascending, then walls, numbered as partners
  std::vector<Touch> touches;            ///< in order of ids
  std::vector<Motion> motions;           ///< by member; for a wall only the velocity
  std::vector<ClusterBody> before;       ///< by member
  std::vector<ClusterBody> after;        ///< by member
  std::vector<ClusterContact> contacts;  ///< by touch
  std::vector<double> approachSpeeds;    ///< m/s, by touch
  ClusterImpulses impulses;              ///< by touch

  double effectiveMass(std::size_t touch) const {
    const ClusterContact& contact = contacts[touch];
    return 1.0 / (1.0 / before[contact.body].mass + 1.0 / before[contact.other].mass);
  }
  /// Approach speed in m/s at which a pair by itself would need this impulse.
  double speedFor(std::size_t touch) const {
    return impulses.along[touch] / ((1.0 + contacts[touch].restitution) * effectiveMass(touch));
  }
};

/// Resolves the contact together with the cluster that touches it; false if there is no other
/// contact.
bool Simulation::resolveCluster(std::uint32_t sphere, std::uint32_t partner) {
  for (;;) {
    Cluster cluster = clusterAt(sphere, partner);
    if (cluster.touches.size() < 2) return false;
    describe(cluster);
    cluster.after = cluster.before;
    cluster.impulses = stiffnesses_.empty() ? reflectCluster(cluster.after, cluster.contacts)
                                            : followHertz(cluster.after, cluster.contacts);
    if (wakeHit(cluster)) continue;  // the spheres that woke yield now
    return applyCluster(cluster);
  }
}

Simulation::Cluster Simulation::clusterAt(std::uint32_t sphere, std::uint32_t partner) const {
  Cluster cluster;
  cluster.members = {sphere};
  cluster.touches = {{sphere, partner, 0}};
  if (partner < sphereCount() && !substances_[partner].asleep) cluster.members.push_back(partner);
  if (substances_[sphere].asleep) std::swap(cluster.members.front(), cluster.members.back());
  gather(cluster);
  for (Cluster::Touch& touch : cluster.touches) {
    touch.id = touch.partner < sphereCount()
                   ? bodies_.ids[touch.partner]
                   : bodies_.walls[touch.partner - sphereCount()].plane.id;
    cluster.members.push_back(touch.sphere);
    cluster.members.push_back(touch.partner);
  }
  sortUnique(cluster.members);
  std::ranges::sort(cluster.touches, [](const Cluster::Touch& left, const Cluster::Touch& right) {
    return left.sphere != right.sphere ? left.sphere < right.sphere : left.id < right.id;
  });
  cluster.touches.erase(std::unique(cluster.touches.begin(), cluster.touches.end()),
                        cluster.touches.end());
  return cluster;
}

/// Collects the cluster from touch to touch. A sleeping sphere belongs to it, but does not pass
/// anything on.
void Simulation::gather(Cluster& cluster) const {
  std::vector<bool> found(sphereCount(), false);
  for (const std::uint32_t member : cluster.members)
    found[member] = true;
  for (std::size_t next = 0; next < cluster.members.size(); ++next) {
    const std::uint32_t at = cluster.members[next];
    if (substances_[at].asleep) continue;
    const Vec3 position = bodies_.at(at, now_).position;
    const double reach = kTouching * bodies_.radii[at];
    for (std::uint32_t index = 0; index < bodies_.steady; ++index) {
      if (bodies_.height(at, bodies_.walls[index], position, now_) <= reach)
        cluster.touches.push_back({at, static_cast<std::uint32_t>(sphereCount() + index), 0});
    }
    scheduler_.visitNear(at, position, reach, [&](std::uint32_t other) {
      if (!meets(at, position, other)) return;
      cluster.touches.push_back({std::min(at, other), std::max(at, other), 0});
      if (found[other] || substances_[other].asleep) return;
      found[other] = true;
      cluster.members.push_back(other);
    });
  }
}

bool Simulation::meets(std::uint32_t sphere, const Vec3& position, std::uint32_t other) const {
  const double radius = bodies_.radii[sphere];
  const double otherRadius = bodies_.radii[other];
  const double reach = radius + otherRadius + kTouching * std::min(radius, otherRadius);
  const Vec3 separation = position - bodies_.at(other, now_).position;
  return dotInOrder(separation, separation) <= reach * reach;
}

/// Describes the cluster for reflectCluster and followHertz.
void Simulation::describe(Cluster& cluster) const {
  for (const std::uint32_t member : cluster.members) {
    ClusterBody& body = cluster.before.emplace_back();
    body.mass = kNever;
    Motion& motion = cluster.motions.emplace_back();
    if (member < sphereCount()) {
      motion = bodies_.at(member, now_);
      if (!substances_[member].asleep) body.mass = substances_[member].mass;
    } else {
      const Wall& wall = bodies_.walls[member - sphereCount()];
      motion.velocity = wall.speed * wall.plane.normal;
    }
    body.velocity = motion.velocity;
  }
  double fastest = 0.0;
  for (const Cluster::Touch& touch : cluster.touches) {
    ClusterContact& contact = cluster.contacts.emplace_back();
    contact.body = placeIn(cluster.members, touch.sphere);
    contact.other = placeIn(cluster.members, touch.partner);
    const Motion& motion = cluster.motions[contact.body];
    const Motion& other = cluster.motions[contact.other];
    if (touch.partner < sphereCount()) {
      const Vec3 separation = motion.position - other.position;
      contact.normal = separation / lengthOf(separation);
    } else {
      contact.normal = bodies_.walls[touch.partner - sphereCount()].plane.normal;
    }
    cluster.approachSpeeds.push_back(-dotInOrder(contact.normal, motion.velocity - other.velocity));
    fastest = std::max(fastest, cluster.approachSpeeds.back());
  }
  for (std::size_t at = 0; at < cluster.touches.size(); ++at) {
    const Cluster::Touch& touch = cluster.touches[at];
    const double approach = cluster.approachSpeeds[at];
    ClusterContact& contact = cluster.contacts[at];
    contact.restitution =
        clusterRestitution(touch.sphere, touch.partner, approach > 0.0 ? approach : fastest);
    if (!stiffnesses_.empty()) contact.stiffness = hertzStiffness(touch.sphere, touch.partner);
  }
}

/// Restitution of a contact in a cluster; `approachSpeed` is that of the cluster's fastest contact
/// if the two only touch.
double Simulation::clusterRestitution(std::uint32_t sphere, std::uint32_t partner,
                                      double approachSpeed) const {
  if (partner < sphereCount()) return restitutionOf(sphere, partner, approachSpeed);
  const Plane& plane = bodies_.walls[partner - sphereCount()].plane;
  const double restitution = wallRestitution(sphere, plane, approachSpeed);
  return approachSpeed < restSpeed(sphere) && restitution < 1.0 ? 0.0 : restitution;
}

/// Hertz stiffness in N / m^1.5: 4/3 E* sqrt(R) (Johnson 1985, section 4.2).
double Simulation::hertzStiffness(std::uint32_t sphere, std::uint32_t partner) const {
  const bool wall = partner >= sphereCount();
  const double own = stiffnesses_[sphere];
  const double others =
      wall ? bodies_.walls[partner - sphereCount()].plane.stiffness : stiffnesses_[partner];
  double radius = bodies_.radii[sphere];
  if (!wall) radius = radius * bodies_.radii[partner] / (radius + bodies_.radii[partner]);
  return 4.0 / 3.0 * (own * others / (own + others)) * std::sqrt(radius);
}

/// Wakes sleeping spheres that are hit above the wake speed; true if any woke.
bool Simulation::wakeHit(const Cluster& cluster) {
  bool any = false;
  for (std::size_t at = 0; at < cluster.touches.size(); ++at) {
    const Cluster::Touch& touch = cluster.touches[at];
    if (touch.partner >= sphereCount() || !(cluster.impulses.along[at] > 0.0)) continue;
    const double slowest = std::max(restSpeed(touch.sphere), restSpeed(touch.partner));
    if (cluster.speedFor(at) < kWakeSpeed * slowest) continue;
    any = any || substances_[touch.sphere].asleep || substances_[touch.partner].asleep;
    wake(touch.sphere);
    wake(touch.partner);
  }
  return any;
}

void Simulation::reportCluster(const Cluster& cluster) {
  for (std::size_t at = 0; at < cluster.touches.size(); ++at) {
    if (!(cluster.impulses.along[at] > 0.0)) continue;
    const Cluster::Touch& touch = cluster.touches[at];
    const ClusterContact& contact = cluster.contacts[at];
    const bool wall = touch.partner >= sphereCount();
    const double slowest = std::max(restSpeed(touch.sphere), wall ? 0.0 : restSpeed(touch.partner));
    const double speed = std::max(cluster.approachSpeeds[at], cluster.speedFor(at));
    if (speed < slowest) {
      ++counters_.restContacts;
      continue;
    }
    const Motion& motion = cluster.motions[contact.body];
    const Motion& other = cluster.motions[contact.other];
    const Vec3 point = motion.position - bodies_.radii[touch.sphere] * contact.normal;
    const Side second = wall ? wallSide(bodies_.walls[touch.partner - sphereCount()], point)
                             : sideOf(touch.partner, other);
    report(sideOf(touch.sphere, motion), second,
           {contact.normal, speed, cluster.effectiveMass(at), cluster.impulses.along[at]});
  }
}

/// Reports the collisions of the cluster, and sets the new motions of its spheres; false if nothing
/// has changed.
bool Simulation::applyCluster(const Cluster& cluster) {
  double taken = 0.0;
  std::vector<std::uint32_t> moved;  // by member
  for (std::uint32_t member = 0; member < cluster.members.size(); ++member) {
    const ClusterBody& before = cluster.before[member];
    const ClusterBody& after = cluster.after[member];
    if (!std::isfinite(before.mass) || before.velocity == after.velocity) continue;
    moved.push_back(member);
    taken += 0.5 * before.mass *
             dotInOrder(before.velocity - after.velocity, before.velocity + after.velocity);
  }
  if (moved.empty()) return false;
  reportCluster(cluster);
  // Many rounds count as many contacts: jammed spheres may need them again at once.
  const std::size_t contacts = 1 + cluster.impulses.rounds / kRoundsPerContact;
  for (const std::uint32_t member : moved) {
    const std::uint32_t sphere = cluster.members[member];
    Motion motion = cluster.motions[member];
    for (std::size_t contact = 0; contact < contacts; ++contact)
      noteContact(sphere, motion);
    allowHop(sphere, taken / static_cast<double>(moved.size()));
    motion.velocity = cluster.after[member].velocity;
    leave(sphere, motion);
  }
  std::vector<std::uint32_t> groups;
  for (const std::uint32_t member : moved) {
    if (linkage_.hasRods(cluster.members[member]))
      groups.push_back(linkage_.groupOf(cluster.members[member]));
  }
  sortUnique(groups);
  for (const std::uint32_t group : groups)
    settleRods(group);
  return true;
}

/// Lets the rods of a group take back all velocity that would change their lengths, after contacts
/// in which they have not taken part. Exact where they are at right angles to the contacts, as in a
/// cradle; otherwise energy is lost.
void Simulation::settleRods(std::uint32_t group) {
  const std::span<const std::uint32_t> members = linkage_.members(group);
  if (!linkage_.hasRods(members.front())) return;
  std::vector<Motion> motions = motionsOf(group, now_);
  std::vector<Vec3> momenta;
  for (std::size_t i = 0; i < members.size(); ++i)
    momenta.push_back(substances_[members[i]].mass * motions[i].velocity);
  const std::vector<Vec3> velocities = linkage_.response(group, motions, momenta);
  for (std::size_t i = 0; i < members.size(); ++i) {
    motions[i].velocity = velocities[i];
    leave(members[i], motions[i]);
  }
}

}  // namespace carom::native
