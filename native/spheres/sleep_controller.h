#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "carom/native/sphere_stepper.h"
#include "native/scheduling/bodies.h"
#include "native/scheduling/event_scheduler.h"
#include "native/spheres/rest_tracker.h"
#include "native/spheres/trajectories.h"

namespace carom::native {

/// Puts spheres to sleep that have been at rest and carry each other, and wakes them. SphereStepper
/// documents the rules under Sleep.
///
/// Reads the bodies and their neighbourhoods (the scheduler's). Changes the motions of the spheres
/// that fall asleep or wake, their time of rest, and counters. Internal to native/.
class SleepController {
 public:
  /// All references must outlive the controller.
  struct Parts {
    const Bodies& bodies;
    const EventScheduler& scheduler;
    Trajectories& trajectories;
    RestTracker& rest;
    SphereStepperCounters& counters;
  };

  explicit SleepController(const Parts& parts);

  /// Puts the sphere to sleep, with the spheres that it rests among, if it has been at rest for
  /// long enough and all of them are carried.
  void trySleep(std::uint32_t sphere);
  /// Wakes the sphere if it sleeps, and those that sleep on it if nothing else carries them.
  void wake(std::uint32_t sphere);

 private:
  bool isInContact(std::uint32_t sphere, const Vec3& position, std::uint32_t other) const;
  std::vector<std::uint32_t> restingNeighbours(std::uint32_t sphere) const;
  bool isCarriedByWalls(std::uint32_t sphere) const;
  bool isCarried(std::uint32_t sphere, std::span<const std::uint32_t> candidates) const;
  void putToSleep(std::uint32_t sphere);

  const Bodies& bodies_;
  const EventScheduler& scheduler_;
  Trajectories& trajectories_;
  RestTracker& rest_;
  SphereStepperCounters& counters_;
};

}  // namespace carom::native
