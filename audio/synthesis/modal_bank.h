#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <memory_resource>
#include <optional>
#include <span>
#include <vector>

#include "audio/dsp/resonator_kernels.h"
#include "audio/propagation/sound_paths.h"
#include "audio/synthesis/click_calendar.h"
#include "audio/synthesis/click_sampler.h"
#include "audio/synthesis/modal_excitation.h"
#include "audio/synthesis/moving_ring.h"
#include "audio/synthesis/scheduled_sound.h"
#include "carom/audio/synth_settings.h"

namespace carom::audio {

/// The most that a ModalBank may hold, allocated in advance: with a capacity, nothing allocates
/// later. Then all paths of a ring in motion sound in one bank.
struct ModalCapacity {
  std::size_t banks = 128;  ///< banks that sound or wait: one for each body and channel
  std::size_t modes = 128;  ///< modes of a body; higher ones are left out
  std::size_t excitations =
      512;  ///< excitations that wait for their sample: one for each channel and path
  std::size_t motions = 512;  ///< motions that wait beside them; a ring skips further ones
  /// Changes of damping beside them: half of them in force, one for each body, the others wait.
  std::size_t dampings = 512;
  /// s. Longer contacts are left out.
  double longestContact = 0.05;
};

/// Turns modal excitations into samples, with banks of resonators, one for each body and channel:
/// excitations that reach a receiver over several paths sound in the same bank. Only if a ring is
/// followed in its motion from its blow on (ModalExcitation::isFollowed), each path has a bank of
/// its own. A motion of the path 0 takes over a bank of all paths as it sounds.
///
/// An excitation drives resonators of its own from its first sample to the end of its pulse, and on
/// to the next multiple of kGrid; their state is then added to that of the bank, where it decays
/// freely. On the same grid, resonators below `silence_` are stopped, and a bank where none is left
/// is free again. So the bits do not depend on the sizes of blocks. [one thread]
class ModalBank {
 public:
  static constexpr std::int64_t kGrid = 64;  ///< samples
  /// Returns the first sample of the grid that is not before `sample`.
  static constexpr std::int64_t gridFrom(std::int64_t sample) {
    return (sample + kGrid - 1) & ~(kGrid - 1);
  }

  /// Pa: amplitude at which a resonator is over.
  static double silence(const SynthSettings& settings);

  ModalBank(std::shared_ptr<const SoundPaths> paths,
            std::optional<ModalCapacity> capacity = std::nullopt);

  /// Adds the excitations of a sound. Without a capacity it takes all of them, and allocates. With
  /// one, those for which there is no room are left out, and late ones are heard later by as much.
  /// A train, if there is one, holds the nodes of all, in place of their own.
  void add(const ScheduledSound& sound);

  /// The output of `mix`, at most ClickBus::kMaxFrames frames: planar channels, `stride` apart, and
  /// the input of the reverberation.
  struct Mix {
    double* channels = nullptr;
    std::size_t stride = 0;
    double* send = nullptr;
    std::size_t frames = 0;
  };
  /// Adds the next samples to the buffers of `mix`.
  void mix(const Mix& mix) noexcept;

  /// Drops all sound; the next sample is `position`.
  void seek(std::int64_t position);

  /// Sets to 0 what is not finite, or beyond `most`, in resonators and in what is still to be
  /// heard.
  void forgetAbove(double most) noexcept;

  bool isSilent() const { return waiting_.size() == 0 && driven_.empty() && banksInUse() == 0; }
  std::size_t banksInUse() const { return order_.size(); }
  std::size_t resonatorsInUse() const;
  /// modalVoicesExhausted: excitations left out; silencedFrames; of events that only ring: heard,
  /// lost, tooLong, ringsLeftOut.
  const SynthCounters& counters() const { return counters_; }

 private:
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};

  /// The resonators of one body at one channel, and on one path if they are followed.
  struct Bank {
    explicit Bank(std::pmr::memory_resource* memory) : y(memory), damped(memory), moving(memory) {}

    BodyId body = 0;
    std::uint32_t channel = 0;
    std::uint32_t path = 0;  // ModalExcitation::path
    const ResonatorSet* resonators = nullptr;
    std::size_t count = 0;       // number of resonators, padded
    std::size_t active = 0;      // only the first so many of `count` may sound
    std::uint32_t pending = 0;   // excitations that wait for it or are driven
    std::pmr::vector<double> y;  // y1, and y2 `count` behind them
    bool isDamped = false;
    std::pmr::vector<double> damped;  // if isDamped: a1, and a2 `count` behind them
    bool isMoving = false;            // `moving` rings, and not y: always if the path is not 0
    MovingRing moving;
  };
  /// An excitation in a slot, which waits or is driven.
  struct Waiting {
    explicit Waiting(std::pmr::memory_resource* memory) : taps(memory) {}

