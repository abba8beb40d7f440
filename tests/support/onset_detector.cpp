#include "tests/support/onset_detector.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace carom::test {
namespace {

struct Segment {
  std::size_t begin = 0;
  std::size_t end = 0;
};

double threshold(std::span<const double> samples, const OnsetSettings& settings) {
  std::vector<double> magnitudes(samples.size());
  std::ranges::transform(samples, magnitudes.begin(), [](double s) { return std::abs(s); });
  const double loudest = std::ranges::max(magnitudes);
  const auto middle = magnitudes.begin() + std::ssize(magnitudes) / 2;
  std::ranges::nth_element(magnitudes, middle);
  return std::max(settings.relativeThreshold * loudest, settings.noiseFactor * *middle);
}

/// Returns the runs of samples above the threshold, with no pause of `gap` samples inside.
std::vector<Segment> findSegments(std::span<const double> samples, double level, double gap) {
  std::vector<Segment> segments;
  for (std::size_t sample = 0; sample < samples.size(); ++sample) {
    if (std::abs(samples[sample]) <= level) continue;
    const bool same = !segments.empty() && static_cast<double>(sample - segments.back().end) < gap;
    if (!same) segments.push_back({sample, sample});
    segments.back().end = sample + 1;
  }
  return segments;
}

/// Magnitude of a sample if it has the given sign; 0 otherwise and outside of the samples.
double inLobe(std::span<const double> samples, std::ptrdiff_t sample, double sign) {
  if (sample < 0 || sample >= std::ssize(samples)) return 0.0;
  return std::max(0.0, sign * samples[static_cast<std::size_t>(sample)]);
}

double onsetSample(std::span<const double> samples, const Segment& segment, double peak) {
  const double half = 0.5 * peak;
  auto sample = static_cast<std::ptrdiff_t>(segment.begin);
  while (std::abs(samples[static_cast<std::size_t>(sample)]) < half)
    ++sample;
  const double sign = samples[static_cast<std::size_t>(sample)] > 0.0 ? 1.0 : -1.0;
  const double above = inLobe(samples, sample, sign);
  const double below = inLobe(samples, sample - 1, sign);
  return static_cast<double>(sample) - (above - half) / (above - below);
}

double loudest(std::span<const double> samples) {
  double peak = 0.0;
  for (const double sample : samples)
    peak = std::max(peak, std::abs(sample));
  return peak;
}

}  // namespace

std::vector<Onset> findOnsets(std::span<const double> samples, double sampleRate,
                              const OnsetSettings& settings) {
  if (samples.empty()) return {};
  const double level = threshold(samples, settings);
  std::vector<Onset> onsets;
  for (const Segment& segment : findSegments(samples, level, settings.gap * sampleRate)) {
    const auto click = samples.subspan(segment.begin, segment.end - segment.begin);
    const double peak = loudest(click);
    onsets.push_back({onsetSample(samples, segment, peak) / sampleRate, peak});
  }
  return onsets;
}

}  // namespace carom::test
