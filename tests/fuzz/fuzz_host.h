#pragma once

#include <array>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <thread>
#include <vector>

#include "carom/sound_output.h"
#include "tests/fuzz/fuzz_numbers.h"

namespace carom::fuzz {

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

/// Requires that each share which was posted has one fate; see SoundStatistics.
inline void requireOneFateEach(const SoundStatistics& of) {
  const std::uint64_t leftOut = of.inaudible + of.masked + of.stolen + of.overBudget + of.noBus +
                                of.tooLong + of.ringsLeftOut + of.queueFaults;
  require(of.posted == of.silenced + of.skipped + of.immovable + of.rejected + of.heard + leftOut +
                           of.lost + of.waiting);
}

}  // namespace carom::fuzz
