#pragma once

#include <cstdint>
#include <vector>

#include "carom/native/sphere_stepper.h"
#include "native/math/contact_time.h"
#include "native/scheduling/bodies.h"
#include "native/spheres/sphere_properties.h"
#include "native/spheres/trajectories.h"

namespace carom::native {

// These constants define rest and are documented in SphereStepper.
inline constexpr double kHopTime = 0.5e-3;        ///< s, of a hop that is paid for
inline constexpr double kLeastHopTime = 20e-6;    ///< s, of an unpaid hop
inline constexpr double kDampedHopTime = 0.1e-3;  ///< s, of an unpaid hop that forces damp
/// m/s: no unpaid hop is faster, and faster than its approach. Springs and rods may press at any
/// acceleration.
inline constexpr double kFastestUnpaidHop = 0.002;
inline constexpr double kWakeSpeed = 4.0;       ///< in rest speeds, below which spheres sleep on
inline constexpr double kRestingTime = 0.02;    ///< s, of rest in one place before sleep
inline constexpr double kLeastRebound = 1e-15;  ///< relative to the speed: above its rounding

/// Which spheres come to rest: their rest speeds, the energy that they may still spend on hops, how
/// long each has stayed in one place, and which have collapsed. SphereStepper documents the rules
/// under Rest and Collapse.
///
/// Reads the bodies, their properties and now(). Changes its own records and counters; puts a
/// sphere to sleep, or removes it from all contacts, whose contacts leave it no time. Internal to
/// native/.
class RestTracker {
 public:
  /// All references must outlive the tracker.
  struct Parts {
    const Bodies& bodies;
    const SphereProperties& properties;
    Trajectories& trajectories;
    SphereStepperCounters& counters;
  };

  /// `restSpeed` is SphereWorld::restSpeed (m/s).
  RestTracker(const Parts& parts, double restSpeed);

  /// Speed in m/s below which contacts of the sphere are rest.
  double restSpeed(std::uint32_t sphere) const;
  /// Speed in m/s below which contacts of the two are rest.
  double restSpeed(std::uint32_t sphere, std::uint32_t other) const;
  /// Largest gap in m at which a body of this radius is in contact with another, to allow for their
  /// hops.
  double contactGap(double radius) const;

  /// Adds energy (J) that a contact has taken to the sphere's budget for bounces off bodies on
  /// which it rests, up to the energy of one long hop.
  void addBounceEnergy(std::uint32_t sphere, double energy);
  /// Takes `energy` J from the budget; false, with nothing taken, if there is less.
  bool payForBounce(std::uint32_t sphere, double energy);
  /// Takes `energy` J from the budgets of both, the first one's first; false, with nothing taken,
  /// if there is less.
  bool payForBounce(std::uint32_t sphere, std::uint32_t other, double energy);

  /// Records a contact of a sphere that arrives along `motion`; returns true if it has just
  /// collapsed.
  bool recordContact(std::uint32_t sphere, const Motion& motion);
  /// Counts a contact as too slow to be reported.
  void countRestContact() { ++counters_.restContacts; }
  /// Stops a sphere that has collapsed in rest contacts: it has no room left to move in, and may
  /// sleep at once.
  void stop(std::uint32_t sphere, Motion& motion);

  /// Time in s for which the sphere has stayed in one place; -infinity if it has not.
  double restingTime(std::uint32_t sphere) const;
  /// Lets some time pass before the sphere has been at rest for kRestingTime again.
  void postponeSleep(std::uint32_t sphere);
  /// Forgets for how long the sphere has been at rest.
  void restartResting(std::uint32_t sphere) { records_[sphere].restingSince = kNever; }

 private:
  struct Record {
    double bounceEnergyBudget = 0.0;   ///< J
    double restingSince = kNever;      ///< s, since when the sphere has kept to `restingPlace`
    Vec3 restingPlace = Vec3::Zero();  ///< m
    std::uint16_t rapidContacts = 0;   ///< number of contacts in a row, 1 us apart or less
    bool collapsed = false;            ///< true after a collapse: its rest speed is raised
  };

  double longHopEnergy(std::uint32_t sphere) const;
  void recordPlace(std::uint32_t sphere, const Vec3& position);
  void collapse(std::uint32_t sphere, double interval);
  void giveUp(std::uint32_t sphere, double interval);

  const Bodies& bodies_;
  const SphereProperties& properties_;
  Trajectories& trajectories_;
  SphereStepperCounters& counters_;

  double restSpeed_;             ///< m/s
  std::vector<Record> records_;  ///< by sphere
};

}  // namespace carom::native
