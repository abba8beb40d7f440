#include "lab/report/signal_error.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <numbers>

#include <unsupported/Eigen/FFT>

namespace carom::lab {

namespace {

constexpr double kLowestBand = 50.0;   // Hz
constexpr double kTopShare = 0.4;      // share of the sample rate
constexpr double kQuietBand = 1e-6;    // share of the loudest band's energy: -60 dB
constexpr double kGreatest = 60.0;     // dB
constexpr double kReference = 1000.0;  // Hz

double at(const Signal& signal, std::size_t channel, std::size_t frame) {
  if (channel >= signal.size() || frame >= signal[channel].size()) return 0.0;
  return static_cast<double>(signal[channel][frame]);
}

double middleOf(int band) {
  return kReference * std::pow(10.0, 0.1 * band);
}

using Spectrum = std::vector<std::complex<double>>;

// Returns the spectrum of a channel padded by at least as
// many zeros, so that shifts do not wrap around.
Spectrum paddedSpectrum(const Signal& signal, std::size_t channel, std::size_t frames) {
  std::vector<double> padded(std::bit_ceil(std::max<std::size_t>(2 * frames, 4)), 0.0);
  for (std::size_t frame = 0; frame < frames; ++frame)
    padded[frame] = at(signal, channel, frame);
  Spectrum bins;
  Eigen::FFT<double>().fwd(bins, padded);
  return bins;
}

double energyOf(const Signal& signal, std::size_t channels, std::size_t frames) {
  double sum = 0.0;
  for (std::size_t channel = 0; channel < channels; ++channel)
    for (std::size_t frame = 0; frame < frames; ++frame)
      sum += at(signal, channel, frame) * at(signal, channel, frame);
  return sum;
}

// The cross-correlation of two signals: the sum over time of reference(t) signal(t + delay), over
// all channels.
class Correlation {
 public:
  Correlation(const Signal& signal, const Signal& reference, std::size_t frames) {
    for (std::size_t channel = 0; channel < reference.size(); ++channel) {
      const Spectrum mine = paddedSpectrum(signal, channel, frames);
      const Spectrum exact = paddedSpectrum(reference, channel, frames);
      cross_.resize(mine.size());
      for (std::size_t bin = 0; bin < mine.size(); ++bin)
        cross_[bin] += mine[bin] * std::conj(exact[bin]);
    }
  }

  // Returns its values at whole samples: index i is a delay
  // of i, or of i - size if that is negative.
  std::vector<double> atSamples() const {
    std::vector<double> values;
    Eigen::FFT<double>().inv(values, cross_);
    return values;
  }

  double at(double delay) const {
    const auto size = static_cast<double>(cross_.size());
    const std::complex<double> turn = std::polar(1.0, 2.0 * std::numbers::pi * delay / size);
    std::complex<double> phase = turn;
    double sum = cross_[0].real();
    const std::size_t half = cross_.size() / 2;
    for (std::size_t bin = 1; bin < half; ++bin) {
      sum += 2.0 * (cross_[bin] * phase).real();
      // The repeated product drifts by rounding only: by 1e-10 after a million factors.
      phase *= turn;
    }
    return sum / size;
  }

