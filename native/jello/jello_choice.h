#pragma once

#include <functional>
#include <optional>

#include "carom/audio/result.h"
#include "carom/native/sphere_world.h"
#include "native/jello/jello_stepper.h"

namespace carom::native {

/// The wished accuracy of a run.
struct JelloWish {
  /// Error of places in m, > 0, up to where the jello first meets something: the root mean square
  /// over the points.
  double error = 1e-4;
  double seconds = 1.0;                                      ///< s, > 0, duration of the run
  std::optional<JelloIntegrator> integrator = std::nullopt;  ///< if set, its steps are whole
  std::function<bool()> goesOn = {};  ///< asked at each step; false ends the choice with an error
};

struct JelloChoice {
  JelloStepping stepping;
  /// Error in m that is expected at the first contact, or at the end of the run; above the wished
  /// one where that cannot be had. 0 if it has not been estimated.
  double error = 0.0;
  double cost = 0.0;      ///< evaluations of all forces for a second of the run, before a contact
  std::size_t spent = 0;  ///< evaluations that the choice of steps to be followed has taken
};

/// Chooses integrator and step.
///
/// With no integrator wished, leapfrog and Runge-Kutta 4 are tried for some steps each, and the one
/// that needs fewer evaluations is chosen, with steps of 90 % of leapfrog's stable one that are
/// divided where the error asks for it (JelloStepper::follow). What is promised after the first
/// contact is energy and spectrum, not the way: contacts multiply what differs. Steps are whole
/// from there on.
///
/// Where dividing costs more than 2.5 times as much as whole steps, it is tried whether these do:
/// what swings undamped gets out of phase, and its error, which then no longer grows, is added up
/// by steps that are followed all the same. Two runs at whole steps, of 90 and of 60 % of the
/// stable one, are compared over two fifths of the run, or of kPilotSeconds; if their distance
/// stays within the wish, by how it grew at its end too, the run takes the smaller step.
///
/// With an integrator, its largest step is chosen that meets the wish up to the first contact, at
/// most 90 % of the stable one: it is run up to there, but at most kPilotSeconds, at three steps,
/// whose differences give error and order (Richardson's extrapolation). Takes as long as a few such
/// runs.
///
/// Errors: a world that cannot be run, one that blows up at every step that was tried, an
/// integrator that is stable at no step. [any thread]
Result<JelloChoice> chooseStepping(const JelloWorld& jello, const SphereWorld& spheres,
                                   const JelloWish& wish);

inline constexpr double kPilotSeconds = 2.0;

}  // namespace carom::native
