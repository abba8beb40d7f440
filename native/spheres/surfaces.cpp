// The part of Simulation for surfaces that are finite or oscillate: SphereStepper documents it
// under Boxes and Oscillation.

#include <algorithm>
#include <array>
#include <cmath>

#include "native/math/contact_time.h"
#include "native/math/vector_math.h"
#include "native/mechanics/resting.h"
#include "native/spheres/simulation.h"

namespace carom::native {
namespace {

// These constants define rest on edges and on planes that oscillate, and are documented in
// SphereStepper.
/// Relative to the rest speed: a hop is still rest after it has grown.
constexpr double kMostHop = 0.4;

constexpr double kNudge = 2e-15;   ///< relative to the coordinates: more than their rounding
constexpr double kBorder = 1e-12;  ///< relative to the coordinates: nearer to a border is at it

}  // namespace

// ---- Boxes

void Simulation::meetBox(std::uint32_t sphere, std::uint32_t index) {
  const Solid& solid = bodies_.solids[index];
  const BoxNearest nearest = bodies_.nearest(solid, bodies_.at(sphere, now_).position, now_);
  if (nearest.feature == BoxFeature::face) {
    meetWall(sphere, solid.firstFace + static_cast<std::uint32_t>(nearest.face));
  } else {
    meetEdge(sphere, solid, solid.toWorld(nearest.normal));
  }
}

/// Resolves a contact with an edge or corner.
void Simulation::meetEdge(std::uint32_t sphere, const Solid& solid, const Vec3& normal) {
  wake(sphere);
  Motion motion = bodies_.at(sphere, now_);
  const double approachSpeed = dotInOrder(normal, solid.box.velocity - motion.velocity);
  const double pressed = -bodies_.alongNormal(normal, bodies_.accelerations[sphere]);
  if (approachSpeed > 0.0 && approachSpeed >= restSpeed(sphere)) {
    noteContact(sphere, motion);
    strikeEdge(sphere, solid, {normal, approachSpeed}, motion);
  } else if (approachSpeed > 0.0 || pressed > 0.0) {
    touchEdge(sphere, solid, {normal, std::max(approachSpeed, 0.0)}, motion);
  }  // else the contact is so slow that rounding decided
  leave(sphere, motion);
  if (linkage_.hasRods(sphere)) settleRods(linkage_.groupOf(sphere));
  trySleep(sphere);
  predictChanged();
}

void Simulation::strikeEdge(std::uint32_t sphere, const Solid& solid, const Impact& impact,
                            Motion& motion) {
  const Substance& body = substances_[sphere];
  const double speed = impact.approachSpeed;
  const double restitution = wallRestitution(sphere, bodies_.walls[solid.firstFace].plane, speed);
  const double rebound = restitution * speed;
  allowHop(sphere, 0.5 * body.mass * (speed - rebound) * (speed + rebound));
  report(sideOf(sphere, motion),
         {solid.box.id, 0.0, solid.centreAt(now_), solid.box.velocity, solid.box.orientation},
         {impact.normal, speed, body.mass, body.mass * (speed + rebound)});
  motion.velocity += (speed + rebound) * impact.normal;
}

/// Resolves a contact slower than restSpeed: elastic, except for a hop, and unreported.
void Simulation::touchEdge(std::uint32_t sphere, const Solid& solid, const Impact& impact,
                           Motion& motion) {
  ++counters_.restContacts;
  const bool stuck = noteContact(sphere, motion);
  const Vec3 yield = yielding(sphere, impact.normal);
  const double compliance = dotInOrder(impact.normal, yield);
  if (compliance > 0.0) {
    const Vec3 sideways = sidewaysOf(sphere, motion.velocity - solid.box.velocity, impact.normal);
    const EdgeHop hop = edgeHop(sphere, impact, 1.0 / compliance, dotInOrder(sideways, sideways));
    const double rebound = std::max(hop.rebound, kLeastRebound * lengthOf(motion.velocity));
    motion.velocity += ((impact.approachSpeed + rebound) / compliance) * yield;
    motion.velocity -= (1.0 - hop.sideways) * sideways;
  }
  if (stuck) stop(sphere, motion);
}

/// The part of a velocity that is neither along the normal nor along the normals of walls that hold
/// the sphere.
Vec3 Simulation::sidewaysOf(std::uint32_t sphere, const Vec3& velocity, const Vec3& normal) const {
  std::array<Vec3, Holds::kMost + 1> normals{normal};
  constexpr std::array<double, Holds::kMost + 1> kStill{};
  std::size_t count = 1;
  for (const std::uint32_t held : bodies_.holds[sphere].all())
    normals[count++] = bodies_.walls[held].plane.normal;
  return heldVelocity(velocity, {normals.data(), count}, {kStill.data(), count});
}

/// Returns the hop off an edge, as restingRebound does for a pair. A hop that nothing has paid for
/// is taken from the motion sideways, whose squared speed is `square`.
Simulation::EdgeHop Simulation::edgeHop(std::uint32_t sphere, const Impact& impact, double mass,
                                        double square) {
  const double speed = impact.approachSpeed;
  const double pressed = -bodies_.alongNormal(impact.normal, bodies_.accelerations[sphere]);
  if (pressed <= 0.0) return {speed};
  const double least = 0.5 * kLeastHopTime * pressed;
  const double longest = 0.5 * restSpeed(sphere);
  double& allowance = substances_[sphere].hopAllowance;
  for (const double hop : {std::min(longest, 0.5 * kHopTime * pressed), least}) {
    if (speed >= hop) return {speed};
    const double needed = 0.5 * mass * (hop - speed) * (hop + speed);
    if (needed > allowance) continue;
    allowance -= needed;
    return {hop};
  }
  const double gained = (least - speed) * (least + speed);
  return gained < square ? EdgeHop{least, std::sqrt((square - gained) / square)} : EdgeHop{speed};
}

/// Moves the sphere round the border of the face that holds it.
void Simulation::passBorder(std::uint32_t sphere, std::uint32_t face) {
  wake(sphere);
  const Solid& solid = bodies_.solids[bodies_.walls[face].box];
  const Vec3& halfExtents = solid.box.halfExtents;
  Motion motion = bodies_.at(sphere, now_);
  const BoxPath path = bodies_.pathBy(solid, motion, bodies_.accelerations[sphere]);
  bodies_.holds[sphere].drop(face);
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
  leave(sphere, motion);
  predictChanged();
}

// ---- Oscillating planes

/// Resolves a contact with a plane that oscillates. It holds no sphere: one that lies on it follows
/// in short hops, whose energy the plane provides.
void Simulation::meetOscillating(std::uint32_t sphere, std::uint32_t index) {
  wake(sphere);
  const Wall& wall = bodies_.walls[index];
  const Vec3& normal = wall.plane.normal;
  const double angular = wall.oscillation.angularFrequency();
  const SineCosine phase = wall.oscillation.at(now_);
  Motion motion = bodies_.at(sphere, now_);
  const double wallSpeed = wall.speed + wall.oscillation.amplitude * angular * phase.cosine;
  const double approachSpeed = wallSpeed - dotInOrder(normal, motion.velocity);
  const double rise = -wall.oscillation.amplitude * angular * angular * phase.sine;
  const double pressed = rise - bodies_.alongNormal(normal, bodies_.accelerations[sphere]);
  if (approachSpeed > 0.0 || pressed > 0.0) {
    noteContact(sphere, motion);
    bounceOffOscillating(sphere, index, {normal, std::max(approachSpeed, 0.0)}, pressed, motion);
  }  // else the contact is so slow that rounding decided
  leave(sphere, motion);
  if (linkage_.hasRods(sphere)) settleRods(linkage_.groupOf(sphere));
  predictChanged();
}

void Simulation::bounceOffOscillating(std::uint32_t sphere, std::uint32_t index,
                                      const Impact& impact, double pressed, Motion& motion) {
  const Substance& body = substances_[sphere];
  const Wall& wall = bodies_.walls[index];
  const double speed = impact.approachSpeed;
  const double restitution = wallRestitution(sphere, wall.plane, speed);
  const double leastHop = 0.5 * kLeastHopTime * std::max(pressed, 0.0);
  const double slowest = std::max(restSpeed(sphere), leastHop / kMostHop);
  const bool slow = speed < slowest;
  const double hop = std::min(0.5 * kHopTime * std::max(pressed, 0.0), kMostHop * slowest);
  const double returned = slow && restitution < 1.0 ? 0.0 : restitution * speed;
  const double least = slow ? hop : leastHop;
  const double rebound = std::max({returned, least, kLeastRebound * lengthOf(motion.velocity)});
  Vec3 direction = impact.normal;
  if (slow) {
    ++counters_.restContacts;
    const Vec3 yield = yielding(sphere, impact.normal);
    const double compliance = dotInOrder(impact.normal, yield);
    if (!(compliance > 0.0)) return;
    direction = yield / compliance;
  } else {
    const double radius = bodies_.radii[sphere];
    const double angular = wall.oscillation.angularFrequency();
    report(sideOf(sphere, motion),
           {wall.plane.id, kNever, motion.position - radius * impact.normal,
            wall.plane.velocity +
                (angular * wall.oscillation.at(now_).cosine) * wall.plane.oscillation.amplitude},
           {impact.normal, speed, body.mass, body.mass * (speed + rebound)});
    allowHop(sphere, 0.5 * body.mass * (speed - rebound) * (speed + rebound));
  }
  motion.velocity += (speed + rebound) * direction;
}

}  // namespace carom::native
