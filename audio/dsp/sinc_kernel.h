#pragma once

#include <cstddef>
#include <vector>

namespace carom::audio {

/// A sinc under a Kaiser window, tabulated: the kernel of band-limited interpolation.
///
/// sinc(c x) c I0(beta sqrt(1 - (x / h)^2)) / I0(beta) for |x| <= h, x in samples, h the half
/// width, c the cut-off over the Nyquist frequency; 0 outside (Kaiser 1974). Read from a table of
/// 512 points for each sample, linearly: off by less than 2e-6.
class SincKernel {
 public:
  /// @param halfWidth samples on either side, at least 1
  /// @param cutoff over the Nyquist frequency, above 0 and up to 1
  /// @param beta of the window; 8 is 80 dB down in the stop band
  SincKernel(std::size_t halfWidth, double cutoff, double beta);

  /// The kernel `x` samples from its middle. [any thread; does not allocate]
  double operator()(double x) const noexcept;
  std::size_t halfWidth() const { return halfWidth_; }

 private:
  std::size_t halfWidth_;
  std::vector<double> table_;  // x >= 0, and two zeros
};

}  // namespace carom::audio
