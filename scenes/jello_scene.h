#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "audio/deforming_source.h"
#include "native/jello_choice.h"
#include "native/jello_coupling.h"
#include "native/jello_file.h"
#include "scenes/scene.h"
#include "scenes/scene_stepper.h"

namespace carom::scenes {

/// A scene with a jello, on the native steppers: its spheres among its planes, and the jello with
/// both. [one thread]
class JelloSceneStepper : public SceneStepper {
 public:
  /// Told of the state at time 0, and after each step.
  using Watch = std::function<void(const native::JelloCoupling&)>;

  /// Chooses integrator and step, where the scene leaves that open. Refuses what a jello cannot be
  /// beside, and what cannot be run.
  static Result<std::unique_ptr<JelloSceneStepper>> create(const Scene& scene, Watch watch = {});

  /// Of the jello's touches, what is known when they are over.
  std::span<const ImpulseEvent> advanceTo(double time) override;
  double settledTime() const override { return coupling_.settledTime(); }
  std::uint64_t crushed() const override { return coupling_.spheres().counters().crushed; }
  std::string failure() const override { return failure_; }
  std::span<const audio::DeformingState> deformations() const override { return states_; }
  double hearDeformations() override;

  const native::JelloCoupling& coupling() const { return coupling_; }
  const native::JelloChoice& choice() const { return choice_; }
  double processorTime() const { return processorTime_; }  ///< s, of all threads, in advanceTo

 private:
  JelloSceneStepper(const Scene& scene, native::JelloCoupling coupling,
                    const native::JelloChoice& choice, Watch watch);
  void look();
  void keepState();

  native::JelloCoupling coupling_;
  native::JelloChoice choice_;
  Watch watch_;
  double movedVolume_ = 0.0;  // m^3, of the jello and the air with it; 0: nobody listens
  std::size_t stride_;        // steps to a state
  std::vector<ImpulseEvent> events_;
  std::vector<audio::DeformingState> states_;
  std::string failure_;
  double processorTime_ = 0.0;
};

/// Why the scene's jello cannot be run with what else is in the scene: one sentence; or nothing
/// when it can be, or there is none. [any thread]
std::string whyNoJello(const Scene& scene);

/// The scene's jello among its planes, without its spheres. Needs a jello. [any thread]
native::JelloWorld jelloWorld(const Scene& scene);

/// "up to 2 ms", "at no step" or "at any step", of a limit in s. [any thread]
std::string stableText(double limit);

/// One sentence if a step of this is beyond what is stable; or nothing. [any thread]
std::string whyUnstable(const native::JelloStepping& stepping, double limit);

/// The same of a scene whose jello has a step of its own. [any thread]
std::string whyUnstable(const Scene& scene);

/// The world of a file as a scene of `duration` s, with one listener. [any thread]
Scene sceneOf(const native::JelloFile& file, double duration, const Vec3& listener);

}  // namespace carom::scenes
