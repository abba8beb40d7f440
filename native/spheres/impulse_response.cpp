#include "native/spheres/impulse_response.h"

#include <algorithm>
#include <array>

#include "native/math/vector_math.h"
#include "native/mechanics/resting.h"

namespace carom::native {
namespace {

std::size_t memberIndex(std::uint32_t sphere, std::span<const std::uint32_t> members) {
  return static_cast<std::size_t>(std::ranges::lower_bound(members, sphere) - members.begin());
}

}  // namespace

double ImpulseResponse::compliance(const Vec3& normal) const {
  return dotInOrder(normal, velocityChange - otherVelocityChange);
}

/// A group of spheres on rods, and which of a pair are its members.
struct ResponseModel::Ends {
  std::uint32_t group = 0;
  bool hasSphere = false;
  bool hasOther = false;
};

ResponseModel::ResponseModel(const Parts& parts)
    : bodies_(parts.bodies),
      properties_(parts.properties),
      linkage_(parts.linkage),
      trajectories_(parts.trajectories) {}

/// Adds the response of all members of the group.
void ResponseModel::respond(const ContactPair& pair, const Ends& ends,
                            ImpulseResponse& response) const {
  const std::span<const std::uint32_t> members = linkage_.members(ends.group);
  std::vector<Vec3> impulses(members.size(), Vec3::Zero());
  if (ends.hasSphere) impulses[memberIndex(pair.sphere, members)] += pair.normal;
  if (ends.hasOther) impulses[memberIndex(pair.other, members)] -= pair.normal;
  const std::vector<Motion> motions = trajectories_.groupMotions(ends.group, trajectories_.now());
  const std::vector<Vec3> changes = linkage_.response(ends.group, motions, impulses);
  for (std::size_t i = 0; i < members.size(); ++i) {
    if (members[i] == pair.sphere) {
      response.velocityChange = changes[i];
    } else if (members[i] == pair.other) {
      response.otherVelocityChange = changes[i];
    } else {
      response.linked.emplace_back(members[i], changes[i]);
    }
  }
}

ImpulseResponse ResponseModel::impulseResponse(const ContactPair& pair) const {
  ImpulseResponse response;
  const bool alone = pair.other == ContactPair::kImmovable;
  const std::uint32_t group = linkage_.groupOf(pair.sphere);
  const std::uint32_t otherGroup = alone ? Linkage::kNoGroup : linkage_.groupOf(pair.other);
  const bool rods = linkage_.hasRods(pair.sphere);
  const bool otherRods = !alone && linkage_.hasRods(pair.other);
  const bool together = rods && otherRods && group == otherGroup;
  if (rods) respond(pair, {group, true, together}, response);
  if (otherRods && !together) respond(pair, {otherGroup, false, true}, response);
  if (!rods) response.velocityChange = velocityChange(pair.sphere, pair.normal);
  if (!alone && !otherRods) response.otherVelocityChange = velocityChange(pair.other, -pair.normal);
  return response;
}

Vec3 ResponseModel::velocityChange(std::uint32_t sphere, const Vec3& direction) const {
  if (bodies_.isAsleep(sphere)) return Vec3::Zero();
  std::array<Vec3, Holds::kMost> normals;
  const Holds& holds = bodies_.holds[sphere];
  for (std::size_t k = 0; k < holds.count; ++k)
    normals[k] = bodies_.walls[holds.walls[k]].plane.normal;
  const Carried carried = carriedBy(direction, {normals.data(), holds.count});
  return carried.acceleration / properties_.mass(sphere);
}

void applyToLinked(const ImpulseResponse& response, double impulse, Trajectories& trajectories) {
  for (const auto& [sphere, change] : response.linked) {
    Motion motion = trajectories.motion(sphere);
    motion.velocity += impulse * change;
    trajectories.changeMotion(sphere, motion);
  }
}

}  // namespace carom::native
