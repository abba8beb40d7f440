#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "native/jello_stepper.h"
#include "scenes/scene.h"

namespace carom::scenes {

/// When a collision on Bullet is taken to have happened.
enum class EventTime {
  exact,      ///< as the bridge says
  backDated,  ///< from the distance that Bullet found, in a straight line (PolledContact)
  step        ///< at the end of the step in which it is seen
};

/// What a variant of a scene's run is about, and is listed with.
enum class VariantGroup { mechanics, sound, modes, jello, presets };

/// One way to run a scene and hear it: each choice stands beside the exact one.
struct ReportChoice {
  std::string id;     ///< unique in a report, of a-z, 0-9 and _
  std::string label;  ///< for people
  VariantGroup group = VariantGroup::mechanics;

  StepperSettings stepper;
  EventTime eventTime = EventTime::exact;
  ImpulseChoice impulse = ImpulseChoice::physical;
  PulseShape pulse = PulseShape::hertz;
  bool dissipative = true;  ///< instead of `pulse`
  Sampling sampling = Sampling::bandLimited;
  Radiation radiation = Radiation::exact;
  bool doppler = true;
  std::optional<std::size_t> mostModes;        ///< of each body; empty: all
  std::optional<native::JelloStepping> jello;  ///< with a jello only
};

struct ReportGrid {
  ReportChoice reference;  ///< the most exact that is affordable
  std::string why;         ///< one sentence: why that
  std::vector<ReportChoice> variants;
};

/// The choices that make a difference to this scene, one at a time, and together as a game, a film
/// and the hand-out would have them. Steps of Bullet from the longest to the shortest. Errors: a
/// jello for which no integrator is stable.
///
/// `fineness` is of a jello's reference: by what its largest stable step is divided. [any thread]
Result<ReportGrid> reportGrid(const Scene& scene, double fineness = 8.0);

/// The scene with that choice; what the choice says of event times is not in a scene. [any thread]
Scene sceneOf(const Scene& scene, const ReportChoice& choice);

/// What a choice is, by stable names ("stepper", "step", "event_time" ...): only what matters for
/// it. Steps in s. [any thread]
std::vector<std::pair<std::string, std::variant<std::string, double, bool>>> namesOf(
    const ReportChoice& choice);

const char* nameOf(VariantGroup group);  ///< [any thread]

}  // namespace carom::scenes
