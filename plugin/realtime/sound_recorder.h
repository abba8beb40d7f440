#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "audio/scheduling/contact_sound_scheduler.h"
#include "audio/synthesis/click_renderer.h"
#include "carom/audio/result.h"
#include "carom/sound_settings.h"
#include "plugin/realtime/recorded_samples.h"

namespace carom::plugin {

/// A recording that grows with the simulation, in a file or in memory: the offline renderer, fed as
/// events come, with the bits of Synth. Nothing is left out for its cost.
///
/// It goes on through leaps of the simulation's clock as if they had not been: what was to sound
/// before is heard, and what comes after follows at once. An error of writing ends the recording;
/// the sound up to there is kept (SoundFileSettings::keepIncomplete), and what is posted later is
/// lost. [simulation thread]
class SoundRecorder {
 public:
  /// Longer leaps of the simulation's clock are left out of the file.
  static constexpr double kLongestStep = 60.0;  ///< s

  /// Records to `samples`, which is for as many channels as `paths` has. The sample rate and the
  /// latency are those of the settings, the rest of which the paths have.
  SoundRecorder(const std::shared_ptr<const audio::SoundPaths>& paths,
                std::unique_ptr<RecordedSamples> samples, const SoundSettings& settings);

  /// The peaks so far, a warning where they exceed a full scale that was set, the error, and the
  /// fates of the events that were to be counted.
  SoundStatistics statistics() const;
  /// The error that has ended the recording.
  const std::optional<Error>& failure() const { return failure_; }

  audio::ContactSoundScheduler& scheduler() { return scheduler_; }
  static bool isLeap(double from, double to) { return to < from || to > from + kLongestStep; }
  /// Begins at that time of the simulation, after `silence` (s).
  void startAt(double seconds, double silence = 0.0);
  /// An event is scheduled with the step in which it was posted; `isCounted` if no other output
  /// counts its fate.
  void post(const ImpulseEvent& event, bool isCounted);
  void updateContact(const ContactState& contact, bool isCounted);
  /// Schedules what was posted so far, before a body changes.
  void schedulePosted();
  /// Takes note that the clock leaps to `seconds`, and schedules what was posted before that. The
  /// listeners have to be placed anew.
  void leapTo(double seconds);
  /// Renders up to the latency before `seconds`.
  void advanceTo(double seconds);
  /// Renders up to the present time, on until all is silent, and finishes the samples. Returns the
  /// first error since the beginning.
  Status finish();

 private:
  template <class Share>
  struct Posted {
    Share share;
    bool isCounted = false;
  };

  template <class Action>
  void counting(bool isCounted, const Action& action);
  void schedule(const Posted<ImpulseEvent>& event);
  void schedule(const Posted<ContactState>& contact);
  void renderTo(double seconds);
  void renderTail();
  bool renderFrames(std::size_t frames);
  double renderedTime() const { return static_cast<double>(renderer_.position()) / rate_; }

  audio::ContactSoundScheduler scheduler_;
  audio::ClickRenderer renderer_;
  std::unique_ptr<RecordedSamples> samples_;
  double rate_;     // Hz
  double latency_;  // s
  bool isAutomatic_;
  bool hasLimiter_;
  double time_ = 0.0;         // s, clock of the simulation
  audio::SampleShift shift_;  // from the clock of the simulation to that of the samples
  std::vector<Posted<ImpulseEvent>> events_;    // of the step in hand
  std::vector<Posted<ContactState>> contacts_;  // lasting ones of the step in hand
  std::uint64_t posted_ = 0;                    // events that are counted
  std::optional<Error> failure_;
  std::vector<std::vector<float>> block_;
  std::vector<float*> channels_;
  std::vector<const float*> written_;
};

}  // namespace carom::plugin
