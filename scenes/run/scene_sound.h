#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "audio/propagation/deforming_voice.h"
#include "audio/propagation/pose_track.h"
#include "carom/audio/impulse_event.h"
#include "carom/audio/result.h"
#include "carom/audio/synth.h"
#include "carom/modal/analysis_settings.h"
#include "scenes/format/scene.h"
#include "scenes/run/scene_stepper.h"

namespace carom::scenes {

/// The channels of a scene's sound that one listener fills.
struct ListenerChannels {
  std::string name;
  ListenerFormat format = ListenerFormat::mono;
  std::size_t first = 0;  ///< index of the first channel
  std::size_t count = 1;  ///< 2: left and right
  bool moves = false;
};

/// Returns the channels of each listener, in the order of the listeners. [any thread]
std::vector<ListenerChannels> listenerChannels(const Scene& scene);

/// Returns the number of channels of all listeners. [any thread]
std::size_t channelsOf(const Scene& scene);

/// Returns the number of mirror images that each source of the scene has: 0 without a room.
/// [any thread]
std::size_t imageCount(const Scene& scene);

/// Returns whether bodies that are no spheres click by the recoil of their shape: where the scene
/// asks for it, and not for a comparison with less exact clicks. [any thread]
bool hearsRecoils(const Scene& scene);

/// How the bodies of a scene sound, in their order.
struct SceneSoundBodies {
  std::vector<SoundBody> bodies;
  std::vector<std::string> notes;  ///< see SceneSound::notes
};

/// Loads the models and textures that the scene names, and computes the modes and recoils that it
/// asks for, with `progress` told of these. An error names the body. [one thread]
Result<SceneSoundBodies> soundBodies(const Scene& scene, const Progress& progress = {});

/// Returns the settings with which a scene is heard, as those of a host: without its heads.
/// [any thread]
audio::HostWorld hostWorldOf(const Scene& scene);

/// Longest travel time of sound through the air that is still heard, s; see firstEventTime.
inline constexpr double kLongestWay = audio::DeformingVoice::kLongestWay;

/// Returns the track of a listener's path: it begins at the scene's place, and stays at the last
/// pose. [any thread]
audio::PoseTrack trackOf(const ListenerPath& path, const Listener& start);

/// A part of a scene's time.
struct SoundSpan {
  double from = 0.0;                                    ///< s
  double to = std::numeric_limits<double>::infinity();  ///< s; cut at the scene's duration
};

/// Returns the time (s) from which on the events must be known for the sound of `span`. Earlier
/// events are no longer heard: their sound would have travelled for more than 1 s (340 m), and
/// their reverberation is down by 120 dB. [any thread]
double firstEventTime(const Scene& scene, const SoundSpan& span);

/// An event that has been handed to the synthesis.
struct ScheduledEvent {
  ImpulseEvent event;
  double peak = 0.0;  ///< Pa, as Synth::schedule returns it
};

/// Takes what the mechanics of a sound tells beside events. [one thread]
class MotionSink {
 public:
  virtual ~MotionSink() = default;
  virtual void add(const ContactState& contact) = 0;
  virtual void add(const BodyPose& pose) = 0;
};

/// The sound of a scene: its mechanics run just ahead of its synthesis, so memory does not grow
/// with the length of the scene. [one thread]
class SceneSound {
 public:
  /// Loads the heads and models that the scene names, and computes the modes and recoils that it
  /// asks for, with `progress` told of these. An error names the scene, and the file or other
  /// cause.
  static Result<SceneSound> create(const Scene& scene, const Progress& progress = {});
  /// Makes the sound of a stepper that exists already, and of a part of the scene: its samples are
  /// those of the whole scene in that span. Events before firstEventTime need not come.
  static Result<SceneSound> create(const Scene& scene, std::unique_ptr<SceneStepper> stepper,
                                   const SoundSpan& span, const Progress& progress = {});

  /// Renders the next samples, at most channels[i].size() of each channel of the synth, and returns
  /// their number: 0 at the end of the scene, or where the mechanics failed
  /// (SceneStepper::failure).
  std::size_t render(std::span<std::vector<float>> channels);

  /// Renders samples after the end, where nothing happens any more: what still sounds of the
  /// bodies, but not the jello.
  void renderTail(std::span<std::vector<float>> channels);

  /// Returns the events that were settled by the last `render`, in order of time over the whole
  /// scene, up to its duration; for a part of the scene, only those in it.
  std::span<const ScheduledEvent> settledEvents() const { return settled_; }

  /// Has `sink` get these events as they are settled; settledEvents is empty then, and there may be
  /// any number without memory for them.
  void sendEventsTo(std::function<void(const ScheduledEvent&)> sink) { sink_ = std::move(sink); }

  /// Has `sink` get the output of the mechanics, as it comes.
  void sendMotionTo(MotionSink* sink) { motion_ = sink; }

  /// Has a guard look on, which outlives this; the sound ends where it ends the run.
  void watch(RunGuard& guard);

  /// Sentences about what is heard otherwise than the scene asks for: one for each shape whose
  /// recoil cannot be solved.
  const std::vector<std::string>& notes() const { return notes_; }

  const Synth& synth() const { return synth_; }
  const SceneStepper& stepper() const { return *stepper_; }
  std::int64_t frames() const { return frames_ - firstFrame_; }  ///< of the scene or span
  std::int64_t framesDone() const { return framesDone_ - firstFrame_; }

 private:
  SceneSound(const Scene& scene, std::unique_ptr<SceneStepper> stepper, Synth synth,
             const SoundSpan& span);
  void skipTo(std::int64_t frame);
  void addVoice(std::span<float* const> channels, std::size_t frames);
  void runAhead(double time);
  void tellMotion();
  void scheduleSettled();
  void endAt(double time);
  void settle(const ScheduledEvent& event);

  SoundSpan span_;
  double duration_;
  double sampleRate_;
  std::int64_t firstFrame_;  // this and the next two count from the scene's start
  std::int64_t frames_;
  std::int64_t framesDone_;
  std::unique_ptr<SceneStepper> stepper_;
  Synth synth_;
  bool hasStems_;
  std::optional<audio::DeformingVoice> voice_;
  std::vector<ImpulseEvent> known_;      // events not settled yet
  std::vector<ScheduledEvent> settled_;  // events settled by the last render
  std::vector<ScheduledEvent> early_;    // events settled before the first wanted sample
  std::function<void(const ScheduledEvent&)> sink_;
  MotionSink* motion_ = nullptr;
  std::vector<std::string> notes_;
  RunGuard* guard_ = nullptr;
};

}  // namespace carom::scenes
