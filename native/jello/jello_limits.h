#pragma once

#include <array>

#include "native/jello/jello_world.h"

namespace carom::native {

/// The largest stable steps and the frequencies that set them.
struct JelloLimits {
  /// Highest frequency (rad/s) at which the springs oscillate, near rest: the root of the largest
  /// eigenvalue of stiffness over mass.
  double highestFrequency = 0.0;
  /// Highest frequency (rad/s) with points pressed into a wall or a ball; the same if there is
  /// none.
  double highestTouching = 0.0;
  /// Largest stable step (s) by integrator, without and with contacts: with a larger step motion
  /// grows without bound, however small it is. 0: no step is stable; infinite: every step is.
  std::array<double, kJelloIntegrators> free{};
  std::array<double, kJelloIntegrators> touching{};
};

/// Returns the limits of a world near rest: springs that are stretched far are stiffer, and may
/// need smaller steps. Exact to 1e-3 up to 24 points along an axis; beyond that the limits are
/// those of an endless lattice, whose frequency is less than 1 % above. If several walls that are
/// not at right angles push, only one of them is taken into account. Needs a world that validate
/// accepts. [any thread]
JelloLimits jelloLimits(const JelloWorld& world);

/// Returns the largest step (s) at which x'' = -w^2 x - c x' does not grow: w in rad/s, > 0, c in
/// 1/s, >= 0. [any thread]
double largestStep(JelloIntegrator integrator, double frequency, double damping);

}  // namespace carom::native
