// The part of Simulation that fills a Recording.

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "native/spheres/simulation.h"

namespace carom::native {
namespace {

/// Largest number of kinds of surfaces of which all restitutions are noted.
constexpr std::size_t kMostKinds = 16;

/// Surface and restitution of a body: they decide its pairs' restitutions.
using Kind = std::pair<SurfaceId, double>;

std::vector<double> restitutionsAmong(std::vector<Kind> kinds, const RestitutionTable& table) {
  std::ranges::sort(kinds);
  kinds.erase(std::unique(kinds.begin(), kinds.end()), kinds.end());
  std::vector<double> found;
  if (kinds.size() > kMostKinds) return found;
  for (std::size_t one = 0; one < kinds.size(); ++one) {
    for (std::size_t two = one; two < kinds.size(); ++two) {
      found.push_back(
          table.of(kinds[one].first, kinds[one].second, kinds[two].first, kinds[two].second));
    }
  }
  std::ranges::sort(found);
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return found;
}

}  // namespace

Recording::World Simulation::recordedWorld() const {
  Recording::World world;
  world.gravity = bodies_.gravity;
  std::vector<Kind> kinds;
  for (std::size_t sphere = 0; sphere < sphereCount(); ++sphere) {
    const Substance& body = substances_[sphere];
    world.spheres.push_back({bodies_.ids[sphere], bodies_.radii[sphere], body.mass});
    kinds.emplace_back(body.surface, body.restitution);
  }
  for (const Wall& wall : bodies_.walls) {
    const Plane& plane = wall.plane;
    kinds.emplace_back(plane.surface, plane.restitution);
    world.walls.push_back({plane.id, plane.normal, plane.offset, plane.velocity});
  }
  world.restitutions = restitutionsAmong(std::move(kinds), restitutions_);
  return world;
}

void Simulation::startRecording() {
  std::vector<Recording::Segment> segments;
  for (std::size_t sphere = 0; sphere < sphereCount(); ++sphere) {
    const Motion& motion = bodies_.motions[sphere];
    segments.push_back(
        {motion.since, motion.position, motion.velocity, bodies_.accelerations[sphere]});
  }
  recording_ = std::make_unique<Recording>(recordedWorld(), time_, segments);
}

Recording Simulation::takeRecording() {
  if (recording_ == nullptr) return {};
  Recording recording = std::move(*recording_);
  recording_.reset();
  recording.extendTo(time_);
  return recording;
}

void Simulation::record(std::uint32_t sphere) {
  const Motion& motion = bodies_.motions[sphere];
  recording_->addSegment(
      sphere, {motion.since, motion.position, motion.velocity, bodies_.accelerations[sphere]});
}

}  // namespace carom::native
