#pragma once

#include <optional>

#include "carom/audio/result.h"
#include "carom/native/sphere_world.h"
#include "native/jello_stepper.h"

namespace carom::native {

/// What is wanted of a run.
struct JelloWish {
  /// m, > 0: the root of the mean square over the points (some of them, of large lattices), at the
  /// worst of 16 times.
  double error = 1e-4;
  double seconds = 1.0;                                      ///< s, > 0, how long it is
  std::optional<JelloIntegrator> integrator = std::nullopt;  ///< only this one
};

struct JelloChoice {
  JelloStepping stepping;
  double error = 0.0;  ///< m, that is expected; 0: nobody has looked
  double cost = 0.0;   ///< evaluations of all forces for a second of the run
};

/// The cheapest integrator for what is wanted, and its largest step: found by running the jello
/// among the spheres, for `seconds` but at most kPilotSeconds, at three steps of each integrator
/// that could be cheaper than the best so far. Their differences give error and order (Richardson's
/// extrapolation); steps far below the tried ones are tried themselves, down to about 1/1000 of
/// what is stable: where that is not enough, as of motion that grows apart however small the steps
/// are, `error` is above what is wanted. No step is beyond 90 % of what is stable. Takes as long as
/// a few runs. Errors: a world that cannot be run, one that blows up at every step that was tried,
/// an integrator that is stable at no step. [any thread]
Result<JelloChoice> chooseStepping(const JelloWorld& jello, const SphereWorld& spheres,
                                   const JelloWish& wish);

inline constexpr double kPilotSeconds = 2.0;

}  // namespace carom::native
