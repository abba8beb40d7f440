#pragma once

#include <cstddef>
#include <vector>

#include "carom/audio/contact_state.h"
#include "carom/audio/synth.h"

namespace carom::test {

/// Bodies of one material that slide or roll on a floor of it in many directions, as a mechanics in
/// steps reports them.
struct NoisySlides {
  std::size_t count = 1;
  const char* material = "wood";
  double side = 0.2;     ///< m, of a cube with the same mass
  double speed = 1.0;    ///< m/s, of the first; the others' are up to 30 % lower
  double slowing = 0.0;  ///< m/s^2
  bool rolls = false;    ///< balls instead of blocks
  double step = 1.0 / 60.0;
  double duration = 4.0;  ///< s
  double distance = 2.0;  ///< m, of the listener
  /// The first body's load over its weight, by time in s: 1 unless set.
  double (*pressed)(double) = nullptr;

  static constexpr double kRate = 48000.0;  ///< Hz

  Synth synth(const SynthSettings& settings) const;
  ContactState state(std::size_t body, std::size_t step) const;
  /// The sound (Pa) of a pair of microphones, channel after channel.
  std::vector<std::vector<double>> sound(const SynthSettings& settings,
                                         SynthCounters* counters) const;
};

/// Mean power (Pa^2) in each third octave of 10^(n/10) Hz, n = 17 to 42, from `begin` to `end`.
std::vector<double> thirdOctavesOf(const std::vector<double>& sound, std::size_t begin,
                                   std::size_t end);

}  // namespace carom::test
