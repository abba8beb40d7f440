#pragma once

#include <cstdint>
#include <vector>

#include "carom/audio/impulse_event.h"
#include "carom/native/sphere_stepper.h"
#include "native/scheduling/bodies.h"
#include "native/spheres/event_pair.h"
#include "native/spheres/trajectories.h"
#include "native/spheres/trajectory_recorder.h"

namespace carom::native {

/// Makes the two events of each collision at the present event, and keeps them for the caller of
/// SphereStepper::advanceTo.
///
/// Reads the bodies, their spins and now(); changes its events and their counter, and tells the
/// recorder. Internal to native/.
class CollisionReporter {
 public:
  /// All references must outlive the reporter.
  struct Parts {
    const Bodies& bodies;
    const Trajectories& trajectories;
    TrajectoryRecorder& recorder;
    SphereStepperCounters& counters;
  };

  explicit CollisionReporter(const Parts& parts);

  /// Reports a collision of `first`, which is a sphere, with `second`.
  void report(const Side& first, const Side& second, const Impact& impact);
  const std::vector<ImpulseEvent>& events() const { return events_; }
  void clear() { events_.clear(); }

  /// The side of a sphere that has arrived along `motion`.
  Side sideOf(std::uint32_t sphere, const Motion& motion) const;
  /// The side of a wall that is struck at `point` (m): a plane is placed there, a face where its
  /// box is.
  Side sideOf(const Wall& wall, const Vec3& point) const;
  /// The side of a box that is struck at an edge or corner.
  Side edgeSideOf(const Solid& solid) const;

 private:
  const Bodies& bodies_;
  const Trajectories& trajectories_;
  TrajectoryRecorder& recorder_;
  SphereStepperCounters& counters_;

  std::vector<ImpulseEvent> events_;
};

}  // namespace carom::native
