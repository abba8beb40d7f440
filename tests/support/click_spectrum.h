#pragma once

#include <complex>
#include <vector>

#include "audio/pulse.h"
#include "audio/synth.h"

namespace carom::test {

/// One click of a rigid sphere, as the synth is asked to render it.
struct ClickCase {
  PulseShape pulse = PulseShape::hertz;
  Sampling sampling = Sampling::bandLimited;
  Radiation radiation = Radiation::exact;
  double duration = 100e-6;  ///< s, of the contact
  double radius = 0.01;      ///< m, of the sphere
  double distance = 1.0;     ///< m, straight ahead
  double sampleRate = 48000.0;
  double time = 0.05;  ///< s, of first touch
};

/// What the synth makes of it, from the clock's 0 until it is over. Pa.
std::vector<double> renderClick(const ClickCase& click);

/// The Fourier transform of the sound of a click at `frequencies` (Hz), in Pa s, from the formulas
/// in docs/acceleration_noise.md and the pulse's own transform by quadrature of Pulse::force in
/// small steps: nothing of the synth's rendering is in it. `click.sampling` is not used.
std::vector<std::complex<double>> exactSpectrum(const ClickCase& click,
                                                const std::vector<double>& frequencies);

/// The same of samples, by the sum over them.
std::vector<std::complex<double>> spectrumOf(const std::vector<double>& samples, double sampleRate,
                                             const std::vector<double>& frequencies);

/// Energy of the difference over that of `reference`, both below kBand of the sample rate, in dB.
/// The reference may be another pulse or another radiation at the same time.
double inBandError(const ClickCase& click, const ClickCase& reference);

/// Energy of what is rendered over that of the exact click, in the band, in dB.
double inBandLevel(const ClickCase& click);

}  // namespace carom::test
