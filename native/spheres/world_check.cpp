#include "native/spheres/world_check.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <optional>
#include <span>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "native/math/vector_math.h"
#include "native/scheduling/box_contact.h"
#include "native/scheduling/cell_grid.h"
#include "native/scheduling/oscillation.h"

namespace carom::native {
namespace {

/// Relative error of the length of a normal or a quaternion.
constexpr double kNormalTolerance = 1e-9;

using Problem = std::optional<Error>;

template <class... Parts>
Error error(const Parts&... parts) {
  std::ostringstream text;
  text.precision(17);
  (text << ... << parts);
  return Error{text.str()};
}

std::string name(const Sphere& sphere) {
  return "sphere " + std::to_string(sphere.id);
}
std::string name(const Plane& plane) {
  return "plane " + std::to_string(plane.id);
}
std::string name(const Box& box) {
  return "box " + std::to_string(box.id);
}

Problem checkPositive(const std::string& owner, const char* what, const char* unit, double value) {
  if (std::isfinite(value) && value > 0.0) return {};
  return error(owner, ": ", what, " is ", value, " ", unit, "; it must be finite and above 0");
}

Problem checkRestitution(const std::string& owner, double value) {
  if (value >= 0.0 && value <= 1.0) return {};
  return error(owner, ": restitution is ", value, "; it must be between 0 and 1");
}

Problem checkFinite(const std::string& owner, const char* what, const Vec3& value) {
  if (value.allFinite()) return {};
  return error(owner, ": ", what, " is (", value.x(), ", ", value.y(), ", ", value.z(),
               "); every component must be finite");
}

Problem firstOf(std::initializer_list<Problem> problems) {
  for (const Problem& problem : problems) {
    if (problem) return problem;
  }
  return {};
}

Problem checkNotNegative(const std::string& owner, const char* what, const char* unit,
                         double value) {
  if (std::isfinite(value) && value >= 0.0) return {};
  return error(owner, ": ", what, " is ", value, unit, "; it must be finite and not below 0");
}

Problem checkFriction(const std::string& owner, const SphereFriction& friction) {
  return firstOf({checkNotNegative(owner, "sliding friction", "", friction.sliding),
                  checkNotNegative(owner, "rolling friction", "", friction.rolling),
                  checkNotNegative(owner, "pivoting friction", " m", friction.pivoting),
                  checkFinite(owner, "spin", friction.spin)});
}

Problem checkLaw(const std::string& owner, const RestitutionLaw& law) {
  if (law.law == SpeedLaw::constant) return {};
  return checkPositive(owner, "speed of the restitution", "m/s", law.speed);
}

Problem checkSphere(const Sphere& sphere) {
  const std::string owner = name(sphere);
  return firstOf({checkPositive(owner, "radius", "m", sphere.radius),
                  checkPositive(owner, "mass", "kg", sphere.mass),
                  checkRestitution(owner, sphere.restitution),
                  checkFinite(owner, "position", sphere.position),
                  checkFinite(owner, "velocity", sphere.velocity),
                  checkFriction(owner, sphere.friction), checkLaw(owner, sphere.restitutionLaw)});
}

Problem checkOscillation(const std::string& owner, const Oscillation& oscillation) {
  if (Problem problem = checkFinite(owner, "amplitude of oscillation", oscillation.amplitude))
    return problem;
  if (!std::isfinite(oscillation.phase))
    return error(owner, ": phase of oscillation is ", oscillation.phase, " rad; it must be finite");
  if (oscillation.amplitude == Vec3::Zero()) return {};
  return checkPositive(owner, "frequency of oscillation", "Hz", oscillation.frequency);
}

Problem checkPlane(const Plane& plane) {
  const std::string owner = name(plane);
  if (Problem problem = firstOf({checkFinite(owner, "normal", plane.normal),
                                 checkRestitution(owner, plane.restitution),
                                 checkFinite(owner, "velocity", plane.velocity),
                                 checkNotNegative(owner, "friction", "", plane.friction),
                                 checkLaw(owner, plane.restitutionLaw)})) {
    return problem;
  }
  const double length = std::sqrt(dotInOrder(plane.normal, plane.normal));
  if (!(std::abs(length - 1.0) <= kNormalTolerance)) {
    return error(owner, ": normal has length ", length, "; it must be 1 within ", kNormalTolerance);
  }
  if (!std::isfinite(plane.offset))
    return error(owner, ": offset is ", plane.offset, " m; it must be finite");
  return checkOscillation(owner, plane.oscillation);
}

double lengthOf(const Quat& orientation) {
  return std::sqrt(orientation.w() * orientation.w() + orientation.x() * orientation.x() +
                   orientation.y() * orientation.y() + orientation.z() * orientation.z());
}

Problem checkBox(const Box& box) {
  const std::string owner = name(box);
  if (Problem problem = firstOf({checkFinite(owner, "centre", box.centre),
                                 checkFinite(owner, "halfExtents", box.halfExtents),
                                 checkFinite(owner, "velocity", box.velocity),
                                 checkRestitution(owner, box.restitution),
                                 checkNotNegative(owner, "friction", "", box.friction),
                                 checkLaw(owner, box.restitutionLaw)})) {
    return problem;
  }
  const double least = box.halfExtents.minCoeff();
  if (least < 0.0) return error(owner, ": a half extent is ", least, " m; it must not be below 0");
  const double length = lengthOf(box.orientation);
  if (std::abs(length - 1.0) <= kNormalTolerance) return {};
  return error(owner, ": orientation has length ", length, "; it must be 1 within ",
               kNormalTolerance);
}

Problem checkIds(const SphereWorld& world) {
  std::vector<BodyId> ids;
  for (const Sphere& sphere : world.spheres)
    ids.push_back(sphere.id);
  for (const Plane& plane : world.planes)
    ids.push_back(plane.id);
  for (const Box& box : world.boxes)
    ids.push_back(box.id);
  std::sort(ids.begin(), ids.end());
  const auto twin = std::adjacent_find(ids.begin(), ids.end());
  if (ids.empty() || ids.back() == kAnchor)
    return ids.empty() ? Problem{} : error("id ", kAnchor, " means no body; ids must be below");
  if (twin == ids.end()) return {};
  return error("id ", *twin,
               " is used twice; every sphere, plane and box must have an id of its own");
}

Problem checkPairApart(const Sphere& sphere, const Sphere& other) {
  const Vec3 separation = sphere.position - other.position;
  const double distance = std::sqrt(dotInOrder(separation, separation));
  const double overlap = sphere.radius + other.radius - distance;
  const double allowed = kTouchingOverlap * std::min(sphere.radius, other.radius);
  if (overlap <= allowed) return {};
  return error(name(sphere), ": overlaps ", name(other), " by ", overlap,
               " m at time 0; spheres may touch, and overlap by at most ", allowed, " m");
}

Problem checkAbove(const Sphere& sphere, const Plane& plane) {
  const double shift = dotInOrder(plane.normal, plane.oscillation.amplitude) *
                       sineOfTurns(plane.oscillation.phase / kWholeTurn).sine;
  const double overlap =
      plane.offset + shift + sphere.radius - dotInOrder(plane.normal, sphere.position);
  const double allowed = kTouchingOverlap * sphere.radius;
  if (overlap <= allowed) return {};
  return error(
      name(sphere), ": overlaps ", name(plane), " by ", overlap,
      " m at time 0; it must be on the side of the normal, and may reach below by at most ",
      allowed, " m");
}

Problem checkOutside(const Sphere& sphere, const Box& box) {
  const Vec3 centre = along(columnsOf(box.orientation), sphere.position - box.centre);
  const double overlap = sphere.radius - nearestOf(box.halfExtents, centre).distance;
  const double allowed = kTouchingOverlap * sphere.radius;
  if (overlap <= allowed) return {};
  return error(name(sphere), ": overlaps ", name(box), " by ", overlap,
               " m at time 0, or is inside; it must be outside, and may overlap by at most ",
               allowed, " m");
}

Problem checkApart(const SphereWorld& world) {
  std::vector<Vec3> positions;
  std::vector<double> radii;
  for (const Sphere& sphere : world.spheres) {
    positions.push_back(sphere.position);
    radii.push_back(sphere.radius);
  }
  const CellGrid grid(positions, radii);
  for (std::uint32_t sphere = 0; sphere < world.spheres.size(); ++sphere) {
    Problem problem;
    grid.visitNear(sphere, {positions[sphere], radii[sphere], 0.0}, [&](std::uint32_t other) {
      if (!problem && other > sphere)
        problem = checkPairApart(world.spheres[sphere], world.spheres[other]);
    });
    if (problem) return problem;
    for (const Plane& plane : world.planes) {
      if ((problem = checkAbove(world.spheres[sphere], plane))) return problem;
    }
    for (const Box& box : world.boxes) {
      if ((problem = checkOutside(world.spheres[sphere], box))) return problem;
    }
  }
  return {};
}

Problem checkSettings(const SphereWorld& world) {
  if (!(std::isfinite(world.restSpeed) && world.restSpeed >= 0.0)) {
    return error("restSpeed is ", world.restSpeed, " m/s; it must be finite and not below 0");
  }
  return checkFinite("world", "gravity", world.gravity);
}

/// Checks both ends of a spring or rod: they must be spheres of the world, and different.
template <class Joint>
Problem checkEnds(const std::string& owner, const Joint& joint, std::span<const BodyId> ids) {
  for (const BodyId end : {joint.sphere, joint.other}) {
    if (!std::ranges::binary_search(ids, end) && !(end == joint.other && end == kAnchor))
      return error(owner, ": ends at ", end, "; it must be the id of a sphere",
                   " (or kAnchor, for the other end)");
  }
  if (joint.sphere == joint.other)
    return error(owner, ": begins and ends at sphere ", joint.sphere,
                 "; it must join two spheres, or one and a fixed point");
  return checkFinite(owner, "anchor", joint.anchor);
}

Problem checkSpring(const std::string& owner, const Spring& spring) {
  return firstOf({checkNotNegative(owner, "length", " m", spring.length),
                  checkNotNegative(owner, "stiffness", " N/m", spring.stiffness),
                  checkNotNegative(owner, "damping", " N s/m", spring.damping)});
}

Problem checkRod(const std::string& owner, const Rod& rod, const SphereWorld& world) {
  const auto positionOf = [&](BodyId id) {
    return std::ranges::find(world.spheres, id, &Sphere::id)->position;
  };
  const Vec3 end = rod.other == kAnchor ? rod.anchor : positionOf(rod.other);
  if (positionOf(rod.sphere) != end) return {};
  return error(owner, ": has length 0 at time 0; its ends must be apart");
}

Problem checkForces(const SphereWorld& world) {
  for (const ForceField& field : world.fields) {
    if (Problem problem = checkFinite("force field", "centre", field.centre)) return problem;
    if (!std::isfinite(field.harmonic) || !std::isfinite(field.inverseSquare))
      return error("force field: strengths are ", field.harmonic, " 1/s^2 and ",
                   field.inverseSquare, " m^3/s^2; they must be finite");
  }
  return firstOf({checkNotNegative("drag", "rate", " 1/s", world.drag.rate),
                  checkFinite("drag", "wind", world.drag.wind),
                  checkNotNegative("world", "forceStep", " s", world.forceStep)});
}

Problem checkJoints(const SphereWorld& world) {
  std::vector<BodyId> ids;
  for (const Sphere& sphere : world.spheres)
    ids.push_back(sphere.id);
  std::ranges::sort(ids);
  for (std::size_t i = 0; i < world.springs.size(); ++i) {
    const std::string owner = "spring " + std::to_string(i);
    if (Problem problem = checkEnds(owner, world.springs[i], ids)) return problem;
    if (Problem problem = checkSpring(owner, world.springs[i])) return problem;
  }
  for (std::size_t i = 0; i < world.rods.size(); ++i) {
    const std::string owner = "rod " + std::to_string(i);
    if (Problem problem = checkEnds(owner, world.rods[i], ids)) return problem;
    if (Problem problem = checkRod(owner, world.rods[i], world)) return problem;
  }
  return {};
}

Problem checkStiffness(const SphereWorld& world) {
  if (world.simultaneous != Simultaneous::hertz) return {};
  for (const Sphere& sphere : world.spheres) {
    if (Problem problem = checkPositive(name(sphere), "stiffness", "Pa", sphere.stiffness))
      return problem;
  }
  for (const Box& box : world.boxes) {
    if (Problem problem = checkPositive(name(box), "stiffness", "Pa", box.stiffness))
      return problem;
  }
  for (const Plane& plane : world.planes) {
    if (Problem problem = checkPositive(name(plane), "stiffness", "Pa", plane.stiffness))
      return problem;
  }
  return {};
}

Problem checkBodies(const SphereWorld& world) {
  for (const Sphere& sphere : world.spheres) {
    if (Problem problem = checkSphere(sphere)) return problem;
  }
  for (const Plane& plane : world.planes) {
    if (Problem problem = checkPlane(plane)) return problem;
  }
  for (const Box& box : world.boxes) {
    if (Problem problem = checkBox(box)) return problem;
  }
  return {};
}

}  // namespace

Result<SphereWorld> checkedWorld(SphereWorld world) {
  for (const auto check :
       {checkSettings, checkBodies, checkStiffness, checkIds, checkForces, checkJoints}) {
    if (Problem problem = check(world)) return *problem;
  }
  for (Plane& plane : world.planes) {
    plane.normal /= std::sqrt(dotInOrder(plane.normal, plane.normal));
  }
  for (Box& box : world.boxes) {
    const double length = lengthOf(box.orientation);
    for (double& part : box.orientation.coeffs())
      part /= length;
  }
  if (Problem problem = checkApart(world)) return *problem;
  return world;
}

}  // namespace carom::native
