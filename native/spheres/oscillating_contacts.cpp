#include "native/spheres/oscillating_contacts.h"

#include <algorithm>

#include "native/math/vector_math.h"

namespace carom::native {
namespace {

constexpr double kMostHop = 0.4;  ///< relative to the rest speed: a hop is rest after it has grown

}  // namespace

OscillatingContacts::OscillatingContacts(const ContactParts& parts)
    : bodies_(parts.bodies),
      properties_(parts.properties),
      linkage_(parts.linkage),
      responses_(parts.responses),
      trajectories_(parts.trajectories),
      rest_(parts.rest),
      sleep_(parts.sleep),
      reporter_(parts.reporter) {}

void OscillatingContacts::meet(std::uint32_t sphere, std::uint32_t index) {
  sleep_.wake(sphere);
  const Wall& wall = bodies_.walls[index];
  const Vec3& normal = wall.plane.normal;
  const double angular = wall.oscillation.angularFrequency();
  const SineCosine phase = wall.oscillation.at(trajectories_.now());
  Motion motion = trajectories_.motion(sphere);
  const double wallSpeed = wall.speed + wall.oscillation.amplitude * angular * phase.cosine;
  const double approachSpeed = wallSpeed - dotInOrder(normal, motion.velocity);
  const double rise = -wall.oscillation.amplitude * angular * angular * phase.sine;
  const double pressed = rise - bodies_.alongNormal(normal, bodies_.accelerations[sphere]);
  if (approachSpeed > 0.0 || pressed > 0.0) {
    rest_.recordContact(sphere, motion);
    bounce({sphere, index, std::max(approachSpeed, 0.0), pressed, phase.cosine}, motion);
  }  // else the contact is so slow that rounding decided
  trajectories_.changeMotion(sphere, motion);
  trajectories_.settleRods(sphere);
}

OscillatingContacts::Rebound OscillatingContacts::rebound(const Arrival& arrival,
                                                          const Motion& motion) const {
  const double speed = arrival.approachSpeed;
  const Plane& plane = bodies_.walls[arrival.wall].plane;
  const double restitution = properties_.wallRestitution(arrival.sphere, plane, speed);
  const double pressed = std::max(arrival.pressed, 0.0);
  const double leastHop = 0.5 * kLeastHopTime * pressed;
  const double slowest = std::max(rest_.restSpeed(arrival.sphere), leastHop / kMostHop);
  const bool slow = speed < slowest;
  const double hop = std::min(0.5 * kHopTime * pressed, kMostHop * slowest);
  const double returned = slow && restitution < 1.0 ? 0.0 : restitution * speed;
  const double least = slow ? hop : leastHop;
  return {std::max({returned, least, kLeastRebound * lengthOf(motion.velocity)}), slow};
}

void OscillatingContacts::bounce(const Arrival& arrival, Motion& motion) {
  const std::uint32_t sphere = arrival.sphere;
  const double speed = arrival.approachSpeed;
  const Rebound rebound = this->rebound(arrival, motion);
  Vec3 direction = bodies_.walls[arrival.wall].plane.normal;
  if (rebound.rest) {
    rest_.countRestContact();
    const Vec3 change = responses_.velocityChange(sphere, direction);
    const double compliance = dotInOrder(direction, change);
    if (!(compliance > 0.0)) return;
    direction = change / compliance;
  } else if (linkage_.hasRods(sphere)) {
    return bounceOnRods(arrival, rebound.speed, motion);
  } else {
    report(arrival, motion, properties_.mass(sphere), rebound.speed);
  }
  motion.velocity += (speed + rebound.speed) * direction;
}

/// Lets a sphere bounce that has rods: these take part in the impulse.
void OscillatingContacts::bounceOnRods(const Arrival& arrival, double rebound, Motion& motion) {
  const Vec3& normal = bodies_.walls[arrival.wall].plane.normal;
  const ImpulseResponse response = responses_.impulseResponse(
      {motion, {}, normal, arrival.approachSpeed, arrival.sphere, ContactPair::kImmovable});
  const double compliance = response.compliance(normal);
  const double mass = compliance > 0.0 ? 1.0 / compliance : 0.0;
  report(arrival, motion, mass, rebound);
  const double impulse = mass * (arrival.approachSpeed + rebound);
  motion.velocity += impulse * response.velocityChange;
  applyToLinked(response, impulse, trajectories_);
}

/// Reports a bounce that a mass takes part in, and counts the energy that it loses.
void OscillatingContacts::report(const Arrival& arrival, const Motion& motion, double mass,
                                 double rebound) {
  const Wall& wall = bodies_.walls[arrival.wall];
  const Vec3& normal = wall.plane.normal;
  const double speed = arrival.approachSpeed;
  rest_.addBounceEnergy(arrival.sphere, 0.5 * mass * (speed - rebound) * (speed + rebound));
  const double radius = bodies_.radii[arrival.sphere];
  const double angular = wall.oscillation.angularFrequency();
  reporter_.report(
      reporter_.sideOf(arrival.sphere, motion),
      {wall.plane.id, kNever, motion.position - radius * normal,
       wall.plane.velocity + (angular * arrival.cosine) * wall.plane.oscillation.amplitude},
      {normal, speed, mass, mass * (speed + rebound)});
}

}  // namespace carom::native
