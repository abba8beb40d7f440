#pragma once

#include <array>
#include <complex>
#include <cstddef>

namespace carom::audio {

// How an instant between two samples is put on the samples: as the samples of a short, smooth bump
// centred on it. The bump keeps what lies beyond the band from folding back into it, and dims the
// band in a known way, which RadiationFilter undoes: the gridding of non-uniform fast Fourier
// transforms (Beatty, Nishimura, Pauly 2005, "Rapid gridding reconstruction with a minimal
// oversampling ratio", IEEE Trans. Med. Imaging 24). [any thread]

/// The band that is kept: this share of the sample rate, 20 kHz at 48 kHz.
inline constexpr double kBand = 0.4167;

/// Samples that the kernel reaches over.
inline constexpr std::size_t kSpreadWidth = 16;
inline constexpr double kSpreadHalfWidth = 0.5 * static_cast<double>(kSpreadWidth);

/// 1, at `t` samples from its centre: a sine cardinal under a Kaiser window, 1 at the centre and 0
/// beyond half the width. Within the band at most 25 dB dimmer than at its bottom; what folds back
/// to a frequency in the band is at least 109 dB below what belongs there.
double spreadKernel(double t);

/// Samples: the kernel's Fourier transform at `frequency` in cycles per sample, by quadrature.
double spreadTransform(double frequency);
/// Samples: the same for what grows or decays, exp(s t), s in 1 / samples: what is left of it.
std::complex<double> spreadTransform(std::complex<double> s);

/// The kernel's samples for instants between two samples, tabulated.
class SpreadTable {
 public:
  static constexpr std::size_t kStride = kSpreadWidth;
  /// Between two rows one interpolates linearly: 110 dB down.
  static constexpr std::size_t kPhases = 256;

  static const SpreadTable& instance();

  /// Row `phase` of 0 to kPhases: spreadKernel(-kSpreadWidth / 2 + phase / kPhases + m) at [m],
  /// 0 <= m < kSpreadWidth. On a boundary of 64 bytes.
  const double* row(std::size_t phase) const { return &rows_[phase * kStride]; }

 private:
  SpreadTable();
  alignas(64) std::array<double, (kPhases + 1) * kStride> rows_{};
};

}  // namespace carom::audio
