#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "carom/audio/absorption.h"
#include "carom/audio/result.h"
#include "carom/audio/room.h"

namespace carom::audio {

inline constexpr double kShortestDecay = 0.05;  ///< s, least decay time that is accepted

/// An error if the settings are out of the ranges that Reverb::create accepts. [any thread]
Status checkSettings(const ReverbSettings& settings);

/// Late reverberation: a feedback delay network (Jot & Chaigne 1991, "Digital delay networks for
/// designing artificial reverberators").
///
/// Sixteen lines, their lengths primes (so without common factor), spaced evenly in the logarithm
/// about the mean free time 4 V / (S c), from 0.55 to 1.7 times it; where the longest decay asks
/// for a greater modal density than that (total length below 0.15 T60: Schroeder 1962) the longest
/// grow, to at most 8 times it. Mixed by the Hadamard matrix of order 16 over 4: orthogonal, exact
/// in binary arithmetic. Each line ends in a decayCascade for its length, of TopDecay where the
/// decay at 16 kHz is given.
///
/// Level. With the input as the pressure that the source would have at 1 m in the free field, on
/// average over all directions (root of the mean square; of a dipole: its axis over sqrt(3)), and
/// not delayed, a channel's energy density at time t after it is that of the diffuse field,
///
///     h^2(t) = 4 pi c / V exp(-6 ln(10) t / T60),  t >= onset
///
/// per unit energy of the input: Barron & Lee 1988 ("Energy relations in concert auditoriums. I"),
/// where the reflected energy over the direct at 10 m is 31200 T / V exp(-0.04 r / T). Integrated,
/// it is the classic 16 pi / A of Sabine's A (Kuttruff, chapter 5).
///
/// Channels are fed by rows of the Hadamard matrix, so they are orthogonal sums of the lines, like
/// the signals of microphones far apart. Microphones near each other share a diffuse field's low
/// frequencies (sin(kr)/(kr)); that is not modelled, nor are position and coupled rooms, nor the
/// directivity of sources. Of a microphone's pattern (Receiver::pattern p) the mean over all
/// directions counts, (1 - p)^2 + p^2 / 3 of the energy: a cardioid hears 4.8 dB less.
///
/// Deterministic, and the same bits however `process` is cut into blocks. Values below 1e-30 are
/// set to 0 in the lines, and in the filters at every 16th sample, so none becomes subnormal; the
/// floating-point environment is left alone. Not thread-safe: any thread may call, but one at a
/// time.
class Reverb {
 public:
  static constexpr std::size_t kLines = 16;
  static constexpr std::size_t kMaxChannels = kLines;

  /// Refuses: settings out of range, times of which only some are infinite, a sample rate outside
  /// 8000 to 192000 Hz, no channel or more than kMaxChannels. Allocates all the memory that it ever
  /// needs. If all times are infinite, nothing decays and it is never silent again (for tests).
  static Result<Reverb> create(const ReverbSettings& settings, double sampleRate,
                               std::size_t channels);

  /// Adds the tail of `in` (Pa at 1 m, see the class) to in.size() samples of each channel, in
  /// pascals. Requires addTo.size() == channels(). A sample that is not finite, or below 1e-30 in
  /// magnitude, counts as 0; a magnitude beyond 1e100 counts as 1e100.
  void process(std::span<const double> in, std::span<double* const> addTo) noexcept;

  /// Sets the pattern of a channel's receiver: 0, omnidirectional, at first.
  void setPattern(std::size_t channel, double pattern);

  /// True if `process` with zeros would add nothing, now and ever; it may then be left out.
  bool isSilent() const { return silent_; }

  /// Drops all sound that is still in the lines and filters.
  void reset() noexcept;

  std::size_t channels() const { return channels_; }
  /// Lengths of the lines in samples, ascending.
  const std::array<std::uint32_t, kLines>& lengths() const { return lengths_; }
  /// Decay time in s that the filters produce at `frequency` (Hz), averaged over the lines.
  double decayTime(double frequency) const;
  /// Sum of the squares of all that the lines hold, in Pa^2; conserved where nothing decays.
  double storedEnergy() const;
  /// For tests: refuses a state that is not valid (finite, nothing subnormal, cursors inside,
  /// silent means empty).
  Status validate() const;

 private:
  using Lines = std::array<double, kLines>;
  /// One filter of each line's cascade, side by side.
  struct Section {
    Lines b0, b1, a1;
    Lines state{};
  };
  /// One filter of the cascade that the input passes.
  struct InputSection {
    ReflectionFilter filter;
    double state = 0.0;
  };

  Reverb(const ReverbSettings& settings, double sampleRate, std::size_t channels);

  void makeLines(double meanLength, double longestDecay);
  void makeFilters(const ReverbSettings& settings);
  void makeOnset(const ReverbSettings& settings);
  double delayInput(double sample) noexcept;
  void readLines(Lines& values) const noexcept;
  void filterLines(Lines& values) noexcept;
  double writeLines(const Lines& values, double input) noexcept;
  void advance() noexcept;
  void flushFilters() noexcept;
  void listenForSilence(double input, double loudest) noexcept;

  double sampleRate_;
  std::size_t channels_;
  double outputGain_ = 0.0;
  Lines patternGains_;       // by channel
  double quietLevel_ = 0.0;  // Pa, in a line

  std::array<std::uint32_t, kLines> lengths_{};
  std::array<std::uint32_t, kLines> begins_{};   // begin of each line in buffer_
  std::array<std::uint32_t, kLines> cursors_{};  // oldest sample of each line in buffer_
  std::vector<double> buffer_;
  std::vector<Section> sections_;

  std::vector<double> onset_;  // the input's delay line; may be empty
  std::size_t onsetCursor_ = 0;
  std::vector<InputSection> onsetSections_;

  std::uint32_t sinceFlush_ = 0;  // samples
  std::uint64_t quiet_ = 0;       // samples in a row with nothing to be heard
  std::uint64_t quietNeeded_ = 0;
  bool silent_ = true;
};

}  // namespace carom::audio
