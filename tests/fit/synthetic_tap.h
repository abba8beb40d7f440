#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <random>
#include <vector>

namespace carom::test {

/// A damped oscillation, amplitude exp(-decay t) cos(2 pi frequency t + phase).
struct TapPartial {
  double frequency = 0.0;  ///< Hz
  double decay = 0.0;      ///< 1/s
  double amplitude = 1.0;
  double phase = 0.3;
};

/// A recording of a sum of partials that begins at `onset`.
struct SyntheticTap {
  double sampleRate = 48000.0;
  double seconds = 2.0;
  double onset = 0.5;   ///< s
  double noise = 0.0;   ///< rms of white Gaussian noise
  double hum = 0.0;     ///< amplitude of 50 Hz, with harmonics
  double clip = 1e300;  ///< limit of the samples
  std::uint32_t seed = 1;
};

inline std::vector<double> synthesised(const std::vector<TapPartial>& partials,
                                       const SyntheticTap& tap) {
  std::vector<double> samples(static_cast<std::size_t>(tap.seconds * tap.sampleRate));
  std::mt19937 random(tap.seed);
  std::normal_distribution<double> normal;
  const double turn = 2.0 * std::numbers::pi;
  for (std::size_t at = 0; at < samples.size(); ++at) {
    const double time = static_cast<double>(at) / tap.sampleRate;
    double sum = tap.noise * normal(random);
    for (int harmonic = 1; harmonic <= 7; ++harmonic)
      sum += tap.hum / harmonic * std::sin(turn * 50.0 * harmonic * time + harmonic);
    const double since = time - tap.onset;
    for (const TapPartial& partial : partials) {
      if (since >= 0.0)
        sum += partial.amplitude * std::exp(-partial.decay * since) *
               std::cos(turn * partial.frequency * since + partial.phase);
    }
    samples[at] = std::clamp(sum, -tap.clip, tap.clip);
  }
  return samples;
}

}  // namespace carom::test
