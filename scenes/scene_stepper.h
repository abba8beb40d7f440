#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "audio/deforming_source.h"
#include "carom/audio/impulse_event.h"
#include "carom/audio/result.h"
#include "carom/native/sphere_stepper.h"
#include "scenes/scene.h"

namespace carom::scenes {

/// The mechanics of a scene, on either stepper. [one thread]
class SceneStepper {
 public:
  virtual ~SceneStepper() = default;

  /// Runs to `time` (s) or just beyond, and returns the events that became known on the way, valid
  /// until the next call. They are in order of time within one substep, not always across two.
  virtual std::span<const ImpulseEvent> advanceTo(double time) = 0;

  /// Lasting contacts over the steps of the last advanceTo: of Bullet; the native stepper tells of
  /// none.
  virtual std::span<const ContactState> contacts() const { return {}; }

  /// s: every event before this time has been returned.
  virtual double settledTime() const = 0;

  /// Why it cannot go on, as a jello that has blown up: settledTime() stays. Empty otherwise.
  virtual std::string failure() const { return {}; }

  /// Someone listens to what deforms: before the first advanceTo, or there are no deformations().
  /// Returns the time between them, s; 0 where nothing deforms.
  virtual double hearDeformations() { return 0.0; }
  /// What the jello did to the air in the last advanceTo, from time 0 on.
  virtual std::span<const audio::DeformingState> deformations() const { return {}; }

  /// Spheres that nothing touches any more, as SphereStepperCounters says.
  virtual std::uint64_t crushed() const { return 0; }
};

/// The stepper that scene.stepper asks for, at the scene's start. Refuses what that stepper cannot
/// do.
Result<std::unique_ptr<SceneStepper>> makeStepper(const Scene& scene);

/// The native stepper at the scene's start, whatever scene.stepper asks for.
Result<SphereStepper> nativeStepper(const Scene& scene);

/// What the native stepper makes of the scene's bodies but for its jello. [any thread]
SphereWorld sphereWorld(const Scene& scene);

/// Every event of the scene up to its duration, in order of time.
Result<std::vector<ImpulseEvent>> sceneEvents(const Scene& scene);

}  // namespace carom::scenes
