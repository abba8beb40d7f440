#include "audio/synthesis/modal_excitation.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <Eigen/QR>

#include "audio/dsp/resonator_kernels.h"
#include "audio/dsp/spread_kernel.h"
#include "carom/audio/synth_settings.h"

namespace carom::audio {
namespace {

using Complex = std::complex<double>;

std::size_t modesInBand(const ModalModel& model, double sampleRate) {
  const auto end = std::ranges::upper_bound(model.modes, kBand * sampleRate, {}, &Mode::frequency);
  return static_cast<std::size_t>(end - model.modes.begin());
}

/// Fits ResonatorSet::rest by least squares over the band, as it is heard: weighted by the spectrum
/// of the spread pulse. All times are in samples.
class RestFit {
 public:
  explicit RestFit(Sampling sampling) {
    Eigen::MatrixXd waves(2 * kFrequencies, kTaps);
    for (Eigen::Index row = 0; row < kFrequencies; ++row) {
      const double w = omega(row);
      const bool spread = sampling == Sampling::bandLimited;
      dimming_[row] = spread ? spreadTransform(w / (2.0 * std::numbers::pi)) : 1.0;
      weight_[row] = row == 0 ? kStill : dimming_[row];
      for (Eigen::Index tap = 0; tap < kTaps; ++tap) {
        const double angle = w * static_cast<double>(tap - kMiddle);
        waves(row, tap) = weight_[row] * std::cos(angle);
        waves(kFrequencies + row, tap) = -weight_[row] * std::sin(angle);
      }
    }
    inverse_ = waves.completeOrthogonalDecomposition().pseudoInverse();
  }

  struct Residual {
    double frequency = 0.0;  // rad per sample
    double beta = 0.0;       // samples: Material::dampingBeta
    double delay = 0.0;  // samples, in which sound passes the radius of the sphere that breathes
  };
  /// Taps for the second derivative of the pulse, as an oscillator follows it, and a sphere of
  /// radius a radiates it: exp(s a / c) / (1 + s a / c) from its middle on, as the sound leaves its
  /// surface.
  RestTaps<double> of(const Residual& modes) const {
    // Within the band, many modes stand for one, and blur it; from well beyond, none is in phase
    // with anything but the force.
    const double beyond = modes.frequency / (2.0 * std::numbers::pi * kBand) - 1.0;
    const double damping = kResidualDamping * std::clamp(1.0 - beyond / kFarBeyond, 0.0, 1.0);
    Eigen::VectorXd wanted(2 * kFrequencies);
    for (Eigen::Index row = 0; row < kFrequencies; ++row) {
      const Complex s(0.0, omega(row));
      const Complex share = s / modes.frequency;
      const Complex yields = share * share + 2.0 * damping * share + modes.beta * s + 1.0;
      const Complex radiates =
          std::exp(s * std::min(modes.delay, kMostAhead)) / (1.0 + modes.delay * s);
      const Complex follows = s * s / yields * radiates;
      const Complex tap = weight_[row] * follows / dimming_[row];
      wanted[row] = tap.real();
      wanted[kFrequencies + row] = tap.imag();
    }
    const Eigen::VectorXd taps = inverse_ * wanted;
    RestTaps<double> residual;
    std::ranges::copy(taps, residual.begin());
    return residual;
  }

  RestTaps<Complex> of(Complex pole, Complex dimming) const {
    // A pole on the imaginary axis is moved aside: the limit is finite, the terms are not.
    pole -= kAside;
    const Eigen::VectorXd real = tapsOf(pole, dimming, 1.0);
    const Eigen::VectorXd imaginary = tapsOf(pole, dimming, Complex(0.0, 1.0));
    RestTaps<Complex> rest;
    for (std::size_t tap = 0; tap < rest.size(); ++tap) {
      const auto row = static_cast<Eigen::Index>(tap);
      rest[tap] = {real[row], -imaginary[row]};
    }
    return rest;
  }

 private:
  static constexpr Eigen::Index kFrequencies = 96;
  static constexpr Eigen::Index kMiddle = kRestReach;
  static constexpr Eigen::Index kTaps = 2 * kMiddle + 1;
  static constexpr double kStill = 1000.0;  // weight of 0 Hz, where no error is to be left
  static constexpr double kAside = 1e-7;
  static constexpr double kResidualDamping = 0.7;  // of critical, within the band
  static constexpr double kFarBeyond = 0.3;        // of the band, from where there is none
  static constexpr double kMostAhead = 10.0;       // samples for which the taps have room

