#include "native/spheres/sleep_controller.h"

#include <algorithm>
#include <array>

#include "native/math/vector_math.h"
#include "native/mechanics/resting.h"

namespace carom::native {
namespace {

constexpr double kSleepPull = 1e-3;  ///< share of gravity that may stay uncarried; as documented

/// Normals of the surfaces that a sphere is in contact with; those beyond kMostSurfaces are left
/// out.
struct ContactNormals {
  std::array<Vec3, kMostSurfaces> normals;
  std::size_t count = 0;

  bool isFull() const { return count == normals.size(); }
  void add(const Vec3& normal) { normals[count++] = normal; }
};

/// A sphere as SleepController looks for what carries it.
struct Resting {
  std::uint32_t sphere = 0;
  Vec3 position;     ///< m
  double gap = 0.0;  ///< m, up to which it is in contact
  Instant now;
};

/// Adds the walls and boxes at rest that the sphere is in contact with.
void addSurfacesAtRest(const Bodies& bodies, const Resting& resting, ContactNormals& contacts) {
  for (const Wall& wall : std::span(bodies.walls).first(bodies.steady)) {
    if (contacts.isFull() || wall.speed != 0.0) continue;
    if (bodies.height(resting.sphere, wall, resting.position, resting.now) <= resting.gap)
      contacts.add(wall.plane.normal);
  }
  for (const Solid& solid : bodies.solids) {
    if (contacts.isFull() || solid.box.velocity != Vec3::Zero()) continue;
    const BoxNearest nearest = bodies.nearest(solid, resting.position, resting.now);
    if (nearest.distance - bodies.radii[resting.sphere] <= resting.gap)
      contacts.add(solid.toWorld(nearest.normal));
  }
}

}  // namespace

SleepController::SleepController(const Parts& parts)
    : bodies_(parts.bodies),
      scheduler_(parts.scheduler),
      trajectories_(parts.trajectories),
      rest_(parts.rest),
      counters_(parts.counters) {}

bool SleepController::isInContact(std::uint32_t sphere, const Vec3& position,
                                  std::uint32_t other) const {
  const double radius = bodies_.radii[sphere];
  const double otherRadius = bodies_.radii[other];
  const double reach = radius + otherRadius + rest_.contactGap(std::min(radius, otherRadius));
  const Vec3 separation = position - trajectories_.motion(other).position;
  return dotInOrder(separation, separation) <= reach * reach;
}

/// The resting spheres that are connected with this one by contacts of resting spheres, in
/// ascending order, this one among them.
std::vector<std::uint32_t> SleepController::restingNeighbours(std::uint32_t sphere) const {
  std::vector<std::uint32_t> found{sphere};
  for (std::size_t next = 0; next < found.size(); ++next) {
    const std::uint32_t at = found[next];
    const Vec3 position = trajectories_.motion(at).position;
    const double gap = rest_.contactGap(bodies_.radii[at]);
    scheduler_.visitNear(at, position, gap, [&](std::uint32_t other) {
      if (!bodies_.isAsleep(other) && rest_.restingTime(other) >= 0.5 * kRestingTime &&
          isInContact(at, position, other) && std::ranges::find(found, other) == found.end())
        found.push_back(other);
    });
  }
  std::ranges::sort(found);
  return found;
}

/// True if the sphere is carried by walls and boxes at rest, and by those sleeping spheres and
/// candidates (in ascending order) that it is in contact with.
bool SleepController::isCarried(std::uint32_t sphere,
                                std::span<const std::uint32_t> candidates) const {
  ContactNormals contacts;
  const Vec3 position = trajectories_.motion(sphere).position;
  const double gap = rest_.contactGap(bodies_.radii[sphere]);
  addSurfacesAtRest(bodies_, {sphere, position, gap, trajectories_.now()}, contacts);
  scheduler_.visitNear(sphere, position, gap, [&](std::uint32_t other) {
    if (contacts.isFull() || !isInContact(sphere, position, other)) return;
    if (!bodies_.isAsleep(other) && !std::ranges::binary_search(candidates, other)) return;
    const Vec3 separation = position - trajectories_.motion(other).position;
    contacts.add(separation / lengthOf(separation));
  });
  const Vec3 left =
      carriedBy(bodies_.gravity, {contacts.normals.data(), contacts.count}).acceleration;
  return lengthOf(left) <= kSleepPull * lengthOf(bodies_.gravity);
}

/// True if the sphere rests on walls without the help of other spheres.
bool SleepController::isCarriedByWalls(std::uint32_t sphere) const {
  return bodies_.holds[sphere].count > 0 && bodies_.accelerations[sphere] == Vec3::Zero();
}

void SleepController::trySleep(std::uint32_t sphere) {
  if (bodies_.isAsleep(sphere) || !(rest_.restingTime(sphere) >= kRestingTime)) return;
  if (bodies_.gravity == Vec3::Zero() || isCarriedByWalls(sphere)) return;
  std::vector<std::uint32_t> candidates = restingNeighbours(sphere);
  for (bool dropped = true; dropped;) {  // until the remaining spheres carry each other
    // Not std::ranges::partition: Clang 14 does not compile that of libstdc++ 12.
    const auto fallen =
        std::partition(candidates.begin(), candidates.end(),
                       [&, all = candidates](std::uint32_t at) { return isCarried(at, all); });
    dropped = fallen != candidates.end();
    candidates.erase(fallen, candidates.end());
    std::ranges::sort(candidates);
  }
  if (!std::ranges::binary_search(candidates, sphere)) rest_.postponeSleep(sphere);
  for (const std::uint32_t at : candidates)
    putToSleep(at);
}

void SleepController::putToSleep(std::uint32_t sphere) {
  ++counters_.putToSleep;
  trajectories_.setAsleep(sphere, true);
  Motion motion = trajectories_.motion(sphere);
  motion.velocity.setZero();
  trajectories_.changeMotion(sphere, motion);
}

void SleepController::wake(std::uint32_t sphere) {
  if (!bodies_.isAsleep(sphere)) return;
  std::vector<std::uint32_t> woken{sphere};
  while (!woken.empty()) {
    const std::uint32_t at = woken.back();
    woken.pop_back();
    if (!bodies_.isAsleep(at)) continue;
    ++counters_.woken;
    trajectories_.setAsleep(at, false);
    rest_.restartResting(at);
    trajectories_.changeMotion(at, trajectories_.motion(at));
    const Vec3 position = bodies_.motions[at].position;
    const double gap = rest_.contactGap(bodies_.radii[at]);
    scheduler_.visitNear(at, position, gap, [&](std::uint32_t other) {
      if (bodies_.isAsleep(other) && isInContact(at, position, other) && !isCarried(other, {}))
        woken.push_back(other);
    });
  }
}

}  // namespace carom::native
