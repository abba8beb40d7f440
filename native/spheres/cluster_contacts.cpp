#include "native/spheres/cluster_contacts.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "native/math/contact_time.h"
#include "native/math/sort_unique.h"
#include "native/math/vector_math.h"
#include "native/mechanics/cluster_hertz.h"

namespace carom::native {
namespace {

constexpr double kTouching = 1e-9;  ///< relative to the smaller radius; documented in Simultaneous
constexpr std::size_t kRoundsPerContact = 100;  ///< rounds of a cluster that count as one contact

std::uint32_t placeIn(const std::vector<std::uint32_t>& sorted, std::uint32_t value) {
  return static_cast<std::uint32_t>(std::ranges::lower_bound(sorted, value) - sorted.begin());
}

}  // namespace

/// The cluster of bodies in contact with each other, and the result of their contacts.
struct ClusterContacts::Cluster {
  /// Two bodies in contact.
  struct Pair {
    std::uint32_t sphere = 0;   ///< the lower of two spheres
    std::uint32_t partner = 0;  ///< a sphere, or sphere count + index of a wall
    BodyId id = 0;              ///< id of the partner

    friend bool operator==(const Pair& left, const Pair& right) {
      return left.sphere == right.sphere && left.partner == right.partner;
    }
    friend bool operator<(const Pair& left, const Pair& right) {
      return left.sphere != right.sphere ? left.sphere < right.sphere : left.id < right.id;
    }
  };

  std::vector<std::uint32_t> members;    ///< spheres, ascending, then walls, numbered as partners
  std::vector<Pair> pairs;               ///< in order of ids
  std::vector<Motion> motions;           ///< by member; for a wall only the velocity
  std::vector<ClusterBody> before;       ///< by member
  std::vector<ClusterBody> after;        ///< by member
  std::vector<ClusterContact> contacts;  ///< by pair
  std::vector<double> approachSpeeds;    ///< m/s, by pair
  ClusterImpulses impulses;              ///< by pair

