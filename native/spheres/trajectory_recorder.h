#pragma once

#include <cstdint>
#include <memory>

#include "carom/native/recording.h"
#include "native/scheduling/bodies.h"
#include "native/spheres/sphere_properties.h"

namespace carom::native {

/// Writes what happens into a Recording, from start() until take(). Otherwise the functions that
/// add something do nothing, and cost one test of a null pointer.
///
/// Reads the bodies and their properties; changes nothing but its own Recording. Internal to
/// native/.
class TrajectoryRecorder {
 public:
  /// Keeps references to both arguments, which must outlive the recorder.
  TrajectoryRecorder(const Bodies& bodies, const SphereProperties& properties)
      : bodies_(bodies), properties_(properties) {}

  /// Begins a new Recording at `time` s with the present motions; drops an earlier one.
  void start(double time);
  /// Ends the Recording at `time` s and returns it; an empty one if none was started.
  Recording take(double time);

  /// Adds the present motion of the sphere, which has just begun.
  void addMotion(std::uint32_t sphere) {
    if (recording_ != nullptr) recording_->addSegment(sphere, segmentOf(sphere));
  }
  /// Adds the events of a collision at `instant`, before the motions to which it leads. `impulse`
  /// in N s acts on the first body along the normal.
  void addCollision(const Recording::Events& events, const Instant& instant, double impulse) {
    if (recording_ != nullptr) recording_->addCollision(events, instant, impulse);
  }

 private:
  Recording::World recordedWorld() const;
  Recording::Segment segmentOf(std::size_t sphere) const;

  const Bodies& bodies_;
  const SphereProperties& properties_;
  std::unique_ptr<Recording> recording_;  ///< null if nothing is recorded
};

}  // namespace carom::native