    ModalExcitation excitation;
    std::uint32_t bank = 0;         // kNone for a change of what rings
    std::pmr::vector<double> taps;  // b0, b1; once driven y1, y2; then the factors, if followed
  };
  /// An excitation whose resonators are added to their bank at the sample `joins`.
  struct Driven {
    std::int64_t joins = 0;
    std::uint32_t slot = 0;
  };

  std::pmr::memory_resource* memory() noexcept;
  void makeRoom();
  bool addOne(const ModalExcitation& excitation, std::span<const double> taps);
  bool isTooLong(const ModalExcitation& excitation) const;
  std::size_t countOf(const ModalExcitation& excitation) const;
  std::size_t roomOf(const Click& drive) const;
  void reserve(const Click& drive, std::size_t count);
  std::uint32_t bankOf(const ModalExcitation& excitation, std::span<const double> taps);
  std::vector<std::uint32_t>::iterator placeOf(const ModalExcitation& excitation) noexcept;
  bool isBankOf(std::uint32_t bank, const ModalExcitation& excitation) const noexcept;
  static RingMotion motionOf(const ModalExcitation& excitation, std::span<const double> factors);
  std::uint32_t freeBank();
  std::uint32_t freeSlot();
  bool hasRoom(const ModalExcitation& excitation) const;
  void giveUpDamping(std::uint32_t slot) noexcept;
  bool isEarlier(const ClickCalendar::Entry& a, const ClickCalendar::Entry& b) const;
  void beginUntil(std::int64_t end) noexcept;
  void drive(std::uint32_t slot) noexcept;
  void joinLater(std::int64_t joins, std::uint32_t slot) noexcept;
  void joinAt(std::int64_t position) noexcept;
  void join(const Waiting& waiting) noexcept;
  void retire() noexcept;
  void giveBack(std::uint32_t slot) noexcept;
  void damp(std::uint32_t slot) noexcept;
  void move(std::uint32_t slot) noexcept;
  void beginMoving(Bank& bank, const RingMotion& motion) noexcept;
  void dampBank(Bank& bank, const Waiting& waiting) noexcept;
  void settle(Bank& bank) noexcept;
  bool isZero(const Bank& bank, std::size_t first) const noexcept;
  Resonators resonatorsOf(Bank& bank) const noexcept;
  Resonators ownOf(const ModalExcitation& excitation, std::size_t count) noexcept;
  void ringFreely(const Mix& mix, std::size_t from, std::size_t frames) noexcept;
  void addAhead(const Mix& mix) noexcept;

  std::shared_ptr<const SoundPaths> paths_;
  std::optional<ModalCapacity> capacity_;
  const ResonatorKernels& kernels_ = fastestResonators();
  ClickSampler sampler_;
  SynthCounters counters_;
  double silence_;  // Pa

  std::int64_t position_ = 0;
  // Thousands of small arrays: with a capacity, a few pieces of memory hold all of them.
  std::pmr::monotonic_buffer_resource arena_;
  std::vector<Waiting> slots_;
  std::vector<std::uint32_t> freeSlots_;
  std::size_t motions_ = 0;       // slots of motions that wait
  std::size_t dampingSlots_ = 0;  // slots of changes of damping that wait or are in force
  ClickCalendar waiting_;
  std::vector<Driven> driven_;           // sorted by the time they join
  std::vector<std::uint32_t> dampings_;  // slots of the changes of damping in force, one per body
  std::vector<Bank> banks_;
  std::vector<std::uint32_t> freeBanks_;
  std::vector<std::uint32_t> order_;  // banks in use, by body, channel and path, as they are summed

  std::vector<double> x_;    // samples of a drive, one zero in front
  std::vector<double> y_;    // state of the excitation that is being driven
  std::vector<double> own_;  // a1 and a2 of that excitation, if it is followed
  std::vector<double> out_;  // sound of that excitation
  std::vector<std::vector<double>>
      ahead_;                    // by channel: sound of driven excitations that is due later
  std::size_t mostSamples_ = 0;  // largest number in a drive, with a capacity
  std::size_t aheadEnd_ = 0;     // samples of ahead_ that may not be zero
};

}  // namespace carom::audio
