#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "audio/synthesis/click_renderer.h"
#include "audio/synthesis/contact_sound_scheduler.h"
#include "carom/audio/limiter.h"
#include "carom/audio/result.h"
#include "carom/sound_settings.h"
#include "plugin/realtime/output_gain.h"
#include "plugin/realtime/sound_timeline.h"
#include "plugin/realtime/spsc_queue.h"

namespace carom::plugin {

/// Makes the limiter that SoundSettings::limiter asks for, if any. Refuses what Limiter refuses.
Result<std::optional<Limiter>> makeLimiter(const SoundSettings& settings, std::size_t channels);

/// Synth cut in two at the place where threads meet:
///
///     post, advanceTo     ContactSoundScheduler lays the events of a step, SoundTimeline says on
///     which samples
///          | SpscQueue
///     render              ClickRenderer, gain, limiter
///
/// An event crosses whole. Where a step has more than the budget's voices, the loudest cross.
///
/// The class has padding, as the two ends of its queues have lines of the cache of their own.
class SoundEngine {  // NOLINT(clang-analyzer-optin.performance.Padding)
 public:
  /// Refuses what makeSoundPaths and Limiter refuse.
  static Result<std::unique_ptr<SoundEngine>> create(const SoundSettings& settings);

  // [simulation thread]
  audio::ContactSoundScheduler& layer() { return layer_; }
  SoundTimeline& timeline() { return timeline_; }
  void post(const ImpulseEvent& event);
  void updateContact(const ContactState& contact);
  void advanceTo(double seconds);
  SoundStatistics statistics() const;  ///< since this engine was made
  const SoundSettings& settings() const { return settings_; }
  std::size_t channelCount() const { return layer_.paths().channels.size(); }
  std::size_t outputDelay() const { return limiter_ ? limiter_->latency() : 0; }
  std::int64_t rendered() const { return rendered_.load(std::memory_order_acquire); }

  OutputGain& gain() { return gain_; }  ///< [any thread]: its targets

  // [audio thread]
  void render(std::span<float* const> channels, std::size_t frames) noexcept;
  void renderInterleaved(float* samples, std::size_t frames) noexcept;

 private:
  struct QueuedClick {
    audio::Click click;
    audio::SphereWeights ears;
    double peak = 0.0;
    std::uint32_t ofEvent = 0;  // number of its event's clicks from this one on
    std::uint32_t nodes = 0;    // number of nodes in its event's train, in trains_
  };
  /// An event of the step in hand.
  struct Laid {
    double peak = 0.0;
    std::size_t first = 0;      // its first click in laidClicks_
    std::size_t count = 0;      // number of its clicks
    std::size_t firstNode = 0;  // in laidNodes_
    std::size_t nodes = 0;      // 0: it is no step of a slide
  };
  /// A ring, and its taps in another queue: kTaps of its b0 and b1 at a time.
  static constexpr std::size_t kTaps = 16;
  using QueuedTaps = std::array<double, kTaps>;
  struct QueuedRing {
    audio::ModalExcitation ring;
    std::uint32_t ofEvent = 0;  // number of its event's rings from this one on
    std::uint32_t nodes = 0;    // number of nodes in its event's train, in ringTrains_
  };
  /// Statistics that the audio thread writes and the simulation's thread reads.
  struct Shared {
    std::atomic<std::uint64_t> late{0}, stolen{0}, overBudget{0}, noBus{0}, tooLong{0},
        modalVoicesExhausted{0}, noTrain{0};
    std::atomic<std::size_t> voices{0}, buses{0}, banks{0}, modes{0};
    std::atomic<double> cpuShare{0.0}, worstBlock{0.0}, gainReduction{0.0};
  };

  SoundEngine(const SoundSettings& settings, const std::shared_ptr<const audio::SoundPaths>& paths,
              std::optional<Limiter> limiter);
  void lay(const ImpulseEvent& event);
  void layTouch(const ContactState& contact, double rank, double least);
  double rankToSlide(std::span<const ContactState> moment);
  void layTouches();
  void keepClicks(const audio::ScheduledSound& sound);
  std::uint64_t keepLoudest(std::size_t events);
  void send();
  void sendRings(const audio::ScheduledSound& sound);

  void receive(std::size_t frames) noexcept;
  void receiveRings(std::size_t frames) noexcept;
  std::span<const audio::PulseNode> arrivedTrain(SpscQueue<audio::PulseNode>& from,
                                                 std::size_t nodes) noexcept;
  void measure(double seconds, std::size_t frames) noexcept;
  void publish() noexcept;

  SoundSettings settings_;

  // The simulation thread's members.
  audio::ContactSoundScheduler layer_;
  SoundTimeline timeline_;
  std::vector<ImpulseEvent> posted_;   // events of the step in hand
  std::vector<ContactState> touched_;  // lasting contacts of the step in hand
  std::vector<Laid> laid_;
  std::vector<audio::Click> laidClicks_;
  std::vector<audio::SphereWeights> laidEars_;
  std::vector<audio::PulseNode> laidNodes_;
  std::vector<double> slideRanks_;   // by contact of the moment in hand
  std::vector<double> sortedRanks_;  // scratch for rankToSlide
  SoundStatistics counters_;         // counts of this thread

  SpscQueue<QueuedClick> queue_;
  SpscQueue<QueuedRing> rings_;
  SpscQueue<QueuedTaps> taps_;              // taps of rings_, in their order
  SpscQueue<audio::PulseNode> trains_;      // nodes of queue_, in its order
  SpscQueue<audio::PulseNode> ringTrains_;  // nodes of rings_, in its order
  std::atomic<std::int64_t> rendered_{0};
  Shared shared_;
  OutputGain gain_;

  // The audio thread's members.
  audio::ClickRenderer player_;
  std::optional<Limiter> limiter_;
  std::vector<audio::Click> arrived_;  // clicks of one event
  std::vector<audio::SphereWeights> arrivedEars_;
  std::vector<audio::ModalExcitation> arrivedRings_;
  std::vector<double> arrivedTaps_;
  std::vector<audio::PulseNode> arrivedTrain_;
  std::vector<float> planar_;  // for renderInterleaved
  std::vector<float*> planarChannels_;
  double measuredTime_ = 0.0;  // s, fading
  double measuredWork_ = 0.0;  // fading
  double cpuShare_ = 0.0;
  double worstBlock_ = 0.0;
};

}  // namespace carom::plugin
