#include "native/spheres/edge_contacts.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "native/math/vector_math.h"
#include "native/mechanics/resting.h"

namespace carom::native {
namespace {

constexpr double kNudge = 2e-15;   ///< relative to the coordinates: more than their rounding
constexpr double kBorder = 1e-12;  ///< relative to the coordinates: nearer to a border is at it

}  // namespace

EdgeContacts::EdgeContacts(const ContactParts& parts)
    : bodies_(parts.bodies),
      properties_(parts.properties),
      linkage_(parts.linkage),
      responses_(parts.responses),
      trajectories_(parts.trajectories),
      rest_(parts.rest),
      sleep_(parts.sleep),
      reporter_(parts.reporter) {}

void EdgeContacts::meet(std::uint32_t sphere, const Solid& solid, const Vec3& normal) {
  sleep_.wake(sphere);
  Motion motion = trajectories_.motion(sphere);
  const double approachSpeed = dotInOrder(normal, solid.box.velocity - motion.velocity);
  const double pressed = -bodies_.alongNormal(normal, bodies_.accelerations[sphere]);
  if (approachSpeed > 0.0 && approachSpeed >= rest_.restSpeed(sphere)) {
    rest_.recordContact(sphere, motion);
    strike(sphere, solid, {normal, approachSpeed}, motion);
  } else if (approachSpeed > 0.0 || pressed > 0.0) {
    resolveRest(sphere, solid, {normal, std::max(approachSpeed, 0.0)}, motion);
  }  // else the contact is so slow that rounding decided
  trajectories_.changeMotion(sphere, motion);
  trajectories_.settleRods(sphere);
  sleep_.trySleep(sphere);
}

void EdgeContacts::strike(std::uint32_t sphere, const Solid& solid, const Impact& impact,
                          Motion& motion) {
  const double speed = impact.approachSpeed;
  const Plane& plane = bodies_.walls[solid.firstFace].plane;
  const double rebound = properties_.wallRestitution(sphere, plane, speed) * speed;
  const auto reportBounce = [&](double mass) {
    rest_.addBounceEnergy(sphere, 0.5 * mass * (speed - rebound) * (speed + rebound));
    reporter_.report(reporter_.sideOf(sphere, motion), reporter_.edgeSideOf(solid),
                     {impact.normal, speed, mass, mass * (speed + rebound)});
  };
  if (!linkage_.hasRods(sphere)) {
    reportBounce(properties_.mass(sphere));
    motion.velocity += (speed + rebound) * impact.normal;
    return;
  }
  // Rods take part in the impulse.
  const ImpulseResponse response = responses_.impulseResponse(
      {motion, {}, impact.normal, speed, sphere, ContactPair::kImmovable});
  const double compliance = response.compliance(impact.normal);
  const double mass = compliance > 0.0 ? 1.0 / compliance : 0.0;
  reportBounce(mass);
  motion.velocity += mass * (speed + rebound) * response.velocityChange;
  applyToLinked(response, mass * (speed + rebound), trajectories_);
}

/// Resolves a contact slower than the rest speed: elastic, except for a hop, and unreported.
void EdgeContacts::resolveRest(std::uint32_t sphere, const Solid& solid, const Impact& impact,
                               Motion& motion) {
  rest_.countRestContact();
  const bool collapsed = rest_.recordContact(sphere, motion);
  const Vec3 change = responses_.velocityChange(sphere, impact.normal);
  const double compliance = dotInOrder(impact.normal, change);
  if (compliance > 0.0) {
    const Vec3 sideways = sidewaysOf(sphere, motion.velocity - solid.box.velocity, impact.normal);
    const Impact yielding{impact.normal, impact.approachSpeed, 1.0 / compliance};
    const EdgeHop hop = this->hop(sphere, yielding, dotInOrder(sideways, sideways));
    const double rebound = std::max(hop.rebound, kLeastRebound * lengthOf(motion.velocity));
    motion.velocity += ((impact.approachSpeed + rebound) / compliance) * change;
    motion.velocity -= (1.0 - hop.sideways) * sideways;
  }
  if (collapsed) rest_.stop(sphere, motion);
}

/// The part of a velocity that is neither along the normal nor along the normals of walls that hold
/// the sphere.
Vec3 EdgeContacts::sidewaysOf(std::uint32_t sphere, const Vec3& velocity,
                              const Vec3& normal) const {
  std::array<Vec3, Holds::kMost + 1> normals{normal};
  constexpr std::array<double, Holds::kMost + 1> kStill{};
  std::size_t count = 1;
  for (const std::uint32_t held : bodies_.holds[sphere].all())
    normals[count++] = bodies_.walls[held].plane.normal;
  return heldVelocity(velocity, {normals.data(), count}, {kStill.data(), count});
}

/// Returns the hop off an edge of a sphere that arrives with the impact's approach speed and
/// effective mass. A hop that the sphere's budget does not cover is paid for by the motion
/// sideways, whose squared speed is `square`.
EdgeContacts::EdgeHop EdgeContacts::hop(std::uint32_t sphere, const Impact& impact, double square) {
  const double speed = impact.approachSpeed;
  const double pressed = -bodies_.alongNormal(impact.normal, bodies_.accelerations[sphere]);
  if (pressed <= 0.0) return {speed};
  const double least = 0.5 * kLeastHopTime * pressed;
  const double longest = 0.5 * rest_.restSpeed(sphere);
  for (const double hop : {std::min(longest, 0.5 * kHopTime * pressed), least}) {
    if (speed >= hop) return {speed};
    const double needed = 0.5 * impact.effectiveMass * (hop - speed) * (hop + speed);
    if (rest_.payForBounce(sphere, needed)) return {hop};
  }
  const double gained = (least - speed) * (least + speed);
  return gained < square ? EdgeHop{least, std::sqrt((square - gained) / square)} : EdgeHop{speed};
}

void EdgeContacts::passBorder(std::uint32_t sphere, std::uint32_t face) {
  sleep_.wake(sphere);
  const Solid& solid = bodies_.solids[bodies_.walls[face].box];
  const Vec3& halfExtents = solid.box.halfExtents;
  Motion motion = trajectories_.motion(sphere);
  const BoxPath path = bodies_.pathBy(solid, motion, bodies_.accelerations[sphere]);
  trajectories_.release(sphere, face);
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    if (axis == static_cast<Eigen::Index>((face - solid.firstFace) / 2)) continue;
    const double side = path.position[axis] < 0.0 ? -1.0 : 1.0;
    const double speed = side * path.velocity[axis];
    const bool outwards = speed > 0.0 || (speed == 0.0 && side * path.acceleration[axis] > 0.0);
    const double size = motion.position.cwiseAbs().maxCoeff() +
                        solid.box.centre.cwiseAbs().maxCoeff() + solid.reach;
    const double room = halfExtents[axis] - side * path.position[axis];
    if (!outwards || room > kBorder * size) continue;
    // The sphere must be beyond the border for certain, or rounding would put it back on the face
    // at once.
    motion.position +=
        (side * (std::max(room, 0.0) + kNudge * size)) * solid.axes[static_cast<std::size_t>(axis)];
  }
  trajectories_.changeMotion(sphere, motion);
}

}  // namespace carom::native