 private:
  Spectrum cross_;
};

// Returns where a function with a single maximum between two points has it, by golden section.
template <class Function>
double maximumOf(const Function& function, double low, double high) {
  const double golden = 0.5 * (std::sqrt(5.0) - 1.0);
  double left = high - golden * (high - low);
  double right = low + golden * (high - low);
  double atLeft = function(left);
  double atRight = function(right);
  while (high - low > 1e-5) {
    if (atLeft > atRight) {
      high = right;
      right = left;
      atRight = atLeft;
      left = high - golden * (high - low);
      atLeft = function(left);
    } else {
      low = left;
      left = right;
      atLeft = atRight;
      right = low + golden * (high - low);
      atRight = function(right);
    }
  }
  return 0.5 * (low + high);
}

// Returns the energy in each bin of the transform, Pa^2 s, from 0 Hz on.
std::vector<double> spectrumOf(const std::vector<float>& channel, double sampleRate) {
  std::vector<double> padded(std::bit_ceil(std::max<std::size_t>(channel.size(), 2)), 0.0);
  std::copy(channel.begin(), channel.end(), padded.begin());
  std::vector<std::complex<double>> bins;
  Eigen::FFT<double>().fwd(bins, padded);
  // Parseval's theorem: both halves of the spectrum, and the duration of a sample.
  const double scale = 2.0 / (sampleRate * static_cast<double>(padded.size()));
  std::vector<double> energy(padded.size() / 2);
  for (std::size_t bin = 0; bin < energy.size(); ++bin)
    energy[bin] = scale * std::norm(bins[bin]);
  return energy;
}

}  // namespace

double waveformError(const Signal& signal, const Signal& reference, std::size_t frames) {
  double off = 0.0;
  double all = 0.0;
  for (std::size_t channel = 0; channel < reference.size(); ++channel) {
    for (std::size_t frame = 0; frame < frames; ++frame) {
      const double exact = at(reference, channel, frame);
      const double difference = at(signal, channel, frame) - exact;
      off += difference * difference;
      all += exact * exact;
    }
  }
  return all > 0.0 ? std::sqrt(off / all) : std::nan("");
}

AlignedError alignedError(const Signal& signal, const Signal& reference, std::size_t frames,
                          double sampleRate) {
  const double exact = energyOf(reference, reference.size(), frames);
  const double mine = energyOf(signal, reference.size(), frames);
  if (!(exact > 0.0)) return {std::nan(""), 0.0};
  if (!(mine > 0.0)) return {1.0, 0.0};
  const Correlation correlation(signal, reference, frames);
  const std::vector<double> coarse = correlation.atSamples();
  const auto most = static_cast<std::ptrdiff_t>(kLongestDelay * sampleRate);
  const auto size = static_cast<std::ptrdiff_t>(coarse.size());
  std::ptrdiff_t best = 0;
  const auto value = [&](std::ptrdiff_t delay) {
    return coarse[static_cast<std::size_t>((delay + size) % size)];
  };
  for (std::ptrdiff_t delay = -std::min(most, size / 2 - 1); delay <= std::min(most, size / 2 - 1);
       ++delay) {
    if (value(delay) > value(best)) best = delay;
  }
  const auto middle = static_cast<double>(best);
  const double delay =
      maximumOf([&](double at) { return correlation.at(at); }, middle - 1.0, middle + 1.0);
  const double off = exact + mine - 2.0 * correlation.at(delay);
  return {std::sqrt(std::max(off, 0.0) / exact), delay / sampleRate};
}

std::vector<ThirdOctave> thirdOctaves(const Signal& signal, double sampleRate) {
  std::vector<ThirdOctave> bands;
  const double halfBand = std::pow(10.0, 0.05);
  const int first = static_cast<int>(std::lround(10.0 * std::log10(kLowestBand / kReference)));
  for (int band = first; middleOf(band) * halfBand <= kTopShare * sampleRate; ++band)
    bands.push_back({middleOf(band), 0.0});
  for (const std::vector<float>& channel : signal) {
    const std::vector<double> spectrum = spectrumOf(channel, sampleRate);
    const double bin = 0.5 * sampleRate / static_cast<double>(spectrum.size());  // Hz
    for (ThirdOctave& band : bands) {
      const auto from = static_cast<std::size_t>(std::ceil(band.frequency / halfBand / bin));
      const auto to = static_cast<std::size_t>(std::ceil(band.frequency * halfBand / bin));
      for (std::size_t i = from; i < std::min(to, spectrum.size()); ++i)
        band.energy += spectrum[i];
    }
  }
  return bands;
}

std::vector<BandDifference> bandDifferences(std::span<const ThirdOctave> signal,
                                            std::span<const ThirdOctave> reference) {
  std::vector<BandDifference> differences;
  double loudest = 0.0;
  for (const ThirdOctave& band : reference)
    loudest = std::max(loudest, band.energy);
  for (std::size_t i = 0; i < std::min(signal.size(), reference.size()); ++i) {
    if (!(reference[i].energy > kQuietBand * loudest)) continue;
    const double difference = 10.0 * std::log10(signal[i].energy / reference[i].energy);
    differences.push_back({reference[i].frequency, std::clamp(difference, -kGreatest, kGreatest)});
  }
  return differences;
}

double rmsOf(std::span<const BandDifference> differences) {
  double sum = 0.0;
  for (const BandDifference& band : differences)
    sum += band.difference * band.difference;
  return differences.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(differences.size()));
}

}  // namespace carom::lab
