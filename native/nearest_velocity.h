#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "native/cluster.h"

namespace carom::native {

/// A cluster, in units that suit rounding: masses are those of the first movable body, so that
/// equal bodies have exactly 1. Internal to native/.
struct ClusterSystem {
  ClusterSystem(std::span<const ClusterBody> bodies, std::span<const ClusterContact> contacts);

  double openingSpeed(std::size_t contact) const { return openingSpeed(contact, velocities); }
  /// m/s, at which the contact opens if the bodies have these velocities.
  double openingSpeed(std::size_t contact, std::span<const Vec3> at) const;
  /// m/s, at which rounding may make it open.
  double rounding(std::size_t contact, std::span<const Vec3> at) const;
  /// Adds what an impulse (in the units of the masses) does.
  void push(std::size_t contact, double impulse, std::span<Vec3> at) const;

  double unit = 1.0;  ///< kg
  std::span<const ClusterContact> contacts;
  std::vector<double> inverseMasses;  ///< of the unit, by body; 0 for what is immovable
  std::vector<Vec3> velocities;       ///< m/s, by body
  std::vector<double> compliances;    ///< by contact: the inverse of its effective mass
};

/// The impulses, at the chosen contacts and in the units of the system's masses, that take its
/// velocities to the nearest ones, in the metric of the masses, at which none of those contacts
/// approaches. All >= 0. A quadratic programme, solved by an active set (Lawson and Hanson 1974,
/// chapter 23), which each step of a proximal point iteration makes strictly convex: so dependent
/// contacts do no harm, and residuals are taken from the velocities themselves, where masses differ
/// by much.
std::vector<double> impulsesToNearest(const ClusterSystem& system,
                                      std::span<const std::uint32_t> chosen);

}  // namespace carom::native
