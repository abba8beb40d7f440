#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "carom/audio/result.h"
#include "carom/audio/sound_file.h"
#include "carom/audio/synth.h"
#include "carom/sound_settings.h"

namespace carom::plugin {

/// A file that grows with the simulation: the offline renderer, fed as events come. Nothing is left
/// out for its cost. With an automatic level it gets its full scale at the end. [simulation thread]
class SoundRecorder {
 public:
  /// Longer leaps of the simulation's clock are left out of the file.
  static constexpr double kLongestStep = 60.0;  ///< s

  static constexpr double kAutomaticPeak = 0.707945784384138;  ///< -3 dB

  /// Refuses what Synth and SoundFileWriter refuse, and names that are not of a WAV file.
  static Result<SoundRecorder> create(const std::filesystem::path& file,
                                      const SoundSettings& settings);

  /// Sets the peaks so far, and a warning where they exceed a full scale that was set.
  void addLevels(SoundStatistics& statistics) const;

  Synth& synth() { return synth_; }
  const Synth& synth() const { return synth_; }
  static bool isLeap(double from, double to) { return to < from || to > from + kLongestStep; }
  /// Begins the file at that time of the simulation, or goes on there after a leap. The listeners
  /// have to be placed anew.
  void startAt(double seconds);
  /// Renders up to the latency before `seconds`.
  void advanceTo(double seconds);
  /// Renders up to `seconds`, on until all is silent, and completes the file. Returns the first
  /// error since the beginning.
  Status finish(double seconds);

 private:
  SoundRecorder(Synth synth, SoundFileWriter file, const SoundSettings& settings);
  void renderTo(double seconds);
  void renderTail();
  bool renderFrames(std::size_t frames);

  Synth synth_;
  SoundFileWriter file_;
  double latency_;
  bool isAutomatic_;
  bool hasLimiter_;
  std::optional<Error> failure_;
  std::vector<std::vector<float>> block_;
  std::vector<float*> channels_;
  std::vector<const float*> written_;
};

}  // namespace carom::plugin
