#include "native/spheres/collision_reporter.h"

namespace carom::native {

CollisionReporter::CollisionReporter(const Parts& parts)
    : bodies_(parts.bodies),
      trajectories_(parts.trajectories),
      recorder_(parts.recorder),
      counters_(parts.counters) {}

void CollisionReporter::report(const Side& first, const Side& second, const Impact& impact) {
  ++counters_.collisions;
  const Instant& now = trajectories_.now();
  const Recording::Events events = eventsOf(first, second, impact, now.seconds);
  events_.insert(events_.end(), events.begin(), events.end());
  recorder_.addCollision(events, now, impact.impulse);
}

Side CollisionReporter::sideOf(std::uint32_t sphere, const Motion& motion) const {
  return {bodies_.ids[sphere], bodies_.radii[sphere],
          motion.position,     motion.velocity,
          Quat::Identity(),    trajectories_.spin(sphere, trajectories_.now())};
}

Side CollisionReporter::sideOf(const Wall& wall, const Vec3& point) const {
  if (wall.box == Wall::kNoBox) return {wall.plane.id, kNever, point, wall.plane.velocity};
  Side side = edgeSideOf(bodies_.solids[wall.box]);
  side.radius = kNever;
  return side;
}

Side CollisionReporter::edgeSideOf(const Solid& solid) const {
  return {solid.box.id, 0.0, solid.centreAt(trajectories_.now()), solid.box.velocity,
          solid.box.orientation};
}

}  // namespace carom::native
