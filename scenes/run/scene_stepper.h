#pragma once

#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "audio/radiation/deforming_source.h"
#include "audio/run/host_run.h"
#include "audio/run/run_portion.h"
#include "carom/audio/impulse_event.h"
#include "carom/audio/listener.h"
#include "carom/audio/result.h"
#include "carom/native/sphere_stepper.h"
#include "scenes/format/scene.h"
#include "scenes/limits/run_guard.h"

namespace carom::scenes {

/// Events after which the native stepper and replays return, so that these are heard and forgotten
/// before more come.
inline constexpr std::size_t kEventsAtATime = 1U << 14U;

/// s: time between the poses that are read from steppers which know all times, and the least time
/// between those of others.
inline constexpr double kPoseStep = 1.0 / 240.0;
inline constexpr double kLeastPoseStep = 1e-3;
/// s: time between pictures of a jello.
inline constexpr double kPictureStep = 1.0 / 60.0;

using audio::BodyPose;
using audio::JelloPicture;

/// Returns the bodies of a scene that ring and can move. [any thread]
std::vector<BodyId> movingRings(const Scene& scene);
/// Returns the bodies of a scene that can move, but for its jello. [any thread]
std::vector<BodyId> movingBodies(const Scene& scene);

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
  /// True if there may be some.
  virtual bool reportsContacts() const { return false; }

  /// Returns the poses of the scene's movingRings over the last advanceTo, in order of time, from
  /// the start on; none beside a jello, unless showAll was called.
  virtual std::span<const BodyPose> poses() const { return {}; }

  /// Asks for the poses of all movingBodies, and for pictures; to be called before the first
  /// advanceTo. Nothing else changes.
  virtual void showAll() {}
  /// Returns pictures of the jello over the last advanceTo, one in kPictureStep, from the start on;
  /// none unless showAll was called.
  virtual std::span<const JelloPicture> pictures() const { return {}; }

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

  /// True if the sound is to take events in the order in which they are told, as a host's sound has
  /// taken them, and not in order of time: what it leaves out as masked depends on it.
  virtual bool keepsOrder() const { return false; }

  /// Returns bodies that sound otherwise from the last advanceTo on, of a host's run.
  virtual std::span<const audio::HostBody* const> bodyChanges() const { return {}; }

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

/// Where a body is, and how it moves there.
struct BodyMotion {
  Vec3 position = Vec3::Zero();  ///< m, world frame
  Vec3 velocity = Vec3::Zero();  ///< m/s, world frame
};

/// A hand that draws a body towards a place: as a spring that is damped critically, on its centre.
struct Pull {
  BodyId body = 0;
  std::size_t point = 0;      ///< of a jello, as its lattice counts them
  Vec3 place = Vec3::Zero();  ///< m, world frame
  double rate = 15.0;         ///< 1/s, > 0: the root of stiffness over mass
};

/// The mechanics of a scene that may be meddled with, and whose state can be taken over by another
/// one. [one thread]
class LiveStepper : public SceneStepper {
 public:
  /// Time (s) of the state: settledTime() or a little later.
  virtual double headTime() const = 0;
  /// Puts places and motions at headTime() into a scene of the same bodies.
  virtual void putState(Scene& scene) const = 0;
  /// Changes the velocity (m/s) of a body that moves; of a jello, of all its points.
  virtual void push(BodyId body, const Vec3& velocityChange) = 0;
  /// Draws a body from now on; empty: none.
  virtual void pull(const std::optional<Pull>& pull) = 0;
};

/// Makes the stepper that scene.stepper asks for, at the scene's start. Refuses scenes that this
/// stepper cannot run. A guard, which outlives it, looks on from the start, as while a step is
/// chosen for a jello. (If it ends the run then, that is an error.)
Result<std::unique_ptr<SceneStepper>> makeStepper(const Scene& scene, RunGuard* guard = nullptr);
/// The same stepper, to be meddled with.
Result<std::unique_ptr<LiveStepper>> makeLiveStepper(const Scene& scene, RunGuard* guard = nullptr);

/// Returns the change of velocity (m/s) that a pull gives in `step` (s) to a body at a place (m),
/// with a velocity (m/s), whose weight it carries. [any thread]
Vec3 pullOf(const Pull& pull, const BodyMotion& motion, const Vec3& gravity, double step);

/// Moves the planes and blocks of a scene, which nothing can push, by `time` (s). [any thread]
void moveSurfaces(Scene& scene, double time);

/// The instants at which a stepper that knows all times is asked for poses, from the last one at or
/// before `begin` (s) on.
class PoseInstants {
 public:
  explicit PoseInstants(double begin = 0.0)
      : next_(static_cast<std::int64_t>(std::floor(begin / kPoseStep))) {}

  double next() const { return static_cast<double>(next_) * kPoseStep; }  ///< s
  void pass() { ++next_; }
  /// Returns the first instant (s) that is not before `time`.
  static double from(double time) { return std::ceil(time / kPoseStep) * kPoseStep; }

 private:
  std::int64_t next_;
};

/// Makes the native stepper at the scene's start, whatever scene.stepper asks for.
Result<SphereStepper> nativeStepper(const Scene& scene);

/// Returns the scene's bodies, but for its jello, as the native stepper's world. [any thread]
SphereWorld sphereWorld(const Scene& scene);

/// Returns every event of the scene up to its duration, in order of time.
Result<std::vector<ImpulseEvent>> sceneEvents(const Scene& scene);

}  // namespace carom::scenes
