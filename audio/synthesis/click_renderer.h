#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "audio/propagation/reverb.h"
#include "audio/propagation/sound_paths.h"
#include "audio/synthesis/click.h"
#include "audio/synthesis/click_bus.h"
#include "audio/synthesis/click_calendar.h"
#include "audio/synthesis/click_sampler.h"
#include "audio/synthesis/modal_bank.h"
#include "audio/synthesis/noise_bed.h"
#include "audio/synthesis/scheduled_sound.h"
#include "audio/synthesis/train_store.h"
#include "audio/synthesis/voice_table.h"

namespace carom::audio {

/// The most that a ClickRenderer may hold, allocated in advance: with a capacity, nothing allocates
/// later.
struct RendererCapacity {
  /// Events whose sound has still to begin at some receiver. Beyond it the quietest is dropped.
  std::size_t voices = 2048;
  /// Clicks of these events: one for each channel and path. Raised to the clicks of one event, and
  /// limited to those that all voices can have.
  std::size_t clicks = 65536;
  std::size_t clicksPerWay = 1;  ///< of an event, over a path to a channel: more for recoils
  /// Filters that run at the same time: one for each size of body, channel and kind of path.
  std::size_t buses = 256;
  /// Nodes of lasting contacts whose sound has still to begin; beyond it, steps of contacts are
  /// left out.
  std::size_t nodes = 0;
  /// s. Longer contacts are left out: their sound lies below 30 Hz or so.
  double longestContact = 0.05;
  ModalCapacity modes = {};
};

/// Turns clicks and modal excitations into samples: the half of Synth that runs in real time.
///
/// Without a capacity it takes all sounds, and allocates in `add`. With one, memory is allocated at
/// construction; then nothing allocates, locks or calls the system, and overload is handled thus:
///
/// - An event is played whole or left out whole, at all receivers, before any of it begins: so
///   leaving it out causes no click.
/// - Too many events waiting: the quietest of them and the newcomer is left out.
/// - Too much work (`setAllowance`): every kQuantum samples, the loudest of the events that are
///   about to begin are taken as far as they can be afforded. Events that have begun go on.
/// - A sample that is not finite becomes 0, and what it has left in filters is forgotten.
/// - An event that comes too late begins at the next sample, all of it later by as much. (Without a
///   capacity it begins in the middle, as offline there is no reason to be late.)
///
/// The bits of the sound do not depend on the sizes of blocks. [one thread]
class ClickRenderer final : public SoundSink {
 public:
  explicit ClickRenderer(std::shared_ptr<const SoundPaths> paths,
                         std::optional<RendererCapacity> capacity = std::nullopt);

  /// Adds the clicks and excitations of an event.
  void add(const ScheduledSound& sound) override;

  /// Renders samples: as Synth::render.
  template <class Sample>
  void render(std::span<Sample* const> channels, std::size_t frames) noexcept;

  /// Drops all sound that has not been rendered yet; the next sample is `position`.
  void seek(std::int64_t position);

  static constexpr std::size_t kQuantum = 64;  ///< samples
  /// Limits the work per second, in the units of `takeWork`; infinite unless set. Has an effect
  /// only with a capacity.
  void setAllowance(double workPerSecond) noexcept;
  /// Returns the work done since the last call. The unit is about a nanosecond on some machine:
  /// operations that take longer count more.
  double takeWork() noexcept { return std::exchange(work_, 0.0); }
  std::size_t clicksPerEvent() const;  ///< the most that an event without a recoil can have

  std::int64_t position() const { return position_; }  ///< the next sample to be rendered
  std::size_t pendingClicks() const { return waiting_.size(); }
  std::size_t voices() const { return voices_.size(); }  ///< counted with a capacity only
  std::size_t busesInUse() const;
  bool isSilent() const;
  /// Counters of clicks and excitations: heard, lost, late, tooLong, slidesLeftOut, noBus, stolen,
  /// overBudget, modalVoicesExhausted, ringsLeftOut, silencedFrames.
  SynthCounters counters() const { return counters_ + modalBank_.counters(); }
  const ModalBank& modalBank() const { return modalBank_; }

 private:
  struct Bus {
    ClickBus line;
    std::uint64_t key = 0;
    std::uint32_t pending = 0;  // clicks that wait for it
  };
  struct BusOfKey {
    std::uint64_t key = 0;
    std::uint32_t bus = 0;
  };
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};

