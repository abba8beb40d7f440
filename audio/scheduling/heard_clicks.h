#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace carom::audio {

/// Decides which clicks are heard at all (LastingDetail::heard): a heap that settles makes
/// thousands of impacts a second that are below hearing, or that louder ones of the same kind hide.
/// [one thread]
class HeardClicks {
 public:
  enum class Fate : std::uint8_t { heard, inaudible, masked };

  struct Candidate {
    double time = 0.0;      ///< s, simulation clock
    double peak = 0.0;      ///< Pa, upper bound at any listener
    double duration = 0.0;  ///< s, for which it sounds
  };
  /// Clicks come about in order of time; one of an earlier time counts as of the latest.
  Fate decide(const Candidate& click);

 private:
  /// Energies (Pa^2 s) of the clicks of the last moments.
  struct Recent {
    double all = 0.0;
    double hidden = 0.0;  // of those that are left out
  };
  void fade(double time);

  static constexpr std::size_t kKinds = 8;
  std::array<Recent, kKinds> recent_{};  // by duration: clicks of one kind have about the same band
  double quiet_ = 0.0;                   // power over the threshold, recently left out
  double time_ = 0.0;                    // s, of the latest click
};

}  // namespace carom::audio
