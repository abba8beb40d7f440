#pragma once

#include <functional>
#include <optional>

#include "carom/audio/result.h"
#include "carom/native/sphere_world.h"
#include "native/jello/jello_stepper.h"

namespace carom::native {

/// The wished accuracy of a run.
struct JelloWish {
  /// Error of places in m, > 0: the root mean square over the points (some of them, for large
  /// lattices), at the worst of 16 times.
  double error = 1e-4;
  double seconds = 1.0;                                      ///< s, > 0, duration of the run
  std::optional<JelloIntegrator> integrator = std::nullopt;  ///< if set, the only one tried
  std::function<bool()> goesOn = {};  ///< asked at each step; false ends the choice with an error
};

struct JelloChoice {
  JelloStepping stepping;
  double error = 0.0;  ///< m, expected; 0 if it has not been estimated
  double cost = 0.0;   ///< evaluations of all forces for a second of the run
};

/// Chooses the cheapest integrator that meets the wish, and its largest step, by running the jello
/// among the spheres, for `seconds` but at most kPilotSeconds, at three steps of each integrator
/// that could be cheaper than the best so far. The differences give error and order (Richardson's
/// extrapolation). Steps far below the tried ones are tried themselves, down to about 1/1000 of the
/// stable step: where that is not enough, as in motion that diverges however small the steps are,
/// the chosen `error` is above the wished one. No step is beyond 90 % of the stable one. Takes as
/// long as a few runs. Errors: a world that cannot be run, one that blows up at every step that was
/// tried, an integrator that is stable at no step. [any thread]
Result<JelloChoice> chooseStepping(const JelloWorld& jello, const SphereWorld& spheres,
                                   const JelloWish& wish);

inline constexpr double kPilotSeconds = 2.0;

}  // namespace carom::native
