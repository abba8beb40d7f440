#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "audio/scheduling/contact_sound_scheduler.h"
#include "audio/synthesis/click_renderer.h"
#include "carom/audio/limiter.h"
#include "carom/audio/result.h"
#include "carom/sound_settings.h"
#include "plugin/realtime/exposure.h"
#include "plugin/realtime/output_gain.h"
#include "plugin/realtime/sound_queue.h"
#include "plugin/realtime/sound_timeline.h"
#include "plugin/realtime/step_sounds.h"

namespace carom::plugin {

/// Makes the limiter that SoundSettings::limiter asks for, if any. Refuses what Limiter refuses.
Result<std::optional<Limiter>> makeLimiter(const SoundSettings& settings, std::size_t channels);

/// Synth cut in two at the place where threads meet:
///
///     post, updateContact, advanceTo   ContactSoundScheduler, on the samples of SoundTimeline
///          | SoundQueue
///     render                           ClickRenderer, gain, limiter
///
/// A sound crosses whole. Where a step has more than the budget's voices, the loudest cross.
///
/// The class has padding, as the two ends of its queue have lines of the cache of their own.
class SoundEngine {  // NOLINT(clang-analyzer-optin.performance.Padding)
 public:
  /// Refuses what makeSoundPaths and Limiter refuse.
  static Result<std::unique_ptr<SoundEngine>> create(const SoundSettings& settings);

  // [simulation thread]
  audio::ContactSoundScheduler& scheduler() { return scheduler_; }
  SoundTimeline& timeline() { return timeline_; }
  /// As ContactSoundScheduler::setBody; what was posted before a body was removed sounds as it was.
  Status setBody(BodyId id, const SoundBody& body);
  void removeBody(BodyId id);
  /// As ContactSoundScheduler::moveBody, whose pose has been validated.
  void moveBody(BodyId id, const ListenerPose& pose);
  void post(const ImpulseEvent& event);
  void updateContact(const ContactState& contact);
  void advanceTo(double seconds);
  /// Returns the statistics since this engine was made, of the events that were posted to it.
  SoundStatistics statistics() const;
  const SoundSettings& settings() const { return settings_; }
  std::size_t channelCount() const { return scheduler_.paths().channels.size(); }
  std::size_t outputDelay() const { return limiter_ ? limiter_->latency() : 0; }
  std::int64_t leapt() const { return timeline_.leapt(); }
  std::int64_t rendered() const { return rendered_.load(std::memory_order_acquire); }

  /// Predicts the peak (Pa) of the first blow, for an automatic level.
  void predict(double pressure);

  OutputGain& gain() { return gain_; }  ///< [any thread]: its targets

  // [audio thread]
  void render(std::span<float* const> channels, std::size_t frames) noexcept;
  void renderInterleaved(float* samples, std::size_t frames) noexcept;

 private:
  /// The counters of the audio thread.
  static constexpr std::array kRendererCounts = {
      &SynthCounters::late,          &SynthCounters::stolen,
      &SynthCounters::overBudget,    &SynthCounters::noBus,
      &SynthCounters::tooLong,       &SynthCounters::modalVoicesExhausted,
      &SynthCounters::slidesLeftOut, &SynthCounters::heard,
      &SynthCounters::lost,          &SynthCounters::ringsLeftOut,
      &SynthCounters::silencedFrames};
  /// Statistics that the audio thread writes and the simulation's thread reads.
  struct Shared {
    /// Counters that kRendererCounts names, in its order.
    std::array<std::atomic<std::uint64_t>, kRendererCounts.size()> counts{};
    std::atomic<std::size_t> voices{0}, buses{0}, banks{0}, modes{0};
    std::atomic<double> cpuShare{0.0}, worstBlock{0.0}, gainReduction{0.0};
    std::atomic<double> peak{0.0}, peakSample{0.0};
  };

  SoundEngine(const SoundSettings& settings, const std::shared_ptr<const audio::SoundPaths>& paths,
              std::optional<Limiter> limiter);
  /// A change of a body that waits for what was posted before it.
  struct BodyChange {
    std::size_t after = 0;  // events of the step in hand
    BodyId id = 0;
    std::optional<SoundBody> body{};
    std::optional<ListenerPose> pose{};  // without a body: it moves; with neither, it is removed
  };

  bool changes(BodyId id) const;
  void changeBodies(std::size_t event);
  void skipStep(double seconds);
  void updateContacts();
  void updateContact(const ContactState& contact, double rank, double least);
  void exposeStep(double from, double to);
  void scheduleStep(double seconds, const SoundTimeline& before);
  void followRings(double seconds);
  double stretchOver(double from, double to) const;
  double rankToSlide(std::span<const ContactState> moment);
  SynthCounters rendererCounters() const;
  void receive(std::size_t frames) noexcept;
  void measure(double seconds, std::size_t frames) noexcept;
  void publish() noexcept;

  SoundSettings settings_;

  // The simulation thread's members.
  audio::ContactSoundScheduler scheduler_;
  SoundTimeline timeline_;
  std::vector<ImpulseEvent> events_;    // of the step in hand
  std::vector<ContactState> contacts_;  // lasting ones of the step in hand
  std::deque<BodyChange> changes_;      // in order
  std::vector<ContactState> later_;     // lasting ones of bodies that have changed in it
  /// The latest states of lasting contacts in steps that were skipped: they are told once.
  std::map<std::pair<BodyId, BodyId>, ContactState> skipped_;
  std::vector<double> slideRanks_;   // by contact of the moment in hand
  std::vector<double> sortedRanks_;  // scratch for rankToSlide
  SoundStatistics counters_;         // counts of this thread

  SoundQueue queue_;
  StepSounds step_;  // of the simulation's thread
  std::atomic<std::int64_t> rendered_{0};
  Shared shared_;
  OutputGain gain_;
  std::optional<Exposure> exposure_;  // where the level is automatic
  double time_ = 0.0;                 // s, of the simulation's thread

  // The audio thread's members.
  audio::ClickRenderer renderer_;
  std::optional<Limiter> limiter_;
  std::vector<float> planar_;  // for renderInterleaved
  std::vector<float*> planarChannels_;
  double measuredTime_ = 0.0;  // s, fading
  double measuredWork_ = 0.0;  // fading
  double cpuShare_ = 0.0;
  double worstBlock_ = 0.0;
  double peak_ = 0.0;        // Pa
  double peakSample_ = 0.0;  // before the limiter
};

}  // namespace carom::plugin
