#include "audio/propagation/air_filter.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <complex>
#include <numbers>

#include <Eigen/Core>
#include <unsupported/Eigen/FFT>

#include "carom/audio/absorption.h"

namespace carom::audio {
namespace {

constexpr double kSeconds = 256.0 / 48000.0;  // of the longest response
constexpr std::size_t kFewestTaps = 64;       // of the longest response
constexpr double kHeldBack = 0.8;             // share of half the rate
constexpr double kTop = 16000.0;              // Hz
constexpr double kHighestShare = 0.45;        // of the sample rate: top of a narrower band
constexpr double kInaudible = 0.5;            // dB
constexpr double kMostDelay = 0.3;            // share of the longest response
constexpr double kMostAtOnce = 600.0;         // nepers, which a double holds
constexpr double kDecayed = 1e-3;             // share of the peak
constexpr int kQuietTaps = 8;                 // in a row that end a response
constexpr double kCodesPerOctave = 2730.0;    // of a metre more than the distance

/// Frequency (Hz) whose attenuation is that of `frequency` in the response: the same up to
/// kHeldBack, and level with half the rate.
double heldBack(double frequency, double half) {
  const double edge = kHeldBack * half;
  if (frequency <= edge) return frequency;
  const double x = (frequency - edge) / (half - edge);
  return edge + (half - edge) * (x - x * x * x / 3.0);
}

/// Returns the coefficients, 0 to count - 1, of the cosine series of values at even steps from 0
/// to half the rate.
std::vector<double> cosineSeries(const std::vector<double>& values, std::size_t count) {
  const std::size_t steps = values.size() - 1;
  std::vector<double> wholeCircle = values;
  wholeCircle.insert(wholeCircle.end(), values.rbegin() + 1, values.rend() - 1);
  Eigen::FFT<double> transform;
  std::vector<std::complex<double>> spectrum;
  transform.fwd(spectrum, wholeCircle);
  std::vector<double> series(count);
  for (std::size_t n = 0; n < count; ++n)
    series[n] = (n == 0 ? 0.5 : 1.0) * spectrum[n].real() / static_cast<double>(steps);
  return series;
}

}  // namespace

AirFilter::AirFilter(const Medium& medium, double sampleRate) : sampleRate_(sampleRate) {
  assert(sampleRate >= 8000.0 && sampleRate <= 192000.0);
  const auto most = std::max(kFewestTaps, static_cast<std::size_t>(kSeconds * sampleRate));
  const double half = 0.5 * sampleRate;
  std::vector<double> logarithms(2 * most + 1);
  for (std::size_t step = 0; step < logarithms.size(); ++step) {
    const double share = static_cast<double>(step) / static_cast<double>(logarithms.size() - 1);
    logarithms[step] = -0.5 * airAttenuation(medium, heldBack(share * half, half));
  }
  cepstrum_ = cosineSeries(logarithms, most);
  level_ = cepstrum_[0];
  for (std::size_t n = 0; n < most; ++n) {
    cepstrum_[n] *= static_cast<double>(n);
    slowness_ += cepstrum_[n];
  }
  const double top = std::min(kTop, kHighestShare * sampleRate);
  const double decibels = 10.0 / std::numbers::ln10 * airAttenuation(medium, top);  // 1/m
  nearest_ = kInaudible / decibels;
  farthest_ = std::min(kMostDelay * static_cast<double>(most) / slowness_, kMostAtOnce / -level_);
}

double AirFilter::heardDistance(double distance) const {
  if (!(distance > nearest_)) return 0.0;
  return std::min(std::min(2.0 * (distance - nearest_), distance), farthest_);
}

std::uint16_t AirFilter::codeOf(double distance) const {
  return static_cast<std::uint16_t>(
      std::min(65535.0, std::round(kCodesPerOctave * std::log2(1.0 + heardDistance(distance)))));
}

double AirFilter::heardDistanceOf(std::uint16_t code) {
  return std::exp2(static_cast<double>(code) / kCodesPerOctave) - 1.0;
}

std::span<const double> AirFilter::taps(double heardDistance, std::span<double> to) const noexcept {
  assert(to.size() >= mostTaps());
  // The taps are laid down backwards, so that each is a product of two rows of numbers.
  const std::size_t most = mostTaps();
  using Row = Eigen::Map<const Eigen::VectorXd>;
  double* const last = to.data() + most - 1;
  *last = std::exp(heardDistance * level_);
  double peak = *last;
  std::size_t count = 1;
  for (int quiet = 0; count < most && quiet < kQuietTaps; ++count) {
    const auto size = static_cast<Eigen::Index>(count);
    const double tap = heardDistance / static_cast<double>(count) *
                       Row(cepstrum_.data() + 1, size).dot(Row(last - count + 1, size));
    last[-static_cast<std::ptrdiff_t>(count)] = tap;
    peak = std::max(peak, std::abs(tap));
    quiet = std::abs(tap) < kDecayed * peak ? quiet + 1 : 0;
  }
  std::reverse(last - count + 1, last + 1);
  return to.subspan(most - count, count);
}

double AirFilter::tapsAbout(double heardDistance) const {
  return std::min(16.0 + 6.0 * heardDistance * slowness_, static_cast<double>(mostTaps()));
}

}  // namespace carom::audio