  void addClicks(const ScheduledSound& sound);
  void chooseLeader() noexcept;
  void leaveOut(std::uint64_t SynthCounters::*reason, bool isEvent) noexcept {
    ++(counters_.*(isEvent ? reason : &SynthCounters::slidesLeftOut));
  }
  std::span<const PulseNode> keptTrain(const ScheduledSound& sound);
  void makeRoom();
  std::size_t roomOf(const Click& click) const;
  bool isTooLong(const ScheduledSound& sound) const;
  bool isOver(const Click& click) const;
  bool arrive(const ScheduledSound& sound);
  bool makePlace(const ScheduledSound& sound) noexcept;
  void dropFrom(std::uint32_t voice, std::int64_t from) noexcept;
  void enqueue(const Click& click, const SphereWeights* ears, std::uint32_t voice);
  bool findBuses(Click& click);
  void leaveBuses(const Click& click) noexcept;
  void reserveScratch(const Click& click);
  std::uint64_t keyOf(std::uint32_t filter, std::uint32_t chain, std::uint32_t channel) const;
  std::uint32_t busOf(const Click& click, std::size_t filter);
  std::uint32_t idleBus();
  bool isEarlier(const ClickCalendar::Entry& a, const ClickCalendar::Entry& b) const;
  void beginUntil(std::int64_t end) noexcept;
  void chooseVoices(std::span<const ClickCalendar::Entry> due, std::int64_t end) noexcept;
  void spend(double work) noexcept {
    work_ += work;
    affordable_ -= work;
  }
  std::size_t nextPart(std::size_t frames) noexcept;
  double workOf(const Click& click) const noexcept;
  void begin(std::uint32_t slot) noexcept;
  std::span<const double> samplesOf(const Click& click) noexcept;
  std::span<const double> earOf(std::uint32_t slot) noexcept;
  std::span<const double> responseOf(std::uint32_t slot) noexcept;
  void mix(std::size_t frames) noexcept;
  void addNoise(std::size_t frames) noexcept;
  void reverberate(std::size_t frames) noexcept;
  void silenceNotFinite(std::size_t frames) noexcept;

  std::shared_ptr<const SoundPaths> paths_;
  std::optional<RendererCapacity> capacity_;
  const SynthSettings& settings_;  // settings of paths_
  const ClickKernels& kernels_ = fastestKernels();
  SynthCounters counters_;  // of clicks; those of modes are the bank's

  std::int64_t position_ = 0;
  std::vector<Click> clicks_;        // by slot
  std::vector<SphereWeights> ears_;  // by slot, if there is a head
  std::vector<std::uint32_t> freeSlots_;
  ClickCalendar waiting_;
  VoiceTable voices_;  // used with a capacity only
  std::vector<Bus> buses_;
  std::vector<BusOfKey> busOrder_;  // all buses by key: the order in which they are summed
  std::size_t idleCursor_ = 0;      // index at which the search for an idle bus goes on
  ModalBank modalBank_;
  std::optional<NoiseBed> bed_;  // of lasting contacts, for LastingDetail::heard
  std::vector<Reverb> reverbs_;  // one per listener, or none
  std::size_t slots_ = 0;        // largest number of clicks, with a capacity
  std::size_t mostNodes_ = 0;    // largest number in a train, with a capacity
  std::size_t mostSamples_ = 0;  // length of the longest click so far, an ear's response included

  double allowance_ = std::numeric_limits<double>::infinity();  // work per second
  double work_ = 0.0;
  double affordable_ = allowance_;     // work that is left until the next quantum begins
  std::size_t untilQuantum_ = 0;       // samples until then
  std::vector<std::uint32_t> chosen_;  // voices, scratch of chooseVoices
  std::vector<Click> arriving_;        // clicks of the event that is being added
  TrainStore trains_;

  ClickSampler sampler_;
  std::vector<double> x_;         // a click's samples, zeros in front for the response
  std::vector<double> ear_;       // response of an ear
  std::vector<double> air_;       // of the air
  std::vector<double> response_;  // of both
  std::vector<double> heard_;     // the click's samples through that response
  std::vector<double> mix_;       // Pa, kMixFrames per channel, planar
  std::vector<double> send_;      // Pa at 1 m, into the reverberation
};

}  // namespace carom::audio
