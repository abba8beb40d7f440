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

/// Runs of samples above the threshold with no pause of `gap` samples inside.
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

/// Height of the parabola through a largest sample and its two neighbours.
double parabolaPeak(double before, double top, double after) {
  const double bend = before - 2.0 * top + after;
  if (bend >= 0.0) return top;
  const double tilt = after - before;
  return top - tilt * tilt / (8.0 * bend);
}

/// Magnitude of a sample of the lobe's own sign; 0 outside and of the other sign.
double inLobe(std::span<const double> samples, std::ptrdiff_t sample, double sign) {
  if (sample < 0 || sample >= std::ssize(samples)) return 0.0;
  return std::max(0.0, sign * samples[static_cast<std::size_t>(sample)]);
}

double onsetSample(std::span<const double> samples, const Segment& segment) {
  const double sign = samples[segment.begin] > 0.0 ? 1.0 : -1.0;
  auto sample = static_cast<std::ptrdiff_t>(segment.begin);
  for (std::ptrdiff_t next = sample; inLobe(samples, next, sign) > 0.0; ++next) {
    if (inLobe(samples, next, sign) > inLobe(samples, sample, sign)) sample = next;
  }
  const double extremum =
      parabolaPeak(inLobe(samples, sample - 1, sign), inLobe(samples, sample, sign),
                   inLobe(samples, sample + 1, sign));
  const double half = 0.5 * extremum;
  while (inLobe(samples, sample, sign) >= half)
    --sample;
  const double below = inLobe(samples, sample, sign);
  const double above = inLobe(samples, sample + 1, sign);
  return static_cast<double>(sample) + (half - below) / (above - below);
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
    onsets.push_back({onsetSample(samples, segment) / sampleRate, loudest(click)});
  }
  return onsets;
}

}  // namespace carom::test
