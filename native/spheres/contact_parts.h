#pragma once

#include "native/mechanics/linkage.h"
#include "native/scheduling/bodies.h"
#include "native/scheduling/event_scheduler.h"
#include "native/spheres/collision_reporter.h"
#include "native/spheres/conservation_ledger.h"
#include "native/spheres/impulse_response.h"
#include "native/spheres/rest_tracker.h"
#include "native/spheres/sleep_controller.h"
#include "native/spheres/sphere_properties.h"
#include "native/spheres/trajectories.h"

namespace carom::native {

/// The parts of a simulation that the resolution of contacts reads or changes. Each class that
/// resolves contacts keeps those that it needs; all of them must outlive it. Internal to native/.
struct ContactParts {
  // Read only:
  const Bodies& bodies;
  const SphereProperties& properties;
  const Linkage& linkage;
  const EventScheduler& scheduler;
  const ResponseModel& responses;
  // Changed by contacts:
  Trajectories& trajectories;
  RestTracker& rest;
  SleepController& sleep;
  CollisionReporter& reporter;
  ConservationLedger& ledger;
};

}  // namespace carom::native