  double effectiveMass(std::size_t pair) const {
    const ClusterContact& contact = contacts[pair];
    return 1.0 / (1.0 / before[contact.body].mass + 1.0 / before[contact.other].mass);
  }
  /// Approach speed in m/s at which the pair by itself would need this impulse.
  double speedFor(std::size_t pair) const {
    return impulses.along[pair] / ((1.0 + contacts[pair].restitution) * effectiveMass(pair));
  }
};

ClusterContacts::ClusterContacts(const ContactParts& parts)
    : bodies_(parts.bodies),
      properties_(parts.properties),
      scheduler_(parts.scheduler),
      trajectories_(parts.trajectories),
      rest_(parts.rest),
      sleep_(parts.sleep),
      reporter_(parts.reporter) {}

bool ClusterContacts::resolveCluster(std::uint32_t sphere, std::uint32_t partner) {
  for (;;) {
    Cluster cluster = clusterAt(sphere, partner);
    if (cluster.pairs.size() < 2) return false;
    describeBodies(cluster);
    describeContacts(cluster);
    cluster.after = cluster.before;
    cluster.impulses = properties_.isHertz() ? followHertz(cluster.after, cluster.contacts)
                                             : reflectCluster(cluster.after, cluster.contacts);
    if (wakeByImpacts(cluster)) continue;  // the spheres that woke yield now
    return apply(cluster);
  }
}

// ---- Who belongs to the cluster

ClusterContacts::Cluster ClusterContacts::clusterAt(std::uint32_t sphere,
                                                    std::uint32_t partner) const {
  Cluster cluster;
  cluster.members = {sphere};
  cluster.pairs = {{sphere, partner, 0}};
  if (isSphere(partner) && !bodies_.isAsleep(partner)) cluster.members.push_back(partner);
  if (bodies_.isAsleep(sphere)) std::swap(cluster.members.front(), cluster.members.back());
  gather(cluster);
  for (Cluster::Pair& pair : cluster.pairs) {
    pair.id = isSphere(pair.partner) ? bodies_.ids[pair.partner] : wallOf(pair.partner).plane.id;
    cluster.members.push_back(pair.sphere);
    cluster.members.push_back(pair.partner);
  }
  sortUnique(cluster.members);
  sortUnique(cluster.pairs);
  return cluster;
}

/// Collects the cluster from contact to contact. A sleeping sphere belongs to it, but does not pass
/// anything on.
void ClusterContacts::gather(Cluster& cluster) const {
  std::vector<bool> found(bodies_.count(), false);
  for (const std::uint32_t member : cluster.members)
    found[member] = true;
  for (std::size_t next = 0; next < cluster.members.size(); ++next) {
    const std::uint32_t at = cluster.members[next];
    if (bodies_.isAsleep(at)) continue;
    const Vec3 position = trajectories_.motion(at).position;
    const double reach = kTouching * bodies_.radii[at];
    for (std::uint32_t index = 0; index < bodies_.steady; ++index) {
      if (bodies_.height(at, bodies_.walls[index], position, trajectories_.now()) <= reach)
        cluster.pairs.push_back({at, static_cast<std::uint32_t>(bodies_.count() + index), 0});
    }
    scheduler_.visitNear(at, position, reach, [&](std::uint32_t other) {
      if (!isInContact(at, position, other)) return;
      cluster.pairs.push_back({std::min(at, other), std::max(at, other), 0});
      if (found[other] || bodies_.isAsleep(other)) return;
      found[other] = true;
      cluster.members.push_back(other);
    });
  }
}

bool ClusterContacts::isInContact(std::uint32_t sphere, const Vec3& position,
                                  std::uint32_t other) const {
  const double radius = bodies_.radii[sphere];
  const double otherRadius = bodies_.radii[other];
  const double reach = radius + otherRadius + kTouching * std::min(radius, otherRadius);
  const Vec3 separation = position - trajectories_.motion(other).position;
  return dotInOrder(separation, separation) <= reach * reach;
}

// ---- The cluster for reflectCluster and followHertz

void ClusterContacts::describeBodies(Cluster& cluster) const {
  for (const std::uint32_t member : cluster.members) {
    ClusterBody& body = cluster.before.emplace_back();
    body.mass = kNever;  // infinite
    Motion& motion = cluster.motions.emplace_back();
    if (isSphere(member)) {
      motion = trajectories_.motion(member);
      if (!bodies_.isAsleep(member)) body.mass = properties_.mass(member);
    } else {
      const Wall& wall = wallOf(member);
      motion.velocity = wall.speed * wall.plane.normal;
    }
    body.velocity = motion.velocity;
  }
}

void ClusterContacts::describeContacts(Cluster& cluster) const {
  double fastest = 0.0;
  for (const Cluster::Pair& pair : cluster.pairs) {
    ClusterContact& contact = cluster.contacts.emplace_back();
    contact.body = placeIn(cluster.members, pair.sphere);
    contact.other = placeIn(cluster.members, pair.partner);
    const Motion& motion = cluster.motions[contact.body];
    const Motion& other = cluster.motions[contact.other];
    if (isSphere(pair.partner)) {
      const Vec3 separation = motion.position - other.position;
      contact.normal = separation / lengthOf(separation);
    } else {
      contact.normal = wallOf(pair.partner).plane.normal;
    }
    cluster.approachSpeeds.push_back(-dotInOrder(contact.normal, motion.velocity - other.velocity));
    fastest = std::max(fastest, cluster.approachSpeeds.back());
  }
  for (std::size_t at = 0; at < cluster.pairs.size(); ++at) {
    const Cluster::Pair& pair = cluster.pairs[at];
    const double approach = cluster.approachSpeeds[at];
    ClusterContact& contact = cluster.contacts[at];
    contact.restitution =
        restitution(pair.sphere, pair.partner, approach > 0.0 ? approach : fastest);
    if (properties_.isHertz()) contact.stiffness = hertzStiffness(pair.sphere, pair.partner);
  }
}

/// Restitution of a contact in a cluster; `approachSpeed` is that of the cluster's fastest contact
/// if the two do not approach.
double ClusterContacts::restitution(std::uint32_t sphere, std::uint32_t partner,
                                    double approachSpeed) const {
  if (isSphere(partner)) return properties_.restitution(sphere, partner, approachSpeed);
  const double restitution =
      properties_.wallRestitution(sphere, wallOf(partner).plane, approachSpeed);
  return approachSpeed < rest_.restSpeed(sphere) && restitution < 1.0 ? 0.0 : restitution;
}

/// Hertz stiffness in N / m^1.5: 4/3 E* sqrt(R) (Johnson 1985, section 4.2).
double ClusterContacts::hertzStiffness(std::uint32_t sphere, std::uint32_t partner) const {
  const double own = properties_.stiffness(sphere);
  const double others =
      isSphere(partner) ? properties_.stiffness(partner) : wallOf(partner).plane.stiffness;
  double radius = bodies_.radii[sphere];
  if (isSphere(partner))
    radius = radius * bodies_.radii[partner] / (radius + bodies_.radii[partner]);
  return 4.0 / 3.0 * (own * others / (own + others)) * std::sqrt(radius);
}

// ---- What follows from the impulses

/// Wakes sleeping spheres that are hit above the wake speed; true if any woke.
bool ClusterContacts::wakeByImpacts(const Cluster& cluster) {
  bool any = false;
  for (std::size_t at = 0; at < cluster.pairs.size(); ++at) {
    const Cluster::Pair& pair = cluster.pairs[at];
    if (!isSphere(pair.partner) || !(cluster.impulses.along[at] > 0.0)) continue;
    if (cluster.speedFor(at) < kWakeSpeed * rest_.restSpeed(pair.sphere, pair.partner)) continue;
    any = any || bodies_.isAsleep(pair.sphere) || bodies_.isAsleep(pair.partner);
    sleep_.wake(pair.sphere);
    sleep_.wake(pair.partner);
  }
  return any;
}

void ClusterContacts::report(const Cluster& cluster) {
  for (std::size_t at = 0; at < cluster.pairs.size(); ++at) {
    if (cluster.impulses.along[at] > 0.0) reportContact(cluster, at);
  }
}

/// Reports the collision of a pair, or counts it as a rest contact.
void ClusterContacts::reportContact(const Cluster& cluster, std::size_t at) {
  const Cluster::Pair& pair = cluster.pairs[at];
  const ClusterContact& contact = cluster.contacts[at];
  const bool wall = !isSphere(pair.partner);
  const double slowest =
      std::max(rest_.restSpeed(pair.sphere), wall ? 0.0 : rest_.restSpeed(pair.partner));
  const double speed = std::max(cluster.approachSpeeds[at], cluster.speedFor(at));
  if (speed < slowest) {
    rest_.countRestContact();
    return;
  }
  const Motion& motion = cluster.motions[contact.body];
  const Motion& other = cluster.motions[contact.other];
  const Vec3 point = motion.position - bodies_.radii[pair.sphere] * contact.normal;
  const Side second =
      wall ? reporter_.sideOf(wallOf(pair.partner), point) : reporter_.sideOf(pair.partner, other);
  reporter_.report(reporter_.sideOf(pair.sphere, motion), second,
                   {contact.normal, speed, cluster.effectiveMass(at), cluster.impulses.along[at]});
}

/// Reports the collisions of the cluster, and sets the new motions of its spheres; false if nothing
/// has changed.
bool ClusterContacts::apply(const Cluster& cluster) {
  double taken = 0.0;
  std::vector<std::uint32_t> moved;    // by member
  std::vector<std::uint32_t> spheres;  // the same spheres by number
  for (std::uint32_t member = 0; member < cluster.members.size(); ++member) {
    const ClusterBody& before = cluster.before[member];
    const ClusterBody& after = cluster.after[member];
    if (!std::isfinite(before.mass) || before.velocity == after.velocity) continue;
    moved.push_back(member);
    spheres.push_back(cluster.members[member]);
    taken += 0.5 * before.mass *
             dotInOrder(before.velocity - after.velocity, before.velocity + after.velocity);
  }
  if (moved.empty()) return false;
  report(cluster);
  // Many rounds count as many contacts: jammed spheres may need them again at once.
  const std::size_t contacts = 1 + cluster.impulses.rounds / kRoundsPerContact;
  for (const std::uint32_t member : moved) {
    const std::uint32_t sphere = cluster.members[member];
    Motion motion = cluster.motions[member];
    for (std::size_t contact = 0; contact < contacts; ++contact)
      rest_.recordContact(sphere, motion);
    rest_.addBounceEnergy(sphere, taken / static_cast<double>(moved.size()));
    motion.velocity = cluster.after[member].velocity;
    trajectories_.changeMotion(sphere, motion);
  }
  trajectories_.settleRods(spheres);
  return true;
}

}  // namespace carom::native
