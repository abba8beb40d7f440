#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "carom/audio/result.h"
#include "carom/audio/sound_file.h"
#include "carom/audio/synth.h"
#include "carom/modal/analysis_settings.h"
#include "scenes/format/scene.h"
#include "scenes/rows/events_file.h"
#include "scenes/run/plan.h"
#include "scenes/run/scene_sound.h"

namespace carom::scenes {

/// Makes the stepper that plays a recorded run, from `begin` (s) on or from before.
using Replay = std::function<std::unique_ptr<SceneStepper>(double begin)>;

struct RenderOptions {
  std::filesystem::path soundFile;
  SampleFormat format = SampleFormat::float32;
  bool normalize = false;                 ///< scales the file to 0 dBFS; see SoundFileSettings
  double fullScale = kFullScalePressure;  ///< Pa of 1.0 in the file; not used if normalised
  /// Turns down peaks that exceed full scale; see SoundFileSettings::limit. If not set, PCM16,
  /// which could only clip, is limited unless it is normalised; float32, which keeps them, is not.
  std::optional<bool> limit = {};
  std::optional<std::filesystem::path> eventsFile = {};  ///< not the same as soundFile
  /// If set, plays the scene's recorded run, in place of its mechanics.
  Replay replay = {};
  SoundSpan span = {};  ///< part to render; of a recording only
  /// Called now and then with the share of the scene that is done, 0 to 1.
  std::function<void(double share)> progress = {};
  Progress analysis = {};  ///< progress of modes and recoils that have to be computed first
  /// If set, the sound goes on after the scene's end for at most so many seconds, until its last 50
  /// ms are 60 dB below its peak; what sounds longer fades over the last 50 ms. A jello, which
  /// sounds only while it is stepped, fades at the scene's end. If not set, the sound stops there.
  std::optional<double> tail = {};
  /// If not null, ends the run at its limits. To be made just before, so that its time is that of
  /// the run.
  RunGuard* guard = nullptr;
  /// Keeps what was rendered up to a limit, as NAME.incomplete.EXTENSION; see IncompleteNames.
  bool keepPartial = false;
};

struct RenderReport {
  std::filesystem::path file;
  std::vector<std::filesystem::path> stems = {};  ///< files of all stems, if there are any
  double duration = 0.0;                          ///< s
  double sampleRate = 0.0;                        ///< Hz
  std::size_t channels = 0;
  std::vector<ListenerChannels> listeners;  ///< listeners of these channels
  std::size_t images = 0;                   ///< mirror images of each source; 0 without a room
  std::optional<ReverbSettings> reverb = {};
  std::uint64_t events = 0;               ///< rows of the events file: two per collision
  double peak = 0.0;                      ///< Pa, before any normalisation
  double fullScale = kFullScalePressure;  ///< Pa that a sample of 1.0 in the file stands for
  std::uint64_t clippedSamples = 0;
  double levelAtEnd = 0.0;     ///< dB, of the last 50 ms over the peak; -infinity if silent
  bool limiter = false;        ///< true if the limiter was on
  double gainReduction = 0.0;  ///< dB, the most that the limiter turned down
  double wallTime = 0.0;       ///< s, mechanics, synthesis and writing
  Plan plan;                   ///< with what was left out at run time
  std::optional<EndedEarly> endedEarly = {};  ///< set if a guard ended the run
  std::vector<std::string> notes;             ///< SceneSound::notes
  SynthCounters synth;
  ContactEnergy energy;  ///< of impacts of bodies that ring

  double realtimeFactor() const { return wallTime > 0.0 ? duration / wallTime : 0.0; }
};

/// Returns "clicks", "rings" or "contacts". [any thread]
const char* nameOf(Stem stem);

/// Returns "out.clicks.wav" for "out.wav": the name of the file of a stem. [any thread]
std::filesystem::path stemName(const std::filesystem::path& file, Stem stem);

/// Takes what a rendering makes, in order of time. [one thread]
class RenderSink {
 public:
  virtual ~RenderSink() = default;
  /// Takes the next `frames` samples of each channel, in Pa. An error ends the rendering.
  virtual Status write(std::span<const float* const> channels, std::size_t frames) = 0;
  /// Takes the same samples of a stem, behind those of the whole, if the scene has
  /// SynthSettings::stems.
  virtual Status writeStem(Stem /*stem*/, std::span<const float* const> /*channels*/,
                           std::size_t /*frames*/) {
    return std::monostate{};
  }
  /// Takes an event, once the synthesis has it: after the samples before it, and before its own.
  virtual void add(const ImpulseEvent& event, const EventSound& sound) = 0;
  /// Returns what takes contacts and the poses of all bodies that move; null if nothing does.
  virtual MotionSink* motion() { return nullptr; }
};

/// Renders a scene into a sink, the channels of its first listener first. Of the options, those
/// about files are not used; the report says nothing about files, full scale and limiter. A run
/// that a guard ends is no error. [one thread]
Result<RenderReport> renderScene(const Scene& scene, const RenderOptions& options,
                                 RenderSink& sink);

/// Renders a scene into a sound file, the channels of its first listener first, in pascals over the
/// full scale; stems, if the scene has SynthSettings::stems, into floating-point files beside it,
/// in the same unit. No file appears, and none is replaced, unless all of it succeeds, but for the
/// one that keepPartial keeps. A run that a guard ends is no error. Refuses stems of a normalised
/// file, whose unit is known only at its end. [one thread]
Result<RenderReport> renderScene(const Scene& scene, const RenderOptions& options);

}  // namespace carom::scenes