  static double omega(Eigen::Index row) {
    return 2.0 * std::numbers::pi * kBand * static_cast<double>(row) / (kFrequencies - 1);
  }

  Eigen::VectorXd tapsOf(Complex pole, Complex dimming, Complex amplitude) const {
    const Complex ours = amplitude / dimming;
    const double still = (amplitude / pole).real();
    Eigen::VectorXd wanted(2 * kFrequencies);
    for (Eigen::Index row = 0; row < kFrequencies; ++row) {
      const Complex s(0.0, omega(row));
      const Complex mode =
          0.5 * (amplitude / (s - pole) + std::conj(amplitude) / (s - std::conj(pole))) + still;
      const Complex resonator = 0.5 * (ours / (1.0 - std::exp(pole - s)) +
                                       std::conj(ours) / (1.0 - std::exp(std::conj(pole) - s)));
      const Complex rest = weight_[row] * (mode / dimming_[row] - resonator);
      wanted[row] = rest.real();
      wanted[kFrequencies + row] = rest.imag();
    }
    return inverse_ * wanted;
  }

  Eigen::VectorXd dimming_ = Eigen::VectorXd::Zero(kFrequencies);
  Eigen::VectorXd weight_ = dimming_;
  Eigen::MatrixXd inverse_;
};

const RestFit& restFit(Sampling sampling) {
  static const RestFit spread(Sampling::bandLimited);
  static const RestFit naive(Sampling::naive);
  return sampling == Sampling::bandLimited ? spread : naive;
}

}  // namespace

ResonatorSet::ResonatorSet(std::shared_ptr<const ModalModel> ofModel, const SynthSettings& settings)
    : model(std::move(ofModel)),
      modes(modesInBand(*model, settings.sampleRate)),
      padded(ResonatorKernels::padded(modes)),
      a1(padded),
      a2(padded),
      pole(modes),
      radiated(modes),
      dimming(modes, 1.0),
      rest(modes) {
  const RestFit& fit = restFit(settings.comparison.sampling);
  const double thinner = settings.medium.density / model->medium.density;
  for (std::size_t mode = 0; mode < modes; ++mode) {
    const double omega = 2.0 * std::numbers::pi * model->modes[mode].frequency;
    const double sampleRate = settings.sampleRate;
    const double inModelsMedium = model->modes[mode].radiation.decayRate;
    // In a dense medium a mode would lose more than all that it has: it is damped as far as counts.
    const double own = model->modes[mode].decayRate;
    const double wanted = own + (thinner - 1.0) * inModelsMedium;
    const double decay = std::min(wanted, std::max(own, kMostDamping * omega));
    radiated[mode] = std::clamp(thinner * inModelsMedium - (wanted - decay), 0.0, decay);
    pole[mode] = {-decay, std::sqrt((omega - decay) * (omega + decay))};
    const TwoPole two = TwoPole::of(pole[mode].imag(), decay, sampleRate);
    a1[mode] = two.a1;
    a2[mode] = two.a2;
    if (settings.comparison.sampling == Sampling::bandLimited)
      dimming[mode] = spreadTransform(pole[mode] / sampleRate);
    rest[mode] = fit.of(pole[mode] / sampleRate, dimming[mode]);
  }
  if (model->residualVolumes.empty() || settings.modalRadiation == ModalRadiation::constant) return;
  const double rate = settings.sampleRate;
  const double radius = settings.modalRadiation == ModalRadiation::directional
                            ? std::sqrt(surfaceArea(model->surface) / (4.0 * std::numbers::pi))
                            : 0.0;
  residual = fit.of({.frequency = 2.0 * std::numbers::pi * model->residualFrequency / rate,
                     .beta = model->material.dampingBeta * rate,
                     .delay = radius / settings.medium.speedOfSound * rate});
  for (double& tap : residual)
    tap *= rate * rate * rate;  // of a force in N, which is the impulse's samples times the rate
}

}  // namespace carom::audio
