#pragma once

#include <array>

#include "native/jello_world.h"

namespace carom::native {

/// How large a step may be.
struct JelloLimits {
  /// rad/s, the highest that the springs swing at, near rest: the root of the largest eigenvalue of
  /// stiffness over mass.
  double highestFrequency = 0.0;
  /// rad/s, with points pressed into a wall or a ball; the same where there is none.
  double highestTouching = 0.0;
  /// s, by integrator, with and without touching: a larger step grows without bound, however small
  /// the motion. 0: any step does; infinite: none does.
  std::array<double, kJelloIntegrators> free{};
  std::array<double, kJelloIntegrators> touching{};
};

/// Of the world as it is near rest: what is stretched far is stiffer, and may need smaller steps.
/// Exact to 1e-3 up to 24 points along an axis; beyond, of a lattice without end, which is less
/// than 1 % above. Of walls that push in other directions than across each other, of one of them.
/// Needs a world that whyNot has nothing against. [any thread]
JelloLimits jelloLimits(const JelloWorld& world);

/// s, the largest step at which x'' = -w^2 x - c x' does not grow: w in rad/s, > 0, c in 1/s, >= 0.
/// [any thread]
double largestStep(JelloIntegrator integrator, double frequency, double damping);

}  // namespace carom::native
