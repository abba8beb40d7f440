#pragma once

#include <complex>
#include <cstddef>
#include <span>
#include <vector>

namespace carom::lab {

/// A band of a signal, shifted to 0 Hz and decimated. Its filter looks ahead,
///
///     y[n] = sum over m of h[m] x[n D + m] exp(-i w_c (n D + m) / rate),
///
/// so that a damped oscillation exp(s t) that lasts from the first sample on is one from the first
/// output on, times gain(s): a filter that looks back would spend the begin of the ring on its own
/// attack. Windowed sinc (Kaiser, 90 dB). [any thread]
class Subband {
 public:
  /// A band of `width` around `centre` (Hz), of signals with `sampleRate`.
  Subband(double centre, double width, double sampleRate);

  double centre() const { return centre_; }  ///< Hz
  double width() const { return width_; }    ///< Hz
  double rate() const { return rate_; }      ///< Hz, of the outputs
  /// Samples that one output needs.
  std::size_t length() const { return taps_.size(); }
  /// Hz: white noise of one-sided density N0 has the variance N0 / 2 * noiseBandwidth in y.
  double noiseBandwidth() const { return noiseBandwidth_; }

  /// Returns the outputs that the samples suffice for, at most `most`.
  std::vector<std::complex<double>> of(std::span<const double> samples, std::size_t most) const;
  /// The factor that exp(s t) gets, s = -decay + 2 pi i frequency.
  std::complex<double> gain(std::complex<double> s) const;

 private:
  double centre_;
  double width_;
  double sampleRate_;
  double rate_;
  std::size_t decimation_;
  std::vector<double> taps_;
  double noiseBandwidth_ = 0.0;
};

}  // namespace carom::lab
