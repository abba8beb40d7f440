#pragma once

#include <cstdint>
#include <string>

#include "carom/audio/result.h"
#include "native/scheduling/bodies.h"
#include "native/spheres/sphere_properties.h"

namespace carom::native {

/// A collision of two spheres in which no other body takes part.
struct PairCollision {
  std::uint32_t sphere = 0;
  std::uint32_t other = 0;
  Vec3 before = Vec3::Zero();       ///< m/s, velocity of `sphere` before the collision
  Vec3 otherBefore = Vec3::Zero();  ///< m/s
  Vec3 after = Vec3::Zero();        ///< m/s, without the effect of friction
  Vec3 otherAfter = Vec3::Zero();   ///< m/s
  double taken = 0.0;               ///< J, that their restitution takes
};

/// The momentum and energy that the spheres should have, summed up from everything that has changed
/// them: free flight changes them by gravity alone, a collision of two spheres keeps momentum and
/// takes the energy that restitution takes, and everything else changes them by its effect on the
/// velocities. checkConservation() compares these sums with the motions.
///
/// Reads the bodies and their masses; changes nothing but its own sums. Internal to native/.
class ConservationLedger {
 public:
  /// Keeps references to both arguments, which must outlive the ledger.
  ConservationLedger(const Bodies& bodies, const SphereProperties& properties)
      : bodies_(bodies), properties_(properties) {}

  /// Begins with the momentum and energy of the present motions, all of time 0.
  void open();
  /// Records a change of velocity at one instant, from `before` to `after` (m/s).
  void recordChange(std::uint32_t sphere, const Vec3& before, const Vec3& after);
  /// Records the work of all forces but gravity during the sphere's motion up to `now`. Must be
  /// called before the motion is replaced.
  void recordForces(std::uint32_t sphere, const Motion& now) { addForces(sphere, now, sums_); }
  /// Records by how much a collision fails to keep momentum, or takes other energy than it should.
  /// The change of the velocities is recorded by recordChange, too.
  void recordCollision(const PairCollision& collision);

  /// Refuses motions at `time` (s) that have not the momentum and energy that was recorded, within
  /// rounding, and collisions that have not conserved them.
  Status checkConservation(double time) const;

 private:
  struct Sums {
    Vec3 momentum = Vec3::Zero();    ///< kg m/s, without the share of gravity
    double energy = 0.0;             ///< J, translation and gravity
    double momentumTurnover = 0.0;   ///< kg m/s, sum of the sizes of all changes
    double energyTurnover = 0.0;     ///< J, sum of the sizes of all changes
    Vec3 unbalanced = Vec3::Zero();  ///< kg m/s, error of momentum in collisions of two spheres
    double unexplained = 0.0;        ///< J, error of energy in collisions of two spheres
  };
  /// Momentum and energy as the motions have them.
  struct Present {
    Vec3 momentum = Vec3::Zero();  ///< kg m/s
    double energy = 0.0;           ///< J
    double momentumSize = 0.0;     ///< kg m/s, sum of sizes, to which rounding is relative
    double energySize = 0.0;       ///< J, the same for the energy
  };

  void addForces(std::uint32_t sphere, const Motion& now, Sums& sums) const;
  Present presentAt(double time) const;
  Sums expectedAt(double time) const;

  const Bodies& bodies_;
  const SphereProperties& properties_;
  Sums sums_;
};

}  // namespace carom::native
