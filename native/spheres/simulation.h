#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "carom/audio/result.h"
#include "carom/native/recording.h"
#include "carom/native/sphere_stepper.h"
#include "native/mechanics/linkage.h"
#include "native/scheduling/bodies.h"
#include "native/scheduling/event_scheduler.h"
#include "native/spheres/cluster_contacts.h"
#include "native/spheres/collision_reporter.h"
#include "native/spheres/conservation_ledger.h"
#include "native/spheres/contact_parts.h"
#include "native/spheres/edge_contacts.h"
#include "native/spheres/impulse_response.h"
#include "native/spheres/oscillating_contacts.h"
#include "native/spheres/rest_tracker.h"
#include "native/spheres/sleep_controller.h"
#include "native/spheres/sphere_contacts.h"
#include "native/spheres/sphere_properties.h"
#include "native/spheres/trajectories.h"
#include "native/spheres/trajectory_recorder.h"
#include "native/spheres/wall_contacts.h"

namespace carom::native {

/// The implementation of SphereStepper: takes one event after the other from the scheduler, and
/// gives it to the class that resolves it.
///
///     EventScheduler  which event is next; predicts the next event of a sphere
///       SphereContacts, WallContacts, EdgeContacts, OscillatingContacts, ClusterContacts
///                     give spheres new velocities at a contact
///         RestTracker, SleepController   slow contacts, rest and sleep
///         CollisionReporter              the events that the caller gets
///       Trajectories  the motions from there on; has changed spheres predicted anew
///         ConservationLedger, TrajectoryRecorder   what has changed
///
/// Each of them says in its header what it reads and what it changes. Spheres are numbered in order
/// of their ids. Internal to native/.
class Simulation {
 public:
  explicit Simulation(const SphereWorld& world);
  Simulation(const Simulation&) = delete;
  Simulation& operator=(const Simulation&) = delete;

  void advanceTo(double time, std::size_t mostEvents);
  /// Applies an impulse (N s) at time(). Here and below, `listed` is a position in
  /// SphereWorld::spheres.
  void push(std::size_t listed, const Vec3& impulse);

  void startRecording() { recorder_.start(time_); }
  Recording takeRecording() { return recorder_.take(time_); }  ///< ends the recording

  /// Events of the last advanceTo.
  const std::vector<ImpulseEvent>& events() const { return reporter_.events(); }
  double time() const { return time_; }  ///< s
  std::size_t sphereCount() const { return bodies_.count(); }
  const SphereStepperCounters& counters() const { return counters_; }
  Motion motionOf(std::size_t listed) const { return present(order_[listed]); }  ///< at time()
  Vec3 spinOf(std::size_t listed) const;                                         ///< rad/s
  double kineticEnergy() const;                                                  ///< J
  double potentialEnergy() const;                                                ///< J
  Status validate() const;

 private:
  Simulation(const SphereWorld& world, std::vector<std::uint32_t> listed);

  /// Motion of a sphere, given by its number, at time().
  Motion present(std::size_t sphere) const { return bodies_.at(sphere, {time_, 0.0}); }

  void step(std::uint32_t sphere);
  void meet(std::uint32_t sphere, const EventScheduler::Contact& contact);
  void meetImmovable(std::uint32_t sphere, std::uint32_t index, bool tied);
  void meetBox(std::uint32_t sphere, const Solid& solid, bool tied);

  Status validateSphere(std::size_t sphere) const;
  Status validateHolds(std::size_t sphere) const;
  Status validateApart(std::size_t sphere) const;
  Status validateOutside(std::size_t sphere) const;

  // In the order in which they are built: each refers to some of those before it.
  std::vector<std::uint32_t> order_;  ///< by position in SphereWorld::spheres: number of the sphere
  Bodies bodies_;
  SphereProperties properties_;
  Linkage linkage_;
  EventScheduler scheduler_;
  SphereStepperCounters counters_;
  ConservationLedger ledger_;
  TrajectoryRecorder recorder_;
  Trajectories trajectories_;
  RestTracker rest_;
  SleepController sleep_;
  CollisionReporter reporter_;
  ResponseModel responses_;
  ContactParts parts_;
  ClusterContacts clusters_;
  SphereContacts sphereContacts_;
  WallContacts wallContacts_;
  EdgeContacts edgeContacts_;
  OscillatingContacts oscillatingContacts_;

  double time_ = 0.0;  ///< s, at which advanceTo stopped
};

}  // namespace carom::native
