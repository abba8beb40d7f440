#pragma once

#include <array>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <utility>

#include "carom/event_sound.h"
#include "tests/fuzz/fuzz_numbers.h"

namespace carom::fuzz {

/// A sample rate (Hz) at which there is little to render.
constexpr double kRate = 8000.0;

/// Settings of a sound that takes little memory, and so little time to make: limits are reached
/// soon.
inline SoundSettings smallSettings(FuzzNumbers& numbers) {
  SoundSettings settings;
  settings.onMessage = [](const std::string&) {};  // there are many
  settings.synth.sampleRate = kRate;
  settings.budget.voices = 1 + numbers.below(64);
  settings.budget.buses = 1 + numbers.below(16);
  settings.budget.ringingBodies = 2;
  settings.budget.modes = 4;
  settings.budget.slidingContacts = 2;
  return settings;
}

/// Keeps one sound for as long as the process runs, and with it the tables that all sounds share,
/// which take longer to make than all else.
inline void keepTables() {
  static const auto keeper = [] {
    FuzzNumbers none({});
    auto sound = EventSound::create(smallSettings(none));
    require(sound && sound->prepareRendering(kRate));
    return std::make_unique<EventSound>(*std::move(sound));
  }();
  require(keeper != nullptr);
}

/// Takes two channels of samples in small blocks, each of which must be finite.
template <class Render>
void pullFinite(const Render& render) {
  constexpr std::size_t kFrames = 64;
  std::array<std::array<float, kFrames>, 2> samples = {};
  const std::array<float*, 2> channels = {samples[0].data(), samples[1].data()};
  render(channels, kFrames);
  for (const auto& channel : samples)
    for (const float sample : channel)
      require(std::isfinite(sample));
}

/// Pulls samples on a thread of its own, as a host's audio callback does, until it is told to end.
template <class Render>
class Puller {
 public:
  explicit Puller(const Render& render) : render_(render), thread_([this] { pull(); }) {}
  Puller(const Puller&) = delete;
  Puller& operator=(const Puller&) = delete;
  ~Puller() {
    ends_ = true;
    thread_.join();
  }

 private:
  void pull() {
    while (!ends_) {
      pullFinite(render_);
      std::this_thread::yield();
    }
  }

  Render render_;
  std::atomic<bool> ends_ = false;
  std::thread thread_;
};

/// Calls as long as the bytes last, `most` times at most.
template <class Call>
void callInAnyOrder(FuzzNumbers& numbers, std::size_t most, const Call& call) {
  for (std::size_t made = 0; made < most && !numbers.isEmpty(); ++made)
    call();
}

/// Requires that each share which was posted has one fate; see SoundStatistics.
inline void requireOneFateEach(const SoundStatistics& of) {
  const std::uint64_t leftOut = of.inaudible + of.masked + of.stolen + of.overBudget + of.noBus +
                                of.tooLong + of.ringsLeftOut + of.queueFaults;
  require(of.posted == of.silenced + of.skipped + of.immovable + of.rejected + of.heard + leftOut +
                           of.lost + of.waiting);
}

/// Closes a sound, and requires one fate of each share before and after: none waits any more.
template <class AnySound>
void closeWithFates(AnySound& sound) {
  requireOneFateEach(sound.statistics());
  (void)sound.close();
  const SoundStatistics end = sound.statistics();
  requireOneFateEach(end);
  require(end.waiting == 0);
}

}  // namespace carom::fuzz
