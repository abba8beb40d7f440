#include "tests/support/click_spectrum.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "audio/dsp/spread_kernel.h"
#include "audio/model/hertz.h"
#include "tests/audio/ball_drop.h"

namespace carom::test {

using namespace audio;

namespace {

using std::numbers::pi;
using Complex = std::complex<double>;

constexpr double kSpeed = 1.0;  // m/s
constexpr double kMass = 0.1;   // kg

// Steel with the modulus that makes the wanted duration, which goes with the power -2/5 of the
// modulus.
Material materialFor(const ClickCase& click) {
  Material material = *findMaterial("steel");
  double made = hertzDuration(makeClickEvent(click), material, material);
  if (click.restitution < 1.0) made *= dissipativeDuration(click.restitution);
  material.youngsModulus *= std::pow(made / click.duration, 2.5);
  return material;
}

double decibels(double energyRatio) {
  return 10.0 * std::log10(energyRatio + 1e-300);
}

}  // namespace

ImpulseEvent makeClickEvent(const ClickCase& click) {
  ImpulseEvent event;
  event.time = click.time;
  event.body = kBall;
  event.other = kFloor;
  event.normal = Vec3::UnitZ();
  event.impulse = kMass * speedChange(click) * Vec3::UnitZ();
  event.approachSpeed = kSpeed;
  event.effectiveMass = kMass;
  event.radius = click.radius;
  event.position = -click.radius * Vec3::UnitZ();
  return event;
}

Synth makeClickSynth(const ClickCase& click) {
  SynthSettings settings;
  settings.sampleRate = click.sampleRate;
  settings.comparison.pulse = click.pulse;
  settings.dissipative = click.restitution < 1.0;
  settings.comparison.sampling = click.sampling;
  settings.comparison.radiation = click.radiation;
  settings.audibleThreshold = 0.0;
  settings.doppler = false;
  settings.airAbsorption = false;
  const Material material = materialFor(click);
  Synth synth = *Synth::create(settings, {{"ahead", {0.0, 0.0, click.distance}}});
  const SoundBody ball{.material = material, .mass = kMass, .radius = click.radius};
  if (!synth.setBody(kBall, ball) || !synth.setBody(kFloor, {.material = material})) std::abort();
  const double made = synth.contactDuration(makeClickEvent(click));
  if (std::abs(made / click.duration - 1.0) > 1e-12) std::abort();
  return synth;
}

std::vector<double> renderClick(const ClickCase& click) {
  Synth synth = makeClickSynth(click);
  synth.schedule(makeClickEvent(click));
  std::vector<double> samples;
  constexpr std::size_t kBlock = 512;
  while (!synth.isSilent()) {
    samples.resize(samples.size() + kBlock);
    double* const channel = &samples[samples.size() - kBlock];
    synth.render<double>(std::span(&channel, 1), kBlock);
  }
  return samples;
}

Pulse pulseOf(const ClickCase& click) {
  return click.restitution < 1.0 ? Pulse::dissipativeHertz(click.restitution)
                                 : Pulse::of(click.pulse);
}

double speedChange(const ClickCase& click) {
  return (1.0 + click.restitution) * kSpeed;
}

std::vector<Complex> forceSpectrum(const ClickCase& click, const std::vector<double>& frequencies) {
  const Pulse pulse = pulseOf(click);
  // The substitution u = begin + (end - begin) sin^2(s) is smooth even where the force begins like
  // a root.
  const double span = pulse.end() - pulse.begin();
  const double widest = 2.0 * pi * frequencies.back() * click.duration * span;
  const int steps = 2000 + static_cast<int>(8.0 * widest);
  std::vector<double> times;
  std::vector<double> weights;
  for (int i = 0; i < steps; ++i) {
    const double s = 0.5 * pi * (i + 0.5) / steps;
    const double u = pulse.begin() + span * std::sin(s) * std::sin(s);
    times.push_back(click.duration * u);
    weights.push_back(pulse.force(u) * span * std::sin(2.0 * s) * 0.5 * pi / steps);
  }
  std::vector<Complex> spectrum;
  for (const double frequency : frequencies) {
    Complex force = 0.0;
    for (std::size_t i = 0; i < times.size(); ++i)
      force += weights[i] * std::polar(1.0, -2.0 * pi * frequency * times[i]);
    spectrum.push_back(force);
  }
  return spectrum;
}

Complex radiatedSpectrum(const ClickCase& click, double frequency) {
  const Medium air;
  const double a = click.radius;
  const double c = air.speedOfSound;
  const double source = air.density * std::pow(a, 3) / (2.0 * c) * speedChange(click);
  const Complex s{0.0, 2.0 * pi * frequency};
  const bool compact = click.radiation == Radiation::compact;
  const Complex exact =
      (s + c / click.distance) / (1.0 + a / c * s + a * a / (2.0 * c * c) * s * s);
  const double delay = (compact ? click.distance : click.distance - a) / c;
  return source / click.distance * (compact ? s : exact) * std::exp(-s * (click.time + delay));
}

std::vector<Complex> exactSpectrum(const ClickCase& click, const std::vector<double>& frequencies) {
  std::vector<Complex> spectrum = forceSpectrum(click, frequencies);
  for (std::size_t i = 0; i < spectrum.size(); ++i)
    spectrum[i] *= radiatedSpectrum(click, frequencies[i]);
  return spectrum;
}

std::vector<Complex> spectrumOf(const std::vector<double>& samples, double sampleRate,
                                const std::vector<double>& frequencies) {
  std::vector<Complex> spectrum;
  for (const double frequency : frequencies) {
    const Complex step = std::polar(1.0, -2.0 * pi * frequency / sampleRate);
    Complex sum = 0.0;  // Horner's scheme from the end
    for (std::size_t n = samples.size(); n-- > 0;)
      sum = sum * step + samples[n];
    spectrum.push_back(sum / sampleRate);
  }
  return spectrum;
}

std::vector<double> bandFrequencies(const ClickCase& click) {
  // Even spacing covers the band, and even spacing in the logarithm the energy of a long contact.
  const double edge = kBand * click.sampleRate;
  std::vector<double> frequencies;
  for (int i = 1; i <= 400; ++i)
    frequencies.push_back(edge * i / 400.0);
  const double low = std::min(0.001 * edge, 0.01 / click.duration);
  for (int i = 0; i < 800; ++i)
    frequencies.push_back(low * std::pow(edge / low, i / 800.0));
  std::ranges::sort(frequencies);
  return frequencies;
}

double energyOf(const std::vector<Complex>& spectrum, const std::vector<double>& frequencies) {
  double sum = 0.0;
  for (std::size_t i = 1; i < spectrum.size(); ++i)
    sum += 0.5 * (std::norm(spectrum[i]) + std::norm(spectrum[i - 1])) *
           (frequencies[i] - frequencies[i - 1]);
  return sum;
}

double inBandError(const ClickCase& click, const ClickCase& reference) {
  const std::vector<double> frequencies = bandFrequencies(click);
  const std::vector<Complex> exact = exactSpectrum(reference, frequencies);
  std::vector<Complex> error = spectrumOf(renderClick(click), click.sampleRate, frequencies);
  for (std::size_t i = 0; i < error.size(); ++i)
    error[i] -= exact[i];
  return decibels(energyOf(error, frequencies) / energyOf(exact, frequencies));
}

double inBandLevel(const ClickCase& click) {
  const std::vector<double> frequencies = bandFrequencies(click);
  const double exact = energyOf(exactSpectrum(click, frequencies), frequencies);
  const double made =
      energyOf(spectrumOf(renderClick(click), click.sampleRate, frequencies), frequencies);
  return decibels(made / exact);
}

}  // namespace carom::test
