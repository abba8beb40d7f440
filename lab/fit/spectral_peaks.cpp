#include "lab/fit/spectral_peaks.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>

#include "lab/fit/level_statistics.h"
#include "lab/fit/subband.h"
#include <unsupported/Eigen/FFT>

namespace carom::lab {

namespace {

constexpr double kLongWindow = 0.5;      // s
constexpr double kShortWindow = 0.06;    // s
constexpr double kOverNoise = 10.0;      // dB
constexpr double kOverMedian = 12.0;     // dB, above the spectrum around
constexpr int kNeighbours = 3;           // bins that a peak exceeds on each side
constexpr double kAround = 0.06;         // share of the frequency, for the median
constexpr double kSlopeOverNoise = 8.0;  // of power: levels nearer to the noise do not count

bool isLocalMaximum(const std::vector<double>& power, std::size_t at) {
  for (std::size_t step = 1; step <= kNeighbours; ++step) {
    if (power[at - step] >= power[at] || power[at + step] > power[at]) return false;
  }
  return true;
}

/// Returns the place of the maximum of a parabola through three levels, in bins from the middle.
double parabolaTop(double before, double at, double after) {
  const double bend = before - 2.0 * at + after;
  return bend < 0.0 ? std::clamp(0.5 * (before - after) / bend, -0.5, 0.5) : 0.0;
}

/// Slope of a straight line through equally spaced levels.
double slopeOf(std::span<const double> levels) {
  const auto count = static_cast<double>(levels.size());
  double product = 0.0;
  double square = 0.0;
  for (std::size_t at = 0; at < levels.size(); ++at) {
    const double x = static_cast<double>(at) - 0.5 * (count - 1.0);
    product += x * levels[at];
    square += x * x;
  }
  return product / square;
}

double meanPower(const std::vector<std::complex<double>>& outputs) {
  double sum = 0.0;
  for (const std::complex<double>& output : outputs)
    sum += std::norm(output);
  return outputs.empty() ? 0.0 : sum / static_cast<double>(outputs.size());
}

/// Returns the decay rate of the band around a peak, or 0.
double decayOf(const TapSegment& tap, double frequency, double width) {
  const Subband band(frequency, width, tap.sampleRate);
  const std::vector<std::complex<double>> outputs =
      band.of(tap.free(), static_cast<std::size_t>(2.0 * band.rate()) + 8);
  if (outputs.size() < 6) return 0.0;
  double noise = meanPower(band.of(tap.before, 400));
  if (noise == 0.0) {
    const std::size_t tail = std::max<std::size_t>(3, outputs.size() / 8);
    noise = meanPower({outputs.end() - static_cast<std::ptrdiff_t>(tail), outputs.end()});
  }
  std::vector<double> levels;
  for (const std::complex<double>& output : outputs) {
    if (std::norm(output) < kSlopeOverNoise * noise) break;
    levels.push_back(0.5 * std::log(std::norm(output) - noise));
  }
  if (levels.size() < 4) return 0.0;
  return std::max(0.0, -slopeOf(levels) * band.rate());
}

void addPeaks(const TapSegment& tap, double window, double lowest, double highest,
              std::vector<SpectralPeak>& peaks) {
  const auto size = static_cast<std::size_t>(window * tap.sampleRate);
  const PowerSpectrum ring = ringSpectrum(tap.free(), size, tap.sampleRate);
  PowerSpectrum noise;
  if (tap.before.size() >= size)
    noise = ringSpectrum(std::span(tap.before).last(size), size, tap.sampleRate);
  const double step = ring.step;
  for (std::size_t at = static_cast<std::size_t>(lowest / step) + kNeighbours + 1;
       at + kNeighbours + 1 < ring.power.size() && static_cast<double>(at) * step < highest; ++at) {
    if (!isLocalMaximum(ring.power, at)) continue;
    const auto reach = static_cast<std::size_t>(std::max(20.0, kAround * static_cast<double>(at)));
    const std::size_t from = at > reach ? at - reach : 0;
    const std::size_t to = std::min(ring.power.size(), at + reach);
    const double around = medianOf(ring.power, from, to);
    const double background =
        noise.power.size() == ring.power.size() ? medianOf(noise.power, from, to) : around;
    SpectralPeak peak{0.0, 0.0, ring.power[at], decibels(ring.power[at] / around),
                      decibels(ring.power[at] / background)};
    if (peak.overAround < kOverMedian || peak.overNoise < kOverNoise) continue;
    peak.frequency = step * (static_cast<double>(at) + parabolaTop(decibels(ring.power[at - 1]),
                                                                   decibels(ring.power[at]),
                                                                   decibels(ring.power[at + 1])));
    const bool isKnown = std::ranges::any_of(peaks, [&](const SpectralPeak& known) {
      return std::abs(known.frequency - peak.frequency) < 1.5 / window;
    });
    if (isKnown) continue;
    peak.decayRate = decayOf(tap, peak.frequency, 6.0 / window);
    if (peak.decayRate == 0.0) peak.decayRate = decayOf(tap, peak.frequency, 30.0 / window);
    peaks.push_back(peak);
  }
}

}  // namespace

PowerSpectrum ringSpectrum(std::span<const double> samples, std::size_t window, double sampleRate) {
  const std::size_t size = std::min(window, samples.size());
  std::vector<double> padded(2 * std::bit_ceil(std::max<std::size_t>(size, 2)), 0.0);
  double energy = 0.0;
  for (std::size_t at = 0; at < size; ++at) {
    const double share = static_cast<double>(at) / static_cast<double>(size);
    const double weight = 0.5 + 0.5 * std::cos(std::numbers::pi * share);
    padded[at] = weight * samples[at];
    energy += weight * weight;
  }
  Eigen::FFT<double> transform;
  std::vector<std::complex<double>> bins;
  transform.fwd(bins, padded);
  PowerSpectrum spectrum;
  spectrum.step = sampleRate / static_cast<double>(padded.size());
  for (std::size_t at = 0; at <= padded.size() / 2; ++at)
    spectrum.power.push_back(2.0 * std::norm(bins[at]) / (energy * sampleRate));
  return spectrum;
}

std::vector<SpectralPeak> spectralPeaks(const TapSegment& tap, double lowest, double highest) {
  std::vector<SpectralPeak> peaks;
  addPeaks(tap, kLongWindow, lowest, highest, peaks);
  addPeaks(tap, kShortWindow, std::max(lowest, 4.0 / kShortWindow), highest, peaks);
  std::ranges::sort(peaks, {}, &SpectralPeak::frequency);
  return peaks;
}

}  // namespace carom::lab
