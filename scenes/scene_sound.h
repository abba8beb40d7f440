#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "audio/pose_track.h"
#include "carom/audio/impulse_event.h"
#include "carom/audio/result.h"
#include "carom/audio/synth.h"
#include "carom/modal/analysis_settings.h"
#include "scenes/jello_voice.h"
#include "scenes/scene.h"
#include "scenes/scene_stepper.h"

namespace carom::scenes {

/// The channels of a scene's sound that one listener fills.
struct ListenerChannels {
  std::string name;
  ListenerFormat format = ListenerFormat::mono;
  std::size_t first = 0;  ///< index of the first of them
  std::size_t count = 1;  ///< left and right, where there are two
  bool moves = false;
};

/// In the order of the listeners. [any thread]
std::vector<ListenerChannels> listenerChannels(const Scene& scene);

/// All of them. [any thread]
std::size_t channelsOf(const Scene& scene);

/// How many mirror images each source of the scene has: 0 without a room. [any thread]
std::size_t imageCount(const Scene& scene);

/// s, of sound through the air, after which it is no longer heard; see firstEventTime.
inline constexpr double kLongestWay = 1.0;

/// A listener on its way: it stands at the scene's place before, and at the last pose after it.
/// [any thread]
audio::PoseTrack trackOf(const ListenerPath& path, const Listener& start);

/// A part of a scene's time.
struct SoundSpan {
  double from = 0.0;                                    ///< s
  double to = std::numeric_limits<double>::infinity();  ///< s; at most the scene's duration counts
};

/// s: from when on the events must be known for the sound of `span`. What happened earlier is no
/// longer heard: its way would be longer than 1 s of sound (340 m), and its reverberation is down
/// by 120 dB. [any thread]
double firstEventTime(const Scene& scene, const SoundSpan& span);

/// A scene as sound: its mechanics run just ahead of its synthesis, so memory does not grow with
/// the length of the scene. [one thread]
class SceneSound {
 public:
  /// Loads the heads and models that the scene names, and computes modes that it asks for, which
  /// `progress` is told of. An error names the scene, and the file or what else it is about.
  static Result<SceneSound> create(const Scene& scene, const Progress& progress = {});
  /// The same of mechanics that run already, and of a part of it: the samples that the whole has
  /// there. Events before firstEventTime need not come.
  static Result<SceneSound> create(const Scene& scene, std::unique_ptr<SceneStepper> stepper,
                                   const SoundSpan& span, const Progress& progress = {});

  /// Renders the next samples, at most channels[i].size() of each channel, and returns how many:
  /// 0 at the end of the scene, or of what the mechanics got to (SceneStepper::failure).
  std::size_t render(std::span<std::vector<float>> channels);

  /// Events that were settled by the last `render`, in order of time over the whole scene, up to
  /// its duration; of a part of the scene, those in it.
  std::span<const ImpulseEvent> settledEvents() const { return settled_; }

  const Synth& synth() const { return synth_; }
  const SceneStepper& stepper() const { return *stepper_; }
  std::int64_t frames() const { return frames_ - firstFrame_; }  ///< of the whole scene, or span
  std::int64_t framesDone() const { return framesDone_ - firstFrame_; }

 private:
  SceneSound(const Scene& scene, std::unique_ptr<SceneStepper> stepper, Synth synth,
             const SoundSpan& span);
  void skipTo(std::int64_t frame);
  void runAhead(double time);

  SoundSpan span_;
  double duration_;
  double sampleRate_;
  std::int64_t firstFrame_;  // these three from the scene's start
  std::int64_t frames_;
  std::int64_t framesDone_;
  std::unique_ptr<SceneStepper> stepper_;
  Synth synth_;
  std::optional<JelloVoice> voice_;
  std::vector<ImpulseEvent> known_;    // not settled yet
  std::vector<ImpulseEvent> settled_;  // by the last render
  std::vector<ImpulseEvent> early_;    // settled before the first sample that is wanted
};

}  // namespace carom::scenes
