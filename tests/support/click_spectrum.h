#pragma once

#include <complex>
#include <vector>

#include "audio/model/pulse.h"
#include "carom/audio/synth.h"

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
  /// Below 1 the contact loses energy: the pulse is Pulse::dissipativeHertz() instead of `pulse`.
  double restitution = 1.0;
};

/// A synth with one listener and with the ball, and the event of the ball's click.
Synth makeClickSynth(const ClickCase& click);
ImpulseEvent makeClickEvent(const ClickCase& click);

/// Renders the click by the synth, from the clock's 0 until it is over. Pa.
std::vector<double> renderClick(const ClickCase& click);

/// Shape of the force on the ball over time, and the change of the ball's speed by it in m/s: j /
/// m.
audio::Pulse pulseOf(const ClickCase& click);
double speedChange(const ClickCase& click);

/// The Fourier transform at `frequencies` (Hz) of Pulse::force over the contact, dimensionless,
/// with first touch at time 0: by quadrature in small steps. It depends only on the pulse and the
/// duration of `click`.
std::vector<std::complex<double>> forceSpectrum(const ClickCase& click,
                                                const std::vector<double>& frequencies);

/// Spectrum of the ball's sound over that of the force, in Pa s, with first touch at `click.time`.
std::complex<double> radiatedSpectrum(const ClickCase& click, double frequency);

/// The Fourier transform of the sound of a click at `frequencies` (Hz), in Pa s, from the formulas
/// in docs/acceleration_noise.md and forceSpectrum(): independent of the synth's rendering.
/// `click.sampling` is not used.
std::vector<std::complex<double>> exactSpectrum(const ClickCase& click,
                                                const std::vector<double>& frequencies);

/// The Fourier transform of samples, by the sum over them.
std::vector<std::complex<double>> spectrumOf(const std::vector<double>& samples, double sampleRate,
                                             const std::vector<double>& frequencies);

/// Frequencies in Hz, ascending, up to kBand of the sample rate: close enough for the integrals
/// below.
std::vector<double> bandFrequencies(const ClickCase& click);

/// The integral of the squared magnitude over frequency.
double energyOf(const std::vector<std::complex<double>>& spectrum,
                const std::vector<double>& frequencies);

/// Energy of the difference of the two clicks over that of `reference`, both below kBand of the
/// sample rate, in dB. The reference may have another pulse or another radiation at the same time.
double inBandError(const ClickCase& click, const ClickCase& reference);

/// Energy of the rendered click over that of the exact click, in the band, in dB.
double inBandLevel(const ClickCase& click);

}  // namespace carom::test
