#pragma once

#include <complex>
#include <vector>

#include "audio/pulse.h"
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
  /// 1 for `pulse`; below, the contact loses energy: Pulse::dissipativeHertz() instead of `pulse`.
  double restitution = 1.0;
};

/// A synth with one listener that knows the ball, and the event of its click.
Synth makeClickSynth(const ClickCase& click);
ImpulseEvent makeClickEvent(const ClickCase& click);

/// What the synth makes of it, from the clock's 0 until it is over. Pa.
std::vector<double> renderClick(const ClickCase& click);

/// How the ball's force rises and falls, and m/s, what it makes of the ball's speed: j / m.
audio::Pulse pulseOf(const ClickCase& click);
double speedChange(const ClickCase& click);

/// The Fourier transform at `frequencies` (Hz) of Pulse::force over the contact, dimensionless,
/// with first touch at time 0: by quadrature in small steps. Of `click`, it needs the pulse and the
/// duration.
std::vector<std::complex<double>> forceSpectrum(const ClickCase& click,
                                                const std::vector<double>& frequencies);

/// Pa s over the force's spectrum: what the ball makes of it, first touch being at `click.time`.
std::complex<double> radiatedSpectrum(const ClickCase& click, double frequency);

/// The Fourier transform of the sound of a click at `frequencies` (Hz), in Pa s, from the formulas
/// in docs/acceleration_noise.md and the pulse's own transform by quadrature of Pulse::force in
/// small steps: nothing of the synth's rendering is in it. `click.sampling` is not used.
std::vector<std::complex<double>> exactSpectrum(const ClickCase& click,
                                                const std::vector<double>& frequencies);

/// The same of samples, by the sum over them.
std::vector<std::complex<double>> spectrumOf(const std::vector<double>& samples, double sampleRate,
                                             const std::vector<double>& frequencies);

/// Hz, ascending, up to kBand of the sample rate: close enough for the integrals below.
std::vector<double> bandFrequencies(const ClickCase& click);

/// The integral of the squared magnitude over frequency.
double energyOf(const std::vector<std::complex<double>>& spectrum,
                const std::vector<double>& frequencies);

/// Energy of the difference over that of `reference`, both below kBand of the sample rate, in dB.
/// The reference may be another pulse or another radiation at the same time.
double inBandError(const ClickCase& click, const ClickCase& reference);

/// Energy of what is rendered over that of the exact click, in the band, in dB.
double inBandLevel(const ClickCase& click);

}  // namespace carom::test
