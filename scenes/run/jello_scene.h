#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "audio/radiation/deforming_source.h"
#include "native/jello/jello_choice.h"
#include "native/jello/jello_coupling.h"
#include "native/jello/jello_file.h"
#include "scenes/format/scene.h"
#include "scenes/run/scene_stepper.h"

namespace carom::scenes {

/// The native stepper of a scene with a jello: spheres among planes, and the jello in contact with
/// both. [one thread]
class JelloSceneStepper : public LiveStepper {
 public:
  /// A callback that receives the state at time 0 and after each step.
  using Watch = std::function<void(const native::JelloCoupling&)>;

  /// Chooses integrator and step where the scene leaves them open. Errors: bodies that cannot be
  /// beside a jello (see validateJello), worlds that cannot be run, and a choice that the guard, if
  /// any, has ended.
  static Result<std::unique_ptr<JelloSceneStepper>> create(const Scene& scene, Watch watch = {},
                                                           RunGuard* guard = nullptr);

  /// Runs to `time` as SceneStepper says. An event of a contact with the jello becomes known when
  /// the contact is over.
  std::span<const ImpulseEvent> advanceTo(double time) override;
  double settledTime() const override { return coupling_.settledTime(); }
  std::uint64_t jammed() const override { return coupling_.spheres().counters().jammed; }
  std::string failure() const override { return failure_; }
  std::span<const audio::DeformingState> deformations() const override { return states_; }
  double hearDeformations() override;
  void showAll() override;
  std::span<const BodyPose> poses() const override { return poses_; }
  std::span<const JelloPicture> pictures() const override { return pictures_; }

  double headTime() const override { return coupling_.time(); }
  void putState(Scene& scene) const override;
  void push(BodyId body, const Vec3& velocityChange) override;
  void pull(const std::optional<Pull>& pull) override { pull_ = pull; }

  const native::JelloCoupling& coupling() const { return coupling_; }
  const native::JelloChoice& choice() const { return choice_; }
  double processorTime() const { return processorTime_; }  ///< s, of all threads, in advanceTo

 private:
  JelloSceneStepper(const Scene& scene, native::JelloCoupling coupling,
                    const native::JelloChoice& choice, Watch watch);
  void look();
  void keepState();
  void keepPicture();
  void draw();

  native::JelloCoupling coupling_;
  std::optional<Pull> pull_;
  native::JelloChoice choice_;
  Watch watch_;
  double movedVolume_ = 0.0;  // m^3, of the jello and the air that moves with it; 0: no sound
  std::size_t stride_;        // steps from one kept state to the next
  std::vector<ImpulseEvent> events_;
  std::vector<audio::DeformingState> states_;
  bool isShown_ = false;
  double nextPicture_ = 0.0;  // s
  std::vector<BodyId> spheres_;
  std::vector<BodyPose> poses_;  // this and the next of the last advanceTo, if it is shown
  std::vector<JelloPicture> pictures_;
  std::string failure_;
  double processorTime_ = 0.0;
};

/// Refuses a scene whose jello cannot be run with the other bodies. [any thread]
Status validateJello(const Scene& scene);

/// Returns the scene's jello among its planes, without its spheres. The scene must have a jello.
/// [any thread]
native::JelloWorld jelloWorld(const Scene& scene);

/// Describes a limit of stable steps (s): "up to 2 ms", "at no step" or "at any step". [any thread]
std::string stableText(double limit);

/// Returns a warning of one sentence if the step exceeds the stable limit (s), else an empty
/// string. [any thread]
std::string instabilityWarning(const native::JelloStepping& stepping, double limit);

/// Returns this warning for a scene whose jello has a step of its own. [any thread]
std::string instabilityWarning(const Scene& scene);

/// Makes a scene of `duration` s, with one listener, of a world file. [any thread]
Scene sceneOf(const native::JelloFile& file, double duration, const Vec3& listener);

}  // namespace carom::scenes
