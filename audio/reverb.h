#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "audio/absorption.h"
#include "audio/decay_filter.h"
#include "audio/result.h"
#include "audio/room.h"

namespace carom {

/// A diffuse field as statistics see it.
struct ReverbSettings {
  double volume = 0.0;   ///< m^3, 0.1 to 1e6; sets the level
  double surface = 0.0;  ///< m^2, at least a sphere's; with the volume the mean free path 4 V / S
  DecayTimes decayTimes = {1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0};  ///< s, T60 per band, >= 0.05
  double onset = 0.0;  ///< s after the input, 0 to 1: where the tail begins; see onsetAfter
  double gain = 1.0;   ///< 1, >= 0, times the level of the diffuse field
  double speedOfSound = 343.0;  ///< m/s
  /// Pa, >= 1e-15. When the input is 0 and no line holds what could be heard above it, the tail is
  /// cut off, and isSilent.
  double silence = 1e-7;
};

/// s: T60 = 24 ln(10) V / (c (S alpha + 4 m V)), Sabine's (Kuttruff, Room Acoustics, 5th ed. 2009,
/// chapter 5). Infinity where nothing absorbs. `airAttenuation` is m, 1/m, of the energy, in the
/// bands. [any thread]
DecayTimes sabineDecayTimes(const RoomMeasures& room, double speedOfSound,
                            const std::array<double, kBandCount>& airAttenuation = {});

/// As Sabine's with -ln(1 - alpha) in place of alpha (Eyring 1930): 0 where alpha is 1.
/// [any thread]
DecayTimes eyringDecayTimes(const RoomMeasures& room, double speedOfSound,
                            const std::array<double, kBandCount>& airAttenuation = {});

/// s, after emission: when on average the reflection after the `order`th is due,
/// (order + 1) 4 V / (S c): where a tail leaves off from images up to that order. [any thread]
double onsetAfter(int order, double volume, double surface, double speedOfSound);

/// The tail of a box: Eyring's times (0.05 s where it is less), begun where the images of
/// `room.order` leave off. Refuses what is not a box, and a box in which a band is never absorbed.
/// [any thread]
Result<ReverbSettings> reverbOfBox(const Room& room, double speedOfSound);

/// Late reverberation: a feedback delay network (Jot & Chaigne 1991, "Digital delay networks for
/// designing artificial reverberators").
///
/// Sixteen lines, their lengths primes (so without common factor), spaced evenly in the logarithm
/// about the mean free time 4 V / (S c), from 0.55 to 1.7 times it; where the longest decay asks
/// for a greater modal density than that (total length below 0.15 T60: Schroeder 1962) the longest
/// grow, to at most 8 times it. Mixed by the Hadamard matrix of order 16 over 4: orthogonal, exact
/// in binary arithmetic. Each line ends in a decayCascade for its length.
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
/// Channels are fed by rows of the Hadamard matrix, so they are orthogonal sums of the lines: as
/// of microphones far apart. Microphones near each other share a diffuse field's low frequencies
/// (sin(kr)/(kr)); that is not modelled, nor are position, directivity and coupled rooms.
///
/// Deterministic, and the same bits however `process` is cut into blocks. Values below 1e-30 are
/// set to 0 in the lines, and in the filters at every 16th sample, so none becomes subnormal;
/// the floating-point environment is left alone. Single-threaded: one thread at a time, any.
class Reverb {
 public:
  static constexpr std::size_t kLines = 16;
  static constexpr std::size_t kMaxChannels = kLines;

  /// Refuses: settings out of range, times of which only some are infinite, a sample rate outside
  /// 8000 to 192000 Hz, no channel or more than kMaxChannels. Allocates all that is ever needed.
  /// All times infinite: nothing decays and it is never silent again (for tests).
  static Result<Reverb> create(const ReverbSettings& settings, double sampleRate,
                               std::size_t channels);

  /// Adds the tail of `in` (Pa at 1 m, see the class) to in.size() samples of each channel, in
  /// pascals. Requires addTo.size() == channels(). A sample that is not finite, or below 1e-30 in
  /// magnitude, counts as 0, one beyond 1e100 as that.
  void process(std::span<const double> in, std::span<double* const> addTo) noexcept;

  /// Whether `process` with zeros would add nothing, now and ever; it may then be left out.
  bool isSilent() const { return silent_; }

  /// Drops what still sounds.
  void reset() noexcept;

  std::size_t channels() const { return channels_; }
  /// samples, of the lines, ascending.
  const std::array<std::uint32_t, kLines>& lengths() const { return lengths_; }
  /// s: what the filters make of the decay times at `frequency` (Hz), averaged over the lines.
  double decayTime(double frequency) const;
  /// Pa^2: the sum of the squares of all that the lines hold; conserved where nothing decays.
  double storedEnergy() const;
  /// For tests: whether the state is whole (finite, nothing subnormal, cursors inside, silent means
  /// empty); if not, says why where asked.
  bool validate(std::string* why = nullptr) const;

 private:
  using Lines = std::array<double, kLines>;
  /// One filter of each line's cascade, side by side.
  struct Section {
    Lines b0, b1, a1;
    Lines state{};
  };
  /// A filter of the cascade on the way in.
  struct InputSection {
    ReflectionFilter filter;
    double state = 0.0;
  };

  Reverb(const ReverbSettings& settings, double sampleRate, std::size_t channels);

  void makeLines(double meanLength, double longestDecay);
  void makeFilters(const DecayTimes& times);
  void makeOnset(double onset, const DecayTimes& times);
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
  double quietLevel_ = 0.0;  // Pa, in a line

  std::array<std::uint32_t, kLines> lengths_{};
  std::array<std::uint32_t, kLines> begins_{};   // of each line in buffer_
  std::array<std::uint32_t, kLines> cursors_{};  // in buffer_: the oldest sample of each line
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

}  // namespace carom
