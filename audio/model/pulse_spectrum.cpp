#include "audio/model/pulse_spectrum.h"

#include <algorithm>
#include <cmath>

namespace carom::audio {

std::complex<double> transformOf(std::span<const PulseNode> nodes, double w) {
  std::complex<double> sum = 0.0;
  for (const PulseNode& node : nodes)
    sum += node.weight * std::polar(1.0, w * node.u);
  return sum;
}

PulseSpectrum::PulseSpectrum(const Pulse& pulse) : impulse_(std::abs(pulse.impulse())) {
  const std::span<const PulseNode> nodes = pulse.rule(Pulse::ruleCounts().back());
  const double ratio = std::log(kHighest / kLowest) / static_cast<double>(kSteps);
  for (std::size_t step = 0; step < kSteps; ++step) {
    const double w = kLowest * std::exp(ratio * static_cast<double>(step));
    steps_[step] = std::abs(transformOf(nodes, w));
  }
  // Spectra have zeros; a bound has none.
  for (std::size_t step = kSteps - 1; step-- > 0;)
    steps_[step] = std::max(steps_[step], steps_[step + 1]);
}

double PulseSpectrum::bound(double w) const {
  if (!(w > kLowest)) return impulse_;
  const double place =
      std::log(w / kLowest) / std::log(kHighest / kLowest) * static_cast<double>(kSteps);
  return steps_[std::min(static_cast<std::size_t>(place), kSteps - 1)];
}

}  // namespace carom::audio
