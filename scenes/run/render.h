#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <vector>

#include "carom/audio/result.h"
#include "carom/audio/sound_file.h"
#include "carom/audio/synth.h"
#include "carom/modal/analysis_settings.h"
#include "carom/native/recording.h"
#include "scenes/format/scene.h"
#include "scenes/run/plan.h"
#include "scenes/run/scene_sound.h"

namespace carom::scenes {

struct RenderOptions {
  std::filesystem::path soundFile;
  SampleFormat format = SampleFormat::float32;
  bool normalize = false;                 ///< scales the file to 0 dBFS; see SoundFileSettings
  double fullScale = kFullScalePressure;  ///< Pa of 1.0 in the file; not used if normalised
  /// Turns down peaks that exceed full scale; see SoundFileSettings::limit. If not set, PCM16,
  /// which could only clip, is limited unless it is normalised; float32, which keeps them, is not.
  std::optional<bool> limit = {};
  std::optional<std::filesystem::path> eventsFile = {};  ///< not the same as soundFile
  /// If not null, the scene's recorded run, which replaces its mechanics.
  const Recording* recording = nullptr;
  SoundSpan span = {};  ///< part to render; of a recording only
  /// Called now and then with the share of the scene that is done, 0 to 1.
  std::function<void(double share)> progress = {};
  Progress analysis = {};  ///< progress of modes that have to be computed first
};

struct RenderReport {
  std::filesystem::path file;
  double duration = 0.0;    ///< s
  double sampleRate = 0.0;  ///< Hz
  std::size_t channels = 0;
  std::vector<ListenerChannels> listeners;  ///< listeners of these channels
  std::size_t images = 0;                   ///< mirror images of each source; 0 without a room
  std::optional<ReverbSettings> reverb = {};
  std::uint64_t events = 0;               ///< rows of the events file: two per collision
  double peak = 0.0;                      ///< Pa, before any normalisation
  double fullScale = kFullScalePressure;  ///< Pa that a sample of 1.0 in the file stands for
  std::uint64_t clippedSamples = 0;
  bool limiter = false;        ///< true if the limiter was on
  double gainReduction = 0.0;  ///< dB, the most that the limiter turned down
  double wallTime = 0.0;       ///< s, mechanics, synthesis and writing
  Plan plan;                   ///< with what was left out at run time
  SynthCounters synth;

  double realtimeFactor() const { return wallTime > 0.0 ? duration / wallTime : 0.0; }
};

/// Renders a scene into a sound file, the channels of its first listener first, in pascals over the
/// full scale. No file appears, and none is replaced, unless all of it succeeds. [one thread]
Result<RenderReport> renderScene(const Scene& scene, const RenderOptions& options);

}  // namespace carom::scenes
