#include "lab/fit/subband.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace carom::lab {

namespace {

constexpr double kRateShare = 1.6;     // output rate over the width of the band
constexpr double kKaiser = 9.0;        // about 90 dB
constexpr double kKaiserLength = 5.7;  // samples times transition over rate, for that

double besselI0(double x) {
  double sum = 1.0;
  double term = 1.0;
  for (int order = 1; order < 60 && term > 1e-17 * sum; ++order) {
    term *= (0.5 * x / order) * (0.5 * x / order);
    sum += term;
  }
  return sum;
}

/// Returns a low-pass filter of gain 1 with its corner at `cutoff` (share of the sampling rate).
std::vector<double> lowPass(double cutoff, std::size_t length) {
  std::vector<double> taps(length);
  const double middle = 0.5 * static_cast<double>(length - 1);
  double sum = 0.0;
  for (std::size_t at = 0; at < length; ++at) {
    const double x = static_cast<double>(at) - middle;
    const double share = x / middle;
    const double phase = 2.0 * std::numbers::pi * cutoff * x;
    const double sinc = std::abs(x) < 1e-9 ? 1.0 : std::sin(phase) / phase;
    taps[at] = sinc * besselI0(kKaiser * std::sqrt(std::max(0.0, 1.0 - share * share)));
    sum += taps[at];
  }
  for (double& tap : taps)
    tap /= sum;
  return taps;
}

}  // namespace

Subband::Subband(double centre, double width, double sampleRate)
    : centre_(centre),
      width_(width),
      sampleRate_(sampleRate),
      decimation_(
          static_cast<std::size_t>(std::max(1.0, std::floor(sampleRate / (kRateShare * width))))) {
  rate_ = sampleRate / static_cast<double>(decimation_);
  const double transition = std::max(0.5 * (kRateShare - 1.0) * width, rate_ - width);
  const auto half =
      static_cast<std::size_t>(std::ceil(0.5 * kKaiserLength * sampleRate / transition));
  taps_ = lowPass(0.5 * rate_ / sampleRate, 2 * half + 1);
  double energy = 0.0;
  for (const double tap : taps_)
    energy += tap * tap;
  noiseBandwidth_ = energy * sampleRate;
}

std::vector<std::complex<double>> Subband::of(std::span<const double> samples,
                                              std::size_t most) const {
  std::vector<std::complex<double>> outputs;
  if (samples.size() < taps_.size()) return outputs;
  const std::size_t count = std::min(most, (samples.size() - taps_.size()) / decimation_ + 1);
  const double turn = -2.0 * std::numbers::pi * centre_ / sampleRate_;
  std::vector<std::complex<double>> shifted(taps_.size());
  for (std::size_t at = 0; at < taps_.size(); ++at)
    shifted[at] = std::polar(taps_[at], turn * static_cast<double>(at));
  outputs.reserve(count);
  for (std::size_t output = 0; output < count; ++output) {
    const std::size_t from = output * decimation_;
    double real = 0.0;
    double imaginary = 0.0;
    for (std::size_t at = 0; at < shifted.size(); ++at) {
      real += shifted[at].real() * samples[from + at];
      imaginary += shifted[at].imag() * samples[from + at];
    }
    outputs.push_back(std::complex<double>(real, imaginary) *
                      std::polar(1.0, turn * static_cast<double>(from)));
  }
  return outputs;
}

std::complex<double> Subband::gain(std::complex<double> s) const {
  const std::complex<double> shifted =
      s - std::complex<double>(0.0, 2.0 * std::numbers::pi * centre_);
  const std::complex<double> step = std::exp(shifted / sampleRate_);
  std::complex<double> power = 1.0;
  std::complex<double> sum = 0.0;
  for (const double tap : taps_) {
    sum += tap * power;
    power *= step;
  }
  return sum;
}

}  // namespace carom::lab
