#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "audio/radiation/deforming_source.h"
#include "carom/audio/impulse_event.h"
#include "carom/audio/result.h"
#include "carom/native/sphere_stepper.h"
#include "scenes/format/scene.h"

namespace carom::scenes {

/// The mechanics of a scene, on either stepper. [one thread]
class SceneStepper {
 public:
  virtual ~SceneStepper() = default;

  /// Runs to `time` (s) or just beyond, and returns the events that became known on the way, valid
  /// until the next call. They are in order of time within one substep, not always across two.
  virtual std::span<const ImpulseEvent> advanceTo(double time) = 0;

  /// Returns the lasting contacts over the steps of the last advanceTo on Bullet; the native
  /// stepper reports none.
  virtual std::span<const ContactState> contacts() const { return {}; }

  /// Time (s) before which every event has been returned.
  virtual double settledTime() const = 0;

  /// Returns why the mechanics cannot go on, such as a jello that has blown up, in which case
  /// settledTime() does not advance; empty otherwise.
  virtual std::string failure() const { return {}; }

  /// Asks for deformations(), which are empty otherwise; to be called before the first advanceTo.
  /// Returns the time between them in s; 0 if no body deforms.
  virtual double hearDeformations() { return 0.0; }
  /// Returns the jello's states as a source of sound over the last advanceTo, from time 0 on.
  virtual std::span<const audio::DeformingState> deformations() const { return {}; }

  /// Returns the number of jammed spheres, which take no
  /// part in contacts any more; see SphereStepperCounters.
  virtual std::uint64_t jammed() const { return 0; }
};

/// Makes the stepper that scene.stepper asks for, at the scene's start. Refuses scenes that this
/// stepper cannot run.
Result<std::unique_ptr<SceneStepper>> makeStepper(const Scene& scene);

/// Makes the native stepper at the scene's start, whatever scene.stepper asks for.
Result<SphereStepper> nativeStepper(const Scene& scene);

/// Returns the scene's bodies, but for its jello, as the native stepper's world. [any thread]
SphereWorld sphereWorld(const Scene& scene);

/// Returns every event of the scene up to its duration, in order of time.
Result<std::vector<ImpulseEvent>> sceneEvents(const Scene& scene);

}  // namespace carom::scenes
