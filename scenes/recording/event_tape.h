#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "audio/run/run_portion.h"
#include "carom/audio/impulse_event.h"
#include "carom/audio/result.h"
#include "scenes/run/scene_stepper.h"

namespace carom::scenes {

/// Runs `stepper` from its start to `duration` (s), in portions as SceneSound asks for them, and
/// hands each over. `deformationStep` is what SceneStepper::hearDeformations has returned. Errors:
/// the stepper's failure, what `take` returns, and a run that the guard, if any, ends: it begins
/// with no events. [one thread]
Status runInPortions(SceneStepper& stepper, double duration, double deformationStep,
                     RunGuard* guard, const std::function<Status(audio::RunPortion)>& take);

/// The whole output of a stepper for a run, to be heard again without stepping: for comparisons of
/// different sounds of the same events. Unlike a Recording it can be of any stepper, holds no
/// states between events, and stays in memory.
struct EventTape {
  std::vector<audio::RunPortion> portions;
  double deformationStep = 0.0;  ///< s, see SceneStepper::hearDeformations
  bool hasContacts = false;      ///< see SceneStepper::reportsContacts
  std::uint64_t jammed = 0;
  double seconds = 0.0;  ///< s, wall time in the stepper
};

/// Runs `stepper` from its start to `duration` (s), in portions as SceneSound asks for them.
/// Errors: the stepper's failure, and a run that the guard, if any, ends: it begins with no events.
/// [one thread]
Result<EventTape> recordTape(SceneStepper& stepper, double duration, RunGuard* guard = nullptr);

/// Returns every event on the tape, in order of time. [any thread]
std::vector<ImpulseEvent> eventsOf(const EventTape& tape);

/// Returns a stepper that plays the tape back. [one thread]
std::unique_ptr<SceneStepper> tapeStepper(std::shared_ptr<const EventTape> tape);

}  // namespace carom::scenes
