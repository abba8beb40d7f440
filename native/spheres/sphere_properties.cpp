#include "native/spheres/sphere_properties.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "native/math/sort_unique.h"

namespace carom::native {
namespace {

/// Largest number of kinds of surfaces of which all restitutions are listed.
constexpr std::size_t kMostKinds = 16;

/// Surface and restitution of a body: they decide its pairs' restitutions.
using Kind = std::pair<SurfaceId, double>;

double combinedFriction(double friction, double otherFriction) {
  return std::sqrt(friction * otherFriction);
}

bool restitutionVaries(const SphereWorld& world) {
  const auto varies = [](const auto& body) {
    return body.restitutionLaw.law != SpeedLaw::constant;
  };
  return std::ranges::any_of(world.spheres, varies) || std::ranges::any_of(world.planes, varies) ||
         std::ranges::any_of(world.boxes, varies);
}

bool rubsOrSpins(const Sphere& sphere) {
  return sphere.friction.sliding > 0.0 || sphere.friction.spin != Vec3::Zero();
}

}  // namespace

SphereProperties::SphereProperties(const SphereWorld& world, std::span<const std::uint32_t> listed)
    : restitutions_(world.restitutions) {
  spheres_.reserve(listed.size());
  const bool varies = restitutionVaries(world);
  const bool rubs = std::ranges::any_of(world.spheres, rubsOrSpins);
  const bool differ = std::ranges::any_of(
      world.spheres, [](const Sphere& sphere) { return sphere.surface != SurfaceId{0}; });
  for (const std::uint32_t at : listed) {
    const Sphere& sphere = world.spheres[at];
    spheres_.push_back({sphere.mass, sphere.restitution});
    if (differ) surfaces_.push_back(sphere.surface);
    if (varies) laws_.push_back(sphere.restitutionLaw);
    if (rubs) frictions_.push_back(sphere.friction);
    if (world.simultaneous == Simultaneous::hertz) stiffnesses_.push_back(sphere.stiffness);
  }
}

double SphereProperties::restitution(std::uint32_t sphere, std::uint32_t other,
                                     double approachSpeed) const {
  const Properties& one = spheres_[sphere];
  const Properties& two = spheres_[other];
  if (laws_.empty())
    return restitutions_.of(surfaceOf(sphere), one.restitution, surfaceOf(other), two.restitution);
  return restitutions_.of(
      surfaceOf(sphere), restitutionAt(one.restitution, laws_[sphere], approachSpeed),
      surfaceOf(other), restitutionAt(two.restitution, laws_[other], approachSpeed));
}

double SphereProperties::wallRestitution(std::uint32_t sphere, const Plane& plane,
                                         double approachSpeed) const {
  const Properties& body = spheres_[sphere];
  if (laws_.empty())
    return restitutions_.of(surfaceOf(sphere), body.restitution, plane.surface, plane.restitution);
  return restitutions_.of(
      surfaceOf(sphere), restitutionAt(body.restitution, laws_[sphere], approachSpeed),
      plane.surface, restitutionAt(plane.restitution, plane.restitutionLaw, approachSpeed));
}

std::vector<double> SphereProperties::restitutionsAmong(std::span<const Wall> walls) const {
  std::vector<Kind> kinds;
  for (std::size_t sphere = 0; sphere < spheres_.size(); ++sphere)
    kinds.emplace_back(surfaceOf(sphere), spheres_[sphere].restitution);
  for (const Wall& wall : walls)
    kinds.emplace_back(wall.plane.surface, wall.plane.restitution);
  sortUnique(kinds);
  std::vector<double> found;
  if (kinds.size() > kMostKinds) return found;
  for (std::size_t one = 0; one < kinds.size(); ++one) {
    for (std::size_t two = one; two < kinds.size(); ++two) {
      found.push_back(restitutions_.of(kinds[one].first, kinds[one].second, kinds[two].first,
                                       kinds[two].second));
    }
  }
  sortUnique(found);
  return found;
}

double SphereProperties::slidingFriction(std::uint32_t sphere, std::uint32_t other) const {
  return combinedFriction(frictions_[sphere].sliding, frictions_[other].sliding);
}

double SphereProperties::slidingFriction(std::uint32_t sphere, const Plane& plane) const {
  return combinedFriction(frictions_[sphere].sliding, plane.friction);
}

}  // namespace carom::native
