#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "audio/synthesis/scheduled_sound.h"
#include "plugin/realtime/sound_queue.h"

namespace carom::plugin {

/// The sounds of one step of the simulation on their way into the queue. Excitations of modes go
/// there at once; of the clicks, the loudest events do when the step ends. [simulation thread]
class StepSounds final : public audio::SoundSink {
 public:
  /// `voices`: the most events of a step that cross. The queue must outlive it.
  StepSounds(SoundQueue& queue, std::size_t voices) : queue_(queue), voices_(voices) {}

  struct Loudest {
    double peak = 0.0;  ///< Pa, estimate
    std::int64_t first = std::numeric_limits<std::int64_t>::max();
  };

  void add(const audio::ScheduledSound& sound) override;
  /// Sends the step's clicks, and lets the audio thread see them and the excitations.
  void send();

  /// Returns the peak (Pa) and the first sample of the step's impacts, and begins anew; a peak of 0
  /// if there were none. Those that begin in the same bin, about a millisecond, add up by their
  /// power. What slides grows slowly, and its bound is far above what is heard: it is left out.
  Loudest takeLoudest();

  std::uint64_t stolen() const { return stolen_; }  ///< events left out as others were louder
  std::uint64_t faults() const { return faults_; }  ///< events left out for lack of room
  /// Steps of lasting contacts left out, for either reason.
  std::uint64_t slidesLeftOut() const { return slidesLeftOut_; }
  /// Rings of events that are heard otherwise, and motions of rings, left out for lack of room.
  std::uint64_t ringsLeftOut() const { return ringsLeftOut_; }

 private:
  /// An event of the step; its arrays lie one behind the other.
  struct Event {
    double peak = 0.0;
    std::size_t first = 0;      // its first click in clicks_
    std::size_t count = 0;      // number of its clicks
    std::size_t firstNode = 0;  // in nodes_
    std::size_t nodes = 0;      // 0: its clicks have a pulse
    bool isEvent = false;
  };
  void noteLoudness(const audio::ScheduledSound& sound);
  void keepLoudest(std::size_t events, std::uint64_t& eventsLeftOut);
  void addRing(const audio::ScheduledSound& sound);
  void compact();
  std::size_t room() const;

  SoundQueue& queue_;
  std::size_t voices_;
  std::vector<Event> events_;
  std::vector<audio::Click> clicks_;
  std::vector<audio::SphereWeights> ears_;
  std::vector<audio::PulseNode> nodes_;
  static constexpr std::int64_t kBin = 48;  // samples
  static constexpr std::size_t kBins = 64;
  std::array<double, kBins> power_{};  // Pa^2, by bin of the first sample, modulo kBins
  std::int64_t firstImpact_ = std::numeric_limits<std::int64_t>::max();
  std::uint64_t stolen_ = 0;
  std::uint64_t faults_ = 0;
  std::uint64_t slidesLeftOut_ = 0;
  std::uint64_t ringsLeftOut_ = 0;
};

}  // namespace carom::plugin
