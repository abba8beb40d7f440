#include "native/world_check.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>
#include <utility>

#include "native/cell_grid.h"
#include "native/contact_time.h"

namespace carom {
namespace {

constexpr double kNormalTolerance = 1e-9;  ///< of the length of a plane's normal

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

Problem checkSphere(const Sphere& sphere) {
  const std::string owner = name(sphere);
  return firstOf({checkPositive(owner, "radius", "m", sphere.radius),
                  checkPositive(owner, "mass", "kg", sphere.mass),
                  checkRestitution(owner, sphere.restitution),
                  checkFinite(owner, "position", sphere.position),
                  checkFinite(owner, "velocity", sphere.velocity)});
}

Problem checkPlane(const Plane& plane) {
  const std::string owner = name(plane);
  if (Problem problem = firstOf({checkFinite(owner, "normal", plane.normal),
                                 checkRestitution(owner, plane.restitution)})) {
    return problem;
  }
  const double length = std::sqrt(dotInOrder(plane.normal, plane.normal));
  if (!(std::abs(length - 1.0) <= kNormalTolerance)) {
    return error(owner, ": normal has length ", length, "; it must be 1 within ", kNormalTolerance);
  }
  if (std::isfinite(plane.offset)) return {};
  return error(owner, ": offset is ", plane.offset, " m; it must be finite");
}

Problem checkIds(const SphereWorld& world) {
  std::vector<BodyId> ids;
  for (const Sphere& sphere : world.spheres)
    ids.push_back(sphere.id);
  for (const Plane& plane : world.planes)
    ids.push_back(plane.id);
  std::sort(ids.begin(), ids.end());
  const auto twin = std::adjacent_find(ids.begin(), ids.end());
  if (twin == ids.end()) return {};
  return error("id ", *twin, " is used twice; every sphere and plane must have an id of its own");
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
  const double overlap = plane.offset + sphere.radius - dotInOrder(plane.normal, sphere.position);
  const double allowed = kTouchingOverlap * sphere.radius;
  if (overlap <= allowed) return {};
  return error(
      name(sphere), ": overlaps ", name(plane), " by ", overlap,
      " m at time 0; it must be on the side of the normal, and may reach below by at most ",
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
  }
  return {};
}

Problem checkSettings(const SphereWorld& world) {
  if (!(std::isfinite(world.restSpeed) && world.restSpeed >= 0.0)) {
    return error("restSpeed is ", world.restSpeed, " m/s; it must be finite and not below 0");
  }
  return checkFinite("world", "gravity", world.gravity);
}

Problem checkBodies(const SphereWorld& world) {
  for (const Sphere& sphere : world.spheres) {
    if (Problem problem = checkSphere(sphere)) return problem;
  }
  for (const Plane& plane : world.planes) {
    if (Problem problem = checkPlane(plane)) return problem;
  }
  return {};
}

}  // namespace

Result<SphereWorld> checkedWorld(SphereWorld world) {
  for (const auto check : {checkSettings, checkBodies, checkIds}) {
    if (Problem problem = check(world)) return *problem;
  }
  for (Plane& plane : world.planes) {
    plane.normal /= std::sqrt(dotInOrder(plane.normal, plane.normal));
  }
  if (Problem problem = checkApart(world)) return *problem;
  return world;
}

}  // namespace carom
