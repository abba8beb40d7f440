#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "audio/run/playable_run.h"
#include "audio/run/run_player.h"
#include "carom/audio/result.h"
#include "carom/audio/synth.h"
#include "scenes/format/scene.h"
#include "scenes/run/scene_stepper.h"

namespace carom::scenes {

/// A scene that runs while it is watched, and that may be changed on the way: bodies are drawn,
/// pushed and added, settings become others, and the past can be taken back to any moment. The past
/// is a run that grows, which RunPlayer plays and a file can keep.
///
///     advanceTo   the mechanics goes on, in frames
///     push, pull  act at the head, time()
///     change      a new mechanics takes over at the head: the scene as it is there, but changed
///     rewind      a mechanics takes over at the end of an earlier frame
///
/// A mechanics that takes over has no memory of contacts: Bullet solves those that last anew, and
/// events of the last step before it, which the bridge has not told yet, are lost. On the native
/// stepper nothing is lost but the last digit. [one thread]
class LiveRun {
 public:
  static constexpr double kFrame = 1.0 / 60.0;    ///< s, about
  static constexpr double kLongest = 600.0;       ///< s: nothing goes on for longer
  static constexpr std::size_t kMostAdded = 500;  ///< bodies

  /// The part of a portion that is drawn.
  struct Shown {
    std::vector<BodyPose> poses;  ///< of all bodies that move
    std::vector<JelloPicture> pictures;
    std::vector<audio::RunPlayer::EventMeasure> measures;  ///< of its events
  };

  /// Begins a scene on its stepper. `sounds` are bodies whose sound is known, by their ids; others
  /// sound as they do without modes, as a solution of these would keep the watcher waiting. Errors:
  /// a scene that the stepper refuses.
  static Result<LiveRun> create(Scene scene, std::span<const audio::HostBody> sounds = {});

  /// The scene as it was when its mechanics took over, with all settings.
  const Scene& scene() const { return segments_.back().scene; }
  /// The scene as it is at the head.
  Scene now() const;
  /// All that has happened. Portions are frames; they have poses of bodies that ring only.
  const audio::PlayableRun& run() const { return run_; }
  double time() const;     ///< s, the head: how far the mechanics is
  double settled() const;  ///< s: all events before it are in the run

  /// Goes on to `time` (s) or up to a frame beyond. Errors: a mechanics that cannot go on, and
  /// kLongest.
  Status advanceTo(double time);
  /// Returns what is drawn of the portions from the last call on, or from where was rewound to.
  std::vector<Shown> takeShown() { return std::exchange(shown_, {}); }

  /// Changes the velocity (m/s) of a body that moves.
  void push(BodyId body, const Vec3& velocityChange) { stepper_->push(body, velocityChange); }
  /// Draws a body until it is let go, see Pull.
  void pull(const std::optional<Pull>& pull) { stepper_->pull(pull); }
  /// Has the scene be another one from the head on, with the same bodies. Refuses what the stepper
  /// refuses; then nothing has changed.
  Status change(const std::function<void(Scene&)>& edit);
  /// Adds a body at the head. Refuses: too many, one that the stepper refuses, such as one that
  /// overlaps another on the native stepper.
  Result<BodyId> add(SceneBody body);

  /// Takes back all that has happened since the last frame that ended at `time` (s) or before.
  /// Portions of the run end there, and so do bodies that came later.
  Status rewind(double time);

 private:
  /// A mechanics, from some moment on.
  struct Segment {
    double begin = 0.0;  // s
    Scene scene;         // at that time
  };
  /// The state of a body that moves, or of a jello.
  struct MovingState {
    BodyId body = 0;
    Vec3 position = Vec3::Zero();
    Quat orientation = Quat::Identity();
    Vec3 velocity = Vec3::Zero();
    Vec3 spin = Vec3::Zero();
    std::shared_ptr<const JelloShape> jello = nullptr;
  };
  /// The end of a frame.
  struct Frame {
    double time = 0.0;         // s
    std::size_t portions = 0;  // up to here
    std::size_t segment = 0;
    std::vector<MovingState> bodies;
  };

  LiveRun() = default;
  /// `before` segments stay.
  Status takeOver(Segment segment, std::size_t before);
  Status addBodies(std::size_t first, std::span<const audio::HostBody> sounds);
  void keepPortion(std::span<const ImpulseEvent> events);
  void keepFrame();
  static std::vector<MovingState> statesOf(const Scene& scene);
  static void putStates(std::span<const MovingState> states, Scene& scene);

  audio::PlayableRun run_;
  std::vector<Segment> segments_;
  std::vector<Frame> frames_;
  std::vector<Shown> shown_;
  std::vector<bool> rings_;     // by body
  std::optional<Synth> meter_;  // tells how loud events are
  std::unique_ptr<LiveStepper> stepper_;
  bool isFirst_ = true;  // the stepper has told nothing yet
};

}  // namespace carom::scenes
