#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "native/mechanics/linkage.h"
#include "native/mechanics/rolling.h"
#include "native/scheduling/bodies.h"
#include "native/scheduling/event_scheduler.h"
#include "native/spheres/conservation_ledger.h"
#include "native/spheres/sphere_properties.h"
#include "native/spheres/trajectory_recorder.h"

namespace carom::native {

/// The motions of the spheres as they change at the present event, now(). An event gives new
/// velocities by changeMotion; walls that hold a sphere, rolling, and springs, rods and fields then
/// decide how it moves on. When the event is over, predictChanged() predicts the spheres that it
/// has changed anew.
///
/// The only class that changes Bodies. Reads SphereProperties and Linkage. Tells the scheduler
/// about each change, the ledger what it does to momentum and energy, and the recorder each new
/// motion. Internal to native/.
class Trajectories {
 public:
  /// All references must outlive the Trajectories.
  struct Parts {
    Bodies& bodies;
    const SphereProperties& properties;
    const Linkage& linkage;
    EventScheduler& scheduler;
    ConservationLedger& ledger;
    TrajectoryRecorder& recorder;
  };

  explicit Trajectories(const Parts& parts);

  /// Begins at time 0: rods take back any velocity that would change their lengths, the ledger
  /// opens, and all spheres are predicted. To be called once, first.
  void begin();

  const Instant& now() const { return now_; }  ///< instant of the present event
  void setNow(const Instant& instant) { now_ = instant; }

  /// Motion of the sphere at now(), as if it began there.
  Motion motion(std::size_t sphere) const { return bodies_.at(sphere, now_); }
  /// Motions of the members of a group of the Linkage at `instant`.
  std::vector<Motion> groupMotions(std::uint32_t group, const Instant& instant) const;
  Vec3 spin(std::size_t sphere, const Instant& instant) const;  ///< rad/s
  /// Acceleration (m/s^2) by everything but contacts.
  Vec3 freeAcceleration(std::uint32_t sphere) const {
    return isLinked(sphere) ? freeAccelerations_[sphere] : bodies_.gravity;
  }
  /// True if springs, rods, fields or drag act on the sphere.
  bool isLinked(std::size_t sphere) const { return linkage_.groupOf(sphere) != Linkage::kNoGroup; }

  /// Sets the sphere on a new motion from `motion.since` on; predictions that others made with it
  /// become outdated.
  void changeMotion(std::uint32_t sphere, const Motion& motion);
  /// Adds to the spin (rad/s) of a sphere whose motion is about to change.
  void addSpin(std::uint32_t sphere, const Vec3& change) { spins_[sphere].velocity += change; }
  /// Makes the wall hold the sphere from its next changeMotion on, for as long as the sphere is
  /// pressed against it. Where three walls hold it already, `motion` loses its velocity.
  void hold(std::uint32_t sphere, std::uint32_t wall, Motion& motion);
  /// Ends the hold of a wall.
  void release(std::uint32_t sphere, std::uint32_t wall) { bodies_.holds[sphere].drop(wall); }
  /// Marks the sphere as asleep or awake; its next changeMotion stops it, or lets it move.
  void setAsleep(std::uint32_t sphere, bool asleep) { bodies_.asleep[sphere] = asleep ? 1 : 0; }
  /// Removes the sphere from all contacts for good; must be followed by changeMotion.
  void removeFromContacts(std::uint32_t sphere) { scheduler_.remove(sphere); }
  /// Carries out the change of a motion by itself at now(): a step of the sphere's group ends, or
  /// it begins to roll, or stops.
  void turn(std::uint32_t sphere);
  /// Lets the rods of the spheres take back all velocity that would change the rods' lengths, after
  /// contacts in which they have not taken part. Exact where they are at right angles to the
  /// contacts, as in a cradle; otherwise energy is lost.
  void settleRods(std::span<const std::uint32_t> spheres);
  void settleRods(std::uint32_t sphere) { settleRods(std::span(&sphere, 1)); }

  /// Predicts anew all spheres whose motions have changed since the last call.
  void predictChanged();

 private:
  double rebase(std::uint32_t sphere, const Motion& motion);
  void moveAlongWalls(std::uint32_t sphere);
  double roll(std::uint32_t sphere);
  void restartGroup(std::uint32_t group);
  void restartGroups();
  void settleGroup(std::uint32_t group);

  Bodies& bodies_;
  const SphereProperties& properties_;
  const Linkage& linkage_;
  EventScheduler& scheduler_;
  ConservationLedger& ledger_;
  TrajectoryRecorder& recorder_;

  Instant now_;
  std::vector<Spin> spins_;              ///< by sphere; empty if no sphere rubs or spins
  std::vector<Vec3> freeAccelerations_;  ///< m/s^2, by sphere; empty if no sphere is linked
  std::vector<std::uint32_t> restarts_;  ///< groups that begin a new step before the prediction
  std::vector<std::uint32_t> changed_;   ///< spheres changed since the last prediction
};

}  // namespace carom::native
