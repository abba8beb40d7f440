#include "native/spheres/sphere_contacts.h"

#include <algorithm>

#include "native/math/vector_math.h"
#include "native/mechanics/rolling.h"

namespace carom::native {

SphereContacts::SphereContacts(const ContactParts& parts, ClusterContacts& clusters)
    : bodies_(parts.bodies),
      properties_(parts.properties),
      linkage_(parts.linkage),
      responses_(parts.responses),
      trajectories_(parts.trajectories),
      rest_(parts.rest),
      sleep_(parts.sleep),
      reporter_(parts.reporter),
      ledger_(parts.ledger),
      clusters_(clusters) {}

ContactPair SphereContacts::pairOf(std::uint32_t sphere, std::uint32_t other) const {
  ContactPair pair{
      trajectories_.motion(sphere), trajectories_.motion(other), {}, 0.0, sphere, other};
  const Vec3 separation = pair.motion.position - pair.otherMotion.position;
  const double distance = lengthOf(separation);
  pair.normal = separation / distance;
  pair.approachSpeed =
      -dotInOrder(separation, pair.motion.velocity - pair.otherMotion.velocity) / distance;
  return pair;
}

void SphereContacts::meet(std::uint32_t sphere, std::uint32_t other, bool tied) {
  ContactPair pair = pairOf(sphere, other);
  if (pair.approachSpeed >= rest_.restSpeed(sphere, other) && pair.approachSpeed > 0.0) {
    wakeByImpact(pair);
    if (!clusters_.resolve(sphere, other, tied)) collide(pair);
  } else if (pair.approachSpeed > 0.0 || pull(pair) > 0.0) {
    pair.approachSpeed = std::max(pair.approachSpeed, 0.0);
    resolveRest(pair);
  } else {  // a near miss that rounding took for a contact; predicted anew it is a miss
    trajectories_.changeMotion(sphere, pair.motion);
    trajectories_.changeMotion(other, pair.otherMotion);
  }
}

/// Acceleration (m/s^2) at which the two are drawn into each other.
double SphereContacts::pull(const ContactPair& pair) const {
  return -dotInOrder(pair.normal,
                     bodies_.accelerations[pair.sphere] - bodies_.accelerations[pair.other]);
}

/// Wakes the two if the impact is hard enough to wake sleeping spheres.
void SphereContacts::wakeByImpact(const ContactPair& pair) {
  if (pair.approachSpeed < kWakeSpeed * rest_.restSpeed(pair.sphere, pair.other)) return;
  sleep_.wake(pair.sphere);
  sleep_.wake(pair.other);
}

void SphereContacts::report(const ContactPair& pair, double mass, double impulse) {
  reporter_.report(reporter_.sideOf(pair.sphere, pair.motion),
                   reporter_.sideOf(pair.other, pair.otherMotion),
                   {pair.normal, pair.approachSpeed, mass, impulse});
}

// ---- Collisions

void SphereContacts::collide(const ContactPair& pair) {
  rest_.recordContact(pair.sphere, pair.motion);
  rest_.recordContact(pair.other, pair.otherMotion);
  const double restitution = properties_.restitution(pair.sphere, pair.other, pair.approachSpeed);
  if (linkage_.hasRods(pair.sphere) || linkage_.hasRods(pair.other)) {
    collideLinked(pair, restitution);
  } else {
    collideFree(pair, restitution);
  }
}

/// Resolves a collision of two spheres without rods.
void SphereContacts::collideFree(const ContactPair& pair, double restitution) {
  const double mass = properties_.mass(pair.sphere);
  const double otherMass = properties_.mass(pair.other);
  const bool asleep = bodies_.isAsleep(pair.sphere);
  const bool otherAsleep = bodies_.isAsleep(pair.other);
  // Shares of the two in the change of velocity, formed so that equal masses swap theirs exactly.
  double share = otherMass / (mass + otherMass);
  double otherShare = mass / (mass + otherMass);
  double effectiveMass = mass * share;
  if (asleep || otherAsleep) {  // a sphere that sleeps on does not yield
    share = otherAsleep ? 1.0 : 0.0;
    otherShare = otherAsleep ? 0.0 : 1.0;
    effectiveMass = otherAsleep ? mass : otherMass;
  }
  const double change = (1.0 + restitution) * pair.approachSpeed;
  const double taken = 0.5 * effectiveMass * (1.0 - restitution) * (1.0 + restitution) *
                       pair.approachSpeed * pair.approachSpeed;
  rest_.addBounceEnergy(pair.sphere, 0.5 * taken);
  rest_.addBounceEnergy(pair.other, 0.5 * taken);
  report(pair, effectiveMass, effectiveMass * change);
  Motion motion = pair.motion;
  Motion otherMotion = pair.otherMotion;
  motion.velocity += (share * change) * pair.normal;
  otherMotion.velocity -= (otherShare * change) * pair.normal;
  if (!asleep && !otherAsleep) {
    ledger_.recordCollision({pair.sphere, pair.other, pair.motion.velocity,
                             pair.otherMotion.velocity, motion.velocity, otherMotion.velocity,
                             taken});
  }
  applyFriction(pair, effectiveMass * change, motion, otherMotion);
  trajectories_.changeMotion(pair.sphere, motion);
  trajectories_.changeMotion(pair.other, otherMotion);
}

/// Resolves a collision of two spheres of which at least one has rods.
void SphereContacts::collideLinked(const ContactPair& pair, double restitution) {
  const ImpulseResponse response = responses_.impulseResponse(pair);
  const double compliance = response.compliance(pair.normal);
  Motion motion = pair.motion;
  Motion otherMotion = pair.otherMotion;
  if (compliance > 0.0) {
    const double impulse = (1.0 + restitution) * pair.approachSpeed / compliance;
    report(pair, 1.0 / compliance, impulse);
    motion.velocity += impulse * response.velocityChange;
    otherMotion.velocity += impulse * response.otherVelocityChange;
    applyToLinked(response, impulse, trajectories_);
  }
  trajectories_.changeMotion(pair.sphere, motion);
  trajectories_.changeMotion(pair.other, otherMotion);
}

/// Applies friction in an impact that pushes with `impulse` N s along the normal.
void SphereContacts::applyFriction(const ContactPair& pair, double impulse, Motion& motion,
                                   Motion& otherMotion) {
  if (!properties_.hasFriction()) return;
  const auto inverseMass = [&](std::uint32_t sphere) {
    return bodies_.isAsleep(sphere) ? 0.0 : 1.0 / properties_.mass(sphere);
  };
  FrictionContact contact;
  contact.normal = pair.normal;
  contact.velocity = pair.motion.velocity - pair.otherMotion.velocity;
  contact.spin = trajectories_.spin(pair.sphere, trajectories_.now());
  contact.radius = bodies_.radii[pair.sphere];
  contact.inverseMass = inverseMass(pair.sphere);
  contact.otherSpin = trajectories_.spin(pair.other, trajectories_.now());
  contact.otherRadius = bodies_.radii[pair.other];
  contact.otherInverseMass = inverseMass(pair.other);
  contact.friction = properties_.slidingFriction(pair.sphere, pair.other);
  if (contact.friction == 0.0) return;
  const Vec3 friction = frictionImpulse(contact, impulse);
  motion.velocity += contact.inverseMass * friction;
  otherMotion.velocity -= contact.otherInverseMass * friction;
  // Opposite impulses at opposite arms turn both the same way.
  const auto turn = [&](std::uint32_t sphere, double radius) {
    trajectories_.addSpin(
        sphere, spinChange(-radius * contact.normal, friction, properties_.mass(sphere), radius));
  };
  if (contact.inverseMass > 0.0) turn(pair.sphere, contact.radius);
  if (contact.otherInverseMass > 0.0) turn(pair.other, contact.otherRadius);
}

// ---- Rest

/// Resolves a contact slower than the rest speed: elastic, except for a hop, and unreported.
void SphereContacts::resolveRest(const ContactPair& pair) {
  rest_.countRestContact();
  const bool collapsed = rest_.recordContact(pair.sphere, pair.motion);
  const bool otherCollapsed = rest_.recordContact(pair.other, pair.otherMotion);
  const ImpulseResponse response = responses_.impulseResponse(pair);
  const double compliance = response.compliance(pair.normal);
  Motion motion = pair.motion;
  Motion otherMotion = pair.otherMotion;
  if (compliance > 0.0) {
    const double speed = lengthOf(motion.velocity) + lengthOf(otherMotion.velocity);
    // The pair must part, or rounding finds the same contact again at the same instant.
    const double rebound = std::max(restingRebound(pair, 1.0 / compliance), kLeastRebound * speed);
    const double impulse = (pair.approachSpeed + rebound) / compliance;
    motion.velocity += impulse * response.velocityChange;
    otherMotion.velocity += impulse * response.otherVelocityChange;
    applyToLinked(response, impulse, trajectories_);
  }
  if (collapsed) rest_.stop(pair.sphere, motion);
  if (otherCollapsed) rest_.stop(pair.other, otherMotion);
  trajectories_.changeMotion(pair.sphere, motion);
  trajectories_.changeMotion(pair.other, otherMotion);
  sleep_.trySleep(pair.sphere);
  sleep_.trySleep(pair.other);
}

/// True if friction on the plane below, springs or rods dissipate the energy of a hop. Such a hop
/// needs no payment, and without hops the contacts would never end.
bool SphereContacts::hopsAreDamped(std::uint32_t sphere) const {
  return trajectories_.isLinked(sphere) ||
         (properties_.hasFriction() && properties_.friction(sphere).sliding > 0.0);
}

/// Rebound speed in m/s of a pair that is drawn together: the speed of a hop if there is energy for
/// it.
double SphereContacts::restingRebound(const ContactPair& pair, double effectiveMass) {
  const double drawn = pull(pair);
  const double speed = pair.approachSpeed;
  if (drawn <= 0.0) return speed;
  const bool damped = hopsAreDamped(pair.sphere) || hopsAreDamped(pair.other);
  const double least =
      std::min(0.5 * (damped ? kDampedHopTime : kLeastHopTime) * drawn, kFastestUnpaidHop);
  const double longest = 0.5 * rest_.restSpeed(pair.sphere, pair.other);
  for (const double hop : {std::min(longest, 0.5 * kHopTime * drawn), least}) {
    if (speed >= hop) return speed;
    const double needed = 0.5 * effectiveMass * (hop - speed) * (hop + speed);
    if (rest_.payForBounce(pair.sphere, pair.other, needed)) return hop;
    if (damped && hop == least) return hop;
  }
  return speed;
}

}  // namespace carom::native
