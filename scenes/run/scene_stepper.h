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
#include "scenes/limits/run_guard.h"

namespace carom::scenes {

/// Events after which the native stepper and replays return, so that these are heard and forgotten
/// before more come.
inline constexpr std::size_t kEventsAtATime = 1U << 14U;

/// The mechanics of a scene, on either stepper. [one thread]
class SceneStepper {
 public:
  virtual ~SceneStepper() = default;

  /// Has a guard look on, which outlives the stepper or is taken back by null: where it ends the
  /// run, advanceTo stops on its way.
  void watch(RunGuard* guard) { guard_ = guard; }

  /// Runs to `time` (s) or just beyond, or less far if there are very many events, and returns the
  /// events that became known on the way, valid until the next call. They are in order of time
  /// within one substep, not always across two.
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

 protected:
  /// False if the guard, if any, has ended the run; `time` (s) is how far it is.
  bool mayGoOn(double time) const { return guard_ == nullptr || guard_->mayGoOn(time); }
  /// Tells the guard, if any, of events.
  void count(std::span<const ImpulseEvent> events, double time) const {
    if (guard_ != nullptr) guard_->add(events, time);
  }

 private:
  RunGuard* guard_ = nullptr;
};

/// Makes the stepper that scene.stepper asks for, at the scene's start. Refuses scenes that this
/// stepper cannot run. A guard, which outlives it, looks on from the start, as while a step is
/// chosen for a jello. (If it ends the run then, that is an error.)
Result<std::unique_ptr<SceneStepper>> makeStepper(const Scene& scene, RunGuard* guard = nullptr);

/// Makes the native stepper at the scene's start, whatever scene.stepper asks for.
Result<SphereStepper> nativeStepper(const Scene& scene);

/// Returns the scene's bodies, but for its jello, as the native stepper's world. [any thread]
SphereWorld sphereWorld(const Scene& scene);

/// Returns every event of the scene up to its duration, in order of time.
Result<std::vector<ImpulseEvent>> sceneEvents(const Scene& scene);

}  // namespace carom::scenes
