#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <cstdint>

#include "carom/audio/synth_settings.h"

namespace carom::audio {

/// The response of a rigid sphere that oscillates along one axis: pressure per acceleration,
/// without amplitude and delay. With G = rho0 a^3 cos(theta) / (2 c r), acceleration A(s) and delay
/// r/c,
///
///     exact:    p = G e^{-s (r - a)/c} (s + c/r) A(s) / (1 + (a/c) s + (a^2 / (2 c^2)) s^2)
///     compact:  p = G e^{-s r/c} s A(s)
///
/// The response is the fraction without the factors before it: far + (c/r) near. Sources: Morse &
/// Ingard 1968, Theoretical Acoustics, section 7.1, for the exact one; Howe 2002, eq. 3.8.5, for
/// the compact. `omega` in rad/s, `corner` = c/a in 1/s, infinite for compact. [any thread]
struct RadiationResponse {
  std::complex<double> far;   ///< 1/s
  std::complex<double> near;  ///< 1
};
RadiationResponse radiationResponse(double omega, double corner);

/// A filter's taps, with zeros around them so that vectors may reach beyond.
class PaddedTaps {
 public:
  static constexpr std::size_t kTaps = 56;
  static constexpr std::size_t kPad = 32;

  double* first() { return values_.data() + kPad; }
  const double* first() const { return values_.data() + kPad; }
  double operator[](std::size_t tap) const { return values_[kPad + tap]; }

 private:
  std::array<double, kPad + kTaps + kPad> values_{};
};

/// RadiationResponse on samples: taps, then a recursion whose poles are the sphere's own,
///
///     y[n] = sum over k of f[k] x[n - k - kFirstTap],   p[n] = y[n] + b1 p[n-1] + b2 p[n-2]
///
/// with far's taps per sample and not per second. The taps also undo the attenuation by
/// spreadKernel, unless the samples are bare ones. In the band (kBand) it agrees with
/// RadiationResponse to -90 dB at every frequency; beyond, it is not defined.
class RadiationFilter {
 public:
  static constexpr std::size_t kTaps = PaddedTaps::kTaps;
  static constexpr std::ptrdiff_t kFirstTap = -27;

  enum class Input : std::uint8_t {
    spread,  ///< instants put on the samples by spreadKernel
    bare,    ///< values at the samples
  };

  /// `corner` in 1 / samples: c / (a * sample rate); infinite for the compact model.
  RadiationFilter(double corner, Input input);

  /// The filter of a pair of poles p and p*, 1 / samples, its real part below 0, the imaginary
  /// above: far is s |p|^2 / ((s - p) (s - p*)), near the same without s. It is as exact as long as
  /// the poles are not far beyond the band.
  RadiationFilter(std::complex<double> pole, Input input);

  const PaddedTaps& far() const { return far_; }
  const PaddedTaps& near() const { return near_; }
  double b1() const { return b1_; }  ///< 0 where there is no recursion
  double b2() const { return b2_; }

 private:
  template <class Numerator>
  void fit(const Numerator& numerator, Input input, bool hasNear);

  PaddedTaps far_;
  PaddedTaps near_;
  double b1_ = 0.0;
  double b2_ = 0.0;
};

}  // namespace carom::audio
