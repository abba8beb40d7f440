#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "carom/native/sphere_world.h"
#include "native/scheduling/bodies.h"

namespace carom::native {

/// The properties of the spheres that contacts depend on, their sizes aside: masses, restitutions,
/// friction and stiffness. Nothing of it changes while the stepper runs. Spheres are numbered in
/// order of their ids. Properties that no sphere of the world has take no memory.
///
/// Internal to native/. [any thread]
class SphereProperties {
 public:
  /// `listed` holds, by sphere, its position in `world.spheres`.
  SphereProperties(const SphereWorld& world, std::span<const std::uint32_t> listed);

  double mass(std::size_t sphere) const { return spheres_[sphere].mass; }  ///< kg

  /// Restitution (1) of two spheres that approach at `approachSpeed` m/s.
  double restitution(std::uint32_t sphere, std::uint32_t other, double approachSpeed) const;
  /// Restitution (1) of a sphere that approaches a plane or face at `approachSpeed` m/s.
  double wallRestitution(std::uint32_t sphere, const Plane& plane, double approachSpeed) const;
  /// Restitutions (1, ascending) of all pairs of spheres and walls at the speeds of their laws.
  /// Empty if the bodies are of more than 16 kinds.
  std::vector<double> restitutionsAmong(std::span<const Wall> walls) const;

  bool hasFriction() const { return !frictions_.empty(); }  ///< false if no sphere rubs or spins
  /// Friction of the sphere; only if hasFriction().
  const SphereFriction& friction(std::size_t sphere) const { return frictions_[sphere]; }
  /// Coulomb's coefficient (1) of two spheres: the geometric mean; only if hasFriction().
  double slidingFriction(std::uint32_t sphere, std::uint32_t other) const;
  /// Coulomb's coefficient (1) of a sphere on a plane or face: the geometric mean; only if
  /// hasFriction().
  double slidingFriction(std::uint32_t sphere, const Plane& plane) const;

  /// True if contacts are resolved by Hertz's forces (Simultaneous::hertz).
  bool isHertz() const { return !stiffnesses_.empty(); }
  double stiffness(std::size_t sphere) const { return stiffnesses_[sphere]; }  ///< Pa; if isHertz()

 private:
  struct Properties {
    double mass = 0.0;         ///< kg
    double restitution = 0.0;  ///< 1, at the speed of its RestitutionLaw
  };

  SurfaceId surfaceOf(std::size_t sphere) const {
    return surfaces_.empty() ? SurfaceId{0} : surfaces_[sphere];
  }

  RestitutionTable restitutions_;
  std::vector<Properties> spheres_;        ///< by sphere
  std::vector<SurfaceId> surfaces_;        ///< by sphere; empty if all have surface 0
  std::vector<RestitutionLaw> laws_;       ///< by sphere; empty if all restitutions are constant
  std::vector<SphereFriction> frictions_;  ///< by sphere; empty if no sphere rubs or spins
  std::vector<double> stiffnesses_;        ///< Pa, by sphere; empty except for Simultaneous::hertz
};

}  // namespace carom::native
