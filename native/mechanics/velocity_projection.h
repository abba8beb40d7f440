#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "native/mechanics/cluster.h"

namespace carom::native {

/// A cluster in units that suit rounding: the unit of mass is that of the first movable body, so
/// that equal bodies have exactly 1. Internal to native/.
struct ClusterSystem {
  ClusterSystem(std::span<const ClusterBody> bodies, std::span<const ClusterContact> contacts);

  double openingSpeed(std::size_t contact) const { return openingSpeed(contact, velocities); }
  /// Opening speed in m/s of the contact if the bodies have the velocities `at`.
  double openingSpeed(std::size_t contact, std::span<const Vec3> at) const;
  /// Opening speed in m/s of the contact that may be rounding of the velocities `at`.
  double rounding(std::size_t contact, std::span<const Vec3> at) const;
  /// Adds to `at` the effect of an impulse (in the units of the masses).
  void push(std::size_t contact, double impulse, std::span<Vec3> at) const;

  double unit = 1.0;  ///< kg
  std::span<const ClusterContact> contacts;
  std::vector<double> inverseMasses;  ///< by body, 1/unit; 0 for immovable bodies
  std::vector<Vec3> velocities;       ///< m/s, by body
  std::vector<double> compliances;    ///< by contact: the inverse of its effective mass
};

/// Returns the impulses (>= 0), at the chosen contacts and in the units of the system's masses,
/// that take its velocities to the nearest ones, in the metric of the masses, at which none of
/// those contacts approaches. They solve a quadratic programme by an active set (Lawson and Hanson
/// 1974, chapter 23). Each step of a proximal point iteration makes it strictly convex: so
/// dependent contacts do no harm, and residuals are taken from the velocities themselves, also
/// where masses differ by much.
std::vector<double> projectionImpulses(const ClusterSystem& system,
                                       std::span<const std::uint32_t> chosen);

}  // namespace carom::native
