#include "native/spheres/wall_contacts.h"

#include <algorithm>

#include "native/math/vector_math.h"
#include "native/mechanics/rolling.h"

namespace carom::native {
namespace {

constexpr double kLeastFlight = 1e-5;  ///< s, a shorter bounce on a wall is none; as documented

}  // namespace

WallContacts::WallContacts(const ContactParts& parts, ClusterContacts& clusters)
    : bodies_(parts.bodies),
      properties_(parts.properties),
      linkage_(parts.linkage),
      responses_(parts.responses),
      trajectories_(parts.trajectories),
      rest_(parts.rest),
      sleep_(parts.sleep),
      reporter_(parts.reporter),
      clusters_(clusters) {}

void WallContacts::meet(std::uint32_t sphere, std::uint32_t index, bool tied) {
  sleep_.wake(sphere);
  const Wall& wall = bodies_.walls[index];
  const Motion motion = trajectories_.motion(sphere);
  const Vec3& normal = wall.plane.normal;
  const double approachSpeed = wall.speed - dotInOrder(normal, motion.velocity);
  if (approachSpeed > 0.0 && approachSpeed >= rest_.restSpeed(sphere) &&
      clusters_.resolve(sphere, static_cast<std::uint32_t>(bodies_.count() + index), tied))
    return;
  // Gravity still presses where rounding has reversed the end of a slow approach.
  if (approachSpeed >= 0.0 || bodies_.alongNormal(normal, bodies_.accelerations[sphere]) < 0.0) {
    rest_.recordContact(sphere, motion);
    bounce({motion, sphere, index, std::max(approachSpeed, 0.0)});
  } else {  // the contact is so slow that rounding decided
    trajectories_.changeMotion(sphere, motion);
  }
}

bool WallContacts::isReported(const Arrival& arrival) const {
  return arrival.approachSpeed > 0.0 && arrival.approachSpeed >= rest_.restSpeed(arrival.sphere);
}

void WallContacts::bounce(const Arrival& arrival) {
  const std::uint32_t sphere = arrival.sphere;
  const Wall& wall = bodies_.walls[arrival.wall];
  const double rebound = this->rebound(arrival);
  if (linkage_.hasRods(sphere)) {
    bounceOnRods(arrival, rebound);
    return;
  }
  Motion motion = arrival.motion;
  const double impulse = properties_.mass(sphere) * (arrival.approachSpeed + rebound);
  if (isReported(arrival)) {
    report(arrival, properties_.mass(sphere), impulse);
    applyFriction(arrival, impulse, motion);
  } else {
    rest_.countRestContact();
  }
  // A held sphere gets exactly the speed of the wall, so that it does not leave by the rounding of
  // a speed that has vanished.
  const double onto = wall.speed - dotInOrder(wall.plane.normal, motion.velocity);
  motion.velocity += (rebound == 0.0 ? onto : arrival.approachSpeed + rebound) * wall.plane.normal;
  if (rebound == 0.0) trajectories_.hold(sphere, arrival.wall, motion);
  trajectories_.changeMotion(sphere, motion);
}

/// Lets a sphere bounce that has rods: these take part in the impulse. No wall holds it.
void WallContacts::bounceOnRods(const Arrival& arrival, double rebound) {
  const Vec3& normal = bodies_.walls[arrival.wall].plane.normal;
  const ImpulseResponse response = responses_.impulseResponse(
      {arrival.motion, {}, normal, arrival.approachSpeed, arrival.sphere, ContactPair::kImmovable});
  const double compliance = response.compliance(normal);
  const double mass = compliance > 0.0 ? 1.0 / compliance : 0.0;
  const double impulse = mass * (arrival.approachSpeed + rebound);
  if (isReported(arrival)) {
    report(arrival, mass, impulse);
  } else {
    rest_.countRestContact();
  }
  Motion motion = arrival.motion;
  motion.velocity += impulse * response.velocityChange;
  applyToLinked(response, impulse, trajectories_);
  trajectories_.changeMotion(arrival.sphere, motion);
}

void WallContacts::report(const Arrival& arrival, double mass, double impulse) {
  const Wall& wall = bodies_.walls[arrival.wall];
  const Vec3& normal = wall.plane.normal;
  const Vec3 point = arrival.motion.position - bodies_.radii[arrival.sphere] * normal;
  reporter_.report(reporter_.sideOf(arrival.sphere, arrival.motion), reporter_.sideOf(wall, point),
                   {normal, arrival.approachSpeed, mass, impulse});
}

/// Rebound speed in m/s; 0 if the wall is to hold the sphere.
double WallContacts::rebound(const Arrival& arrival) {
  const std::uint32_t sphere = arrival.sphere;
  const double speed = arrival.approachSpeed;
  const Plane& plane = bodies_.walls[arrival.wall].plane;
  const double restitution = properties_.wallRestitution(sphere, plane, speed);
  const bool slow = speed < rest_.restSpeed(sphere);
  const double rebound = slow && restitution < 1.0 ? 0.0 : restitution * speed;
  rest_.addBounceEnergy(sphere,
                        0.5 * properties_.mass(sphere) * (speed - rebound) * (speed + rebound));
  const Vec3& acceleration = bodies_.accelerations[sphere];
  const double pressed = -bodies_.alongNormal(plane.normal, acceleration);
  // A wall does not hold a sphere on rods, nor one that only the friction on another wall presses
  // against it.
  const bool byFriction =
      pressed > 0.0 &&
      bodies_.alongNormal(plane.normal, trajectories_.freeAcceleration(sphere)) >= 0.0;
  if (linkage_.hasRods(sphere) || byFriction)
    return std::max(slow ? speed : rebound,
                    std::min(0.5 * kDampedHopTime * lengthOf(acceleration), kFastestUnpaidHop));
  if (2.0 * rebound < kLeastFlight * pressed) return 0.0;
  if (rebound <= kLeastRebound * lengthOf(bodies_.motions[sphere].velocity)) return 0.0;
  return rebound;
}

/// Applies friction in an impact that pushes with `impulse` N s along the normal.
void WallContacts::applyFriction(const Arrival& arrival, double impulse, Motion& motion) {
  if (!properties_.hasFriction()) return;
  const std::uint32_t sphere = arrival.sphere;
  const Plane& plane = bodies_.walls[arrival.wall].plane;
  const double mass = properties_.mass(sphere);
  FrictionContact contact;
  contact.normal = plane.normal;
  contact.velocity = motion.velocity - plane.velocity;
  contact.spin = trajectories_.spin(sphere, trajectories_.now());
  contact.radius = bodies_.radii[sphere];
  contact.inverseMass = 1.0 / mass;
  contact.friction = properties_.slidingFriction(sphere, plane);
  const Vec3 friction = frictionImpulse(contact, impulse);
  motion.velocity += friction / mass;
  trajectories_.addSpin(
      sphere, spinChange(-contact.radius * contact.normal, friction, mass, contact.radius));
}

}  // namespace carom::native
