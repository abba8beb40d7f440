#pragma once

#include <complex>
#include <cstddef>
#include <vector>

namespace carom::lab {

/// Outputs of one band for one tap, and the variance of the noise in them.
struct BandSignal {
  std::vector<std::complex<double>> outputs;
  double noise = 0.0;  ///< above 0
};

/// One damped oscillation of a band: amplitudes[tap] exp(s t) from the first output on.
struct BandPole {
  std::complex<double> s;  ///< 1/s, relative to the centre of the band
  std::vector<std::complex<double>> amplitudes;
  /// 1, share of the other orders and windows in which the pole was found again.
  double stability = 0.0;
  double energyRatio = 0.0;  ///< 1, its energy over the noise in the outputs, of the clearest tap
  double length = 0.0;       ///< s, of the window
};

/// Finds the damped oscillations that several signals of one band have in common, by ESPRIT (Roy,
/// Kailath 1989, IEEE Trans. ASSP 37, 984) on the sum of the signals' Hankel matrices times their
/// adjoints, each over its noise, which is the signal subspace of all of them side by side. The
/// order is the number of eigenvalues above what white noise of the given variance reaches
/// (Marchenko and Pastur's edge, with a reserve), reduced to where the subspace is invariant to a
/// shift (ESTER: Badeau, David, Richard 2006, IEEE Trans. Signal Processing 54, 450). Amplitudes by
/// least squares. Windows end where all signals have sunk into the noise. `rate` in Hz is that of
/// the outputs. Empty if there is nothing above the noise. [any thread]
std::vector<BandPole> subspaceModes(const std::vector<BandSignal>& signals, double rate);

}  // namespace carom::lab
