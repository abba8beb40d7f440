#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "native/jello/jello_stepper.h"
#include "scenes/format/scene.h"

namespace carom::lab {

using namespace scenes;

/// The time at which a collision on Bullet is taken to have happened.
enum class EventTime {
  exact,      ///< the time that the bridge finds
  backDated,  ///< extrapolated in a straight line from Bullet's distance (PolledContact)
  step        ///< the end of the step in which it is seen
};

/// The kind of choice that a variant of a scene's run tests; variants are listed by it.
enum class VariantGroup { mechanics, sound, modes, jello, presets };

/// One way to run a scene and hear it. Each approximate choice has its exact counterpart beside it.
struct ReportChoice {
  std::string id;     ///< unique in a report, of a-z, 0-9 and _
  std::string label;  ///< readable name
  VariantGroup group = VariantGroup::mechanics;

  StepperSettings stepper;
  EventTime eventTime = EventTime::exact;
  ImpulseChoice impulse = ImpulseChoice::physical;
  PulseShape pulse = PulseShape::hertz;
  bool dissipative = true;  ///< replaces `pulse`
  Sampling sampling = Sampling::bandLimited;
  Radiation radiation = Radiation::exact;
  bool doppler = true;
  bool air = true;  ///< the air absorbs
  RingingContact ringing = RingingContact::coupled;
  std::optional<std::size_t> mostModes;        ///< most modes of each body; empty: all
  std::optional<native::JelloStepping> jello;  ///< with a jello only
};

struct ReportGrid {
  ReportChoice reference;  ///< the most exact choice that is affordable
  std::string why;         ///< one sentence: why this is the reference
  std::vector<ReportChoice> variants;
};

/// Returns the choices that make a difference to this scene, one at a time, and together as
/// presets: a game's, a film's and the hand-out's. Steps of Bullet go from the longest to the
/// shortest. Errors: a jello for which no integrator is stable.
///
/// `fineness` is for a jello: the reference's step is the largest stable one divided by it.
/// [any thread]
Result<ReportGrid> reportGrid(const Scene& scene, double fineness = 8.0);

/// Returns the scene with the choice applied, but for its event times, which are not in a scene.
/// [any thread]
Scene sceneOf(const Scene& scene, const ReportChoice& choice);

/// Returns the settings of a choice by stable names ("stepper", "step", "event_time" ...), only
/// those that matter for it. Steps in s. [any thread]
std::vector<std::pair<std::string, std::variant<std::string, double, bool>>> namesOf(
    const ReportChoice& choice);

const char* nameOf(VariantGroup group);  ///< [any thread]

}  // namespace carom::lab
