#include "native/spheres/trajectory_recorder.h"

#include <utility>
#include <vector>

namespace carom::native {

Recording::World TrajectoryRecorder::recordedWorld() const {
  Recording::World world;
  world.gravity = bodies_.gravity;
  for (std::size_t sphere = 0; sphere < bodies_.count(); ++sphere)
    world.spheres.push_back({bodies_.ids[sphere], bodies_.radii[sphere], properties_.mass(sphere)});
  for (const Wall& wall : bodies_.walls) {
    const Plane& plane = wall.plane;
    world.walls.push_back({plane.id, plane.normal, plane.offset, plane.velocity});
  }
  world.restitutions = properties_.restitutionsAmong(bodies_.walls);
  return world;
}

Recording::Segment TrajectoryRecorder::segmentOf(std::size_t sphere) const {
  const Motion& motion = bodies_.motions[sphere];
  return {motion.since, motion.position, motion.velocity, bodies_.accelerations[sphere]};
}

void TrajectoryRecorder::start(double time) {
  std::vector<Recording::Segment> segments;
  for (std::size_t sphere = 0; sphere < bodies_.count(); ++sphere)
    segments.push_back(segmentOf(sphere));
  recording_ = std::make_unique<Recording>(recordedWorld(), time, segments);
}

Recording TrajectoryRecorder::take(double time) {
  if (recording_ == nullptr) return {};
  Recording recording = std::move(*recording_);
  recording_.reset();
  recording.extendTo(time);
  return recording;
}

}  // namespace carom::native
