#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "carom/audio/material.h"

namespace carom::audio {

/// What the air leaves of a sound on its way (airAttenuation), as a filter without feedback for any
/// distance.
///
/// The logarithm of the response is in proportion to the distance d. So is the cepstrum of the
/// response of minimum phase, d c[n], and its samples follow one from the other (Oppenheim &
/// Schafer, Discrete-Time Signal Processing, the recursion of the complex cepstrum):
///
///     h[0] = exp(d c[0]),  h[n] = d sum over k from 1 to n of (k / n) c[k] h[n - k]
///
/// It is cut off where it has decayed, so near sounds take a dozen taps. There is nothing to
/// interpolate and no state: a distance that changes from click to click changes the taps as
/// evenly. Minimum phase delays low frequencies by d slowness(); a click begins earlier by that, so
/// that they come after d over the speed of sound.
///
/// Left out where 16 kHz (or the top of the band) loses less than 0.5 dB; up to twice that
/// distance, the absorption rises from nothing to its full value, so that a listener who walks
/// hears no step. Above 0.8 of half the sample rate the attenuation is held back, or it would end
/// in a kink at half the rate that takes many taps. Errors: at most 0.5 dB up to 16 kHz and 1 km,
/// as long as less than 50 dB are lost, more than that where more are lost; farther than
/// farthest() the attenuation stays what it is there.
///
/// [any thread]
class AirFilter {
 public:
  /// Requires a medium that validateAir accepts, and a sample rate (Hz) from 8000 to 192000.
  AirFilter(const Medium& medium, double sampleRate);

  /// The distance (m) whose absorption is heard at `distance`, which may be infinite: 0 where the
  /// air is left out.
  double heardDistance(double distance) const;
  /// That distance in 16 bits, to 3e-4 of itself and a metre; 0 where the air is left out.
  std::uint16_t codeOf(double distance) const;
  static double heardDistanceOf(std::uint16_t code);

  /// Writes the taps for a distance that is heard (m) to the front of `to`, which has room for
  /// mostTaps(), and returns them.
  std::span<const double> taps(double heardDistance, std::span<double> to) const noexcept;
  std::size_t mostTaps() const { return cepstrum_.size(); }
  /// Number of taps for that distance, roughly: for estimates of work.
  double tapsAbout(double heardDistance) const;
  /// s/m, by which low frequencies are delayed.
  double slowness() const { return slowness_ / sampleRate_; }
  double farthest() const { return farthest_; }  ///< m

 private:
  double sampleRate_;
  double level_ = 0.0;            // 1/m, c[0]
  std::vector<double> cepstrum_;  // 1/m, n c[n]
  double slowness_ = 0.0;         // samples/m
  double nearest_ = 0.0;          // m, nearer the air is left out
  double farthest_ = 0.0;         // m
};

}  // namespace carom::audio
