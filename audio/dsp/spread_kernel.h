#pragma once

#include <array>
#include <complex>
#include <cstddef>

namespace carom::audio {

// An instant between two samples is put on the samples as the samples of a short, smooth bump
// centred on it. The bump keeps frequencies beyond the band from folding back into it, and dims the
// band in a known way, which RadiationFilter undoes: the gridding of non-uniform fast Fourier
// transforms (Beatty, Nishimura, Pauly 2005, "Rapid gridding reconstruction with a minimal
// oversampling ratio", IEEE Trans. Med. Imaging 24). [any thread]

/// Upper end of the band that is kept, as a share of the sample rate: 20 kHz at 48 kHz.
inline constexpr double kBand = 0.4167;

/// Width of the kernel in samples.
inline constexpr std::size_t kSpreadWidth = 16;
inline constexpr double kSpreadHalfWidth = 0.5 * static_cast<double>(kSpreadWidth);

/// The kernel at `t` samples from its centre, dimensionless: a sinc under a Kaiser window, 1 at the
/// centre and 0 beyond half the width. Its spectrum within the band is at most 25 dB below that at
/// 0 Hz; frequencies that fold back into the band are at least 109 dB below those that belong
/// there.
double spreadKernel(double t);

/// The kernel's Fourier transform, in samples, at `frequency` in cycles per sample, by quadrature.
double spreadTransform(double frequency);
/// The kernel's transform, in samples, for a signal that grows or decays, exp(s t), s in 1/samples:
/// the factor that the kernel leaves of it.
std::complex<double> spreadTransform(std::complex<double> s);

/// The kernel's samples for instants between two samples, tabulated.
class SpreadTable {
 public:
  static constexpr std::size_t kStride = kSpreadWidth;
  /// Number of rows for one sample; linear interpolation between two rows errs by -110 dB.
  static constexpr std::size_t kPhases = 256;

  static const SpreadTable& instance();

  /// Row `phase` of 0 to kPhases: spreadKernel(-kSpreadWidth / 2 + phase / kPhases + m) at [m],
  /// 0 <= m < kSpreadWidth. Aligned to 64 bytes.
  const double* row(std::size_t phase) const { return &rows_[phase * kStride]; }

 private:
  SpreadTable();
  alignas(64) std::array<double, (kPhases + 1) * kStride> rows_{};
};

}  // namespace carom::audio
