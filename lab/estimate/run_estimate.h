#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "scenes/format/scene.h"

namespace carom::lab {

using namespace scenes;

/// The steps, events, memory and time of a run, in their order of magnitude: the mechanics from the
/// scene and, for collisions, from the first thousands of them; times from what a step of each kind
/// takes on a machine of 2020. Modes and recoils that have to be computed count as if none were in
/// the cache, and modes as if each body had as many as it may have.
struct RunEstimate {
  double steps = 0.0;  ///< of Bullet, of a jello, or of springs, rods, fields and drag; 0: none
  /// Two of each collision; nullopt: not known, as on Bullet, with jello, or where the run does not
  /// begin with collisions.
  std::optional<double> events = std::nullopt;
  double degreesOfFreedom = 0.0;  ///< of the bodies whose modes are computed
  double memory = 0.0;            ///< bytes
  double wall = 0.0;              ///< s, mechanics and sound
  /// The part that takes most of it: "the jello "cube" (/bodies/0), 5e+11 steps of 512 points".
  std::string longest;
};

/// Estimates a run. The same scene gives the same numbers; takes milliseconds. [any thread]
RunEstimate estimateRun(const Scene& scene);

/// Returns a warning of one sentence if the run takes more than a minute, else an empty text.
/// [any thread]
std::string longRunWarning(const RunEstimate& estimate);

}  // namespace carom::lab
