#include "audio/propagation/reverb.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>

#include "audio/dsp/decay_filter.h"

namespace carom::audio {
namespace {

constexpr double kSmallest = 1e-30;        // Pa: smaller values become 0
constexpr double kLargest = 1e100;         // Pa, bound of the input
constexpr std::uint32_t kFlushEvery = 16;  // samples
constexpr double kShortLine = 0.55;        // times the mean free time, as the next two
constexpr double kLongLine = 1.7;
constexpr double kLongestLine = 8.0;
constexpr double kModalDensity = 0.15;       // total length over the longest T60 (Schroeder 1962)
constexpr std::uint32_t kShortestLine = 17;  // samples

/// Signs with which the input enters the lines: a pattern that no row of the matrix shares.
constexpr std::array<double, Reverb::kLines> kInput = {1, 1,  1, -1, 1,  -1, -1, 1,
                                                       1, -1, 1, 1,  -1, 1,  -1, -1};

bool isPrime(std::uint32_t number) {
  for (std::uint32_t divisor = 2; divisor * divisor <= number; ++divisor) {
    if (number % divisor == 0) return false;
  }
  return number >= 2;
}

std::uint32_t primeFrom(std::uint32_t number) {
  while (!isPrime(number))
    ++number;
  return number;
}

/// H x / 4 in place, H the Hadamard matrix of order 16 (Sylvester's), by the fast transform.
void mix(std::array<double, Reverb::kLines>& values) noexcept {
  for (std::size_t half = 1; half < Reverb::kLines; half *= 2) {
    for (std::size_t block = 0; block < Reverb::kLines; block += 2 * half) {
      for (std::size_t line = block; line < block + half; ++line) {
        const double sum = values[line] + values[line + half];
        values[line + half] = values[line] - values[line + half];
        values[line] = sum;
      }
    }
  }
  for (double& value : values)
    value *= 0.25;
}

double flushed(double value) noexcept {
  return std::abs(value) < kSmallest ? 0.0 : value;
}

double usable(double sample) noexcept {
  return std::isfinite(sample) ? flushed(std::clamp(sample, -kLargest, kLargest)) : 0.0;
}

Error outOfRange(const std::string& name, double value, const std::string& accepted) {
  return Error{"reverberation: " + name + " is " + std::to_string(value) + ", must be " + accepted};
}

bool isBetween(double value, double low, double high) {
  return value >= low && value <= high;
}

Status checkDecayTimes(const ReverbSettings& settings) {
  const DecayTimes& times = settings.decayTimes;
  const double top = settings.decayTimeAt16kHz;
  if (top != 0.0 && !(top >= kShortestDecay && std::isinf(top) == std::isinf(times[0])))
    return outOfRange("decayTimeAt16kHz", top, "0 or at least 0.05 s, infinite as decayTimes are");
  for (std::size_t band = 0; band < kBandCount; ++band) {
    if (!(times[band] >= kShortestDecay)) {
      return outOfRange("decayTimes[" + std::to_string(band) + "]", times[band], "at least 0.05 s");
    }
    if (std::isinf(times[band]) != std::isinf(times[0])) {
      return Error{"reverberation: decayTimes must be all finite or all infinite"};
    }
  }
  return std::monostate{};
}

double longestFinite(const DecayTimes& times) {
  double longest = 0.0;
  for (const double time : times) {
    if (std::isfinite(time)) longest = std::max(longest, time);
  }
  return longest;
}

/// Returns the decay, with as many sections as `longest` samples of delay need.
TopDecay decayOf(const ReverbSettings& settings, double longest, double sampleRate) {
  TopDecay decay{.times = settings.decayTimes, .timeAt16kHz = settings.decayTimeAt16kHz};
  if (decay.timeAt16kHz != 0.0) decay.topSections = topSectionsFor(longest, decay, sampleRate);
  return decay;
}

/// Returns the sum of kLines numbers from `first` to `last`, evenly spaced in the logarithm.
double sumOfSpaced(double first, double last) {
  double sum = 0.0;
  for (std::size_t line = 0; line < Reverb::kLines; ++line) {
    sum += first * std::pow(last / first, static_cast<double>(line) / (Reverb::kLines - 1));
  }
  return sum;
}

/// Returns the longest line, over the mean, that the modal density asks for.
double stretchFor(double meanLength, double totalNeeded) {
  double stretch = kLongLine;
  while (stretch < kLongestLine && sumOfSpaced(kShortLine, stretch) * meanLength < totalNeeded) {
    stretch *= 1.05;
  }
  return std::min(stretch, kLongestLine);
}

}  // namespace

Status checkSettings(const ReverbSettings& settings) {
  if (!isBetween(settings.volume, 0.1, 1e6)) {
    return outOfRange("volume", settings.volume, "0.1 to 1e6 m^3");
  }
  const double sphere = std::cbrt(36.0 * std::numbers::pi * settings.volume * settings.volume);
  if (!isBetween(settings.surface, 0.999 * sphere, 100.0 * sphere)) {
    return outOfRange("surface", settings.surface,
                      "1 to 100 times the surface of the sphere of that volume, " +
                          std::to_string(sphere) + " m^2");
  }
  if (!isBetween(settings.onset, 0.0, 1.0)) return outOfRange("onset", settings.onset, "0 to 1 s");
  if (!isBetween(settings.gain, 0.0, 1e6)) return outOfRange("gain", settings.gain, "0 to 1e6");
  if (!isBetween(settings.speedOfSound, 100.0, 2000.0)) {
    return outOfRange("speedOfSound", settings.speedOfSound, "100 to 2000 m/s");
  }
  if (!isBetween(settings.silence, 1e-15, 1.0)) {
    return outOfRange("silence", settings.silence, "1e-15 to 1 Pa");
  }
  return checkDecayTimes(settings);
}

Result<Reverb> Reverb::create(const ReverbSettings& settings, double sampleRate,
                              std::size_t channels) {
  if (Status checked = checkSettings(settings); !checked) return checked.error();
  if (!isBetween(sampleRate, 8000.0, 192000.0)) {
    return outOfRange("the sample rate", sampleRate, "8000 to 192000 Hz");
  }
  if (channels < 1 || channels > kMaxChannels) {
    return Error{"reverberation: " + std::to_string(channels) + " channels, must be 1 to " +
                 std::to_string(kMaxChannels)};
  }
  return Reverb(settings, sampleRate, channels);
}

Reverb::Reverb(const ReverbSettings& settings, double sampleRate, std::size_t channels)
    : sampleRate_(sampleRate), channels_(channels) {
  patternGains_.fill(1.0);
  const double meanTime =
      4.0 * settings.volume / (settings.surface * settings.speedOfSound);  // s, between walls
  makeLines(meanTime * sampleRate, longestFinite(settings.decayTimes) * sampleRate);
  makeFilters(settings);
  makeOnset(settings);
  const double total = static_cast<double>(buffer_.size());
  const double density = 4.0 * std::numbers::pi * settings.speedOfSound / settings.volume;  // 1/s
  outputGain_ = settings.gain * std::sqrt(total * density / sampleRate);
  quietLevel_ = settings.silence / std::max(outputGain_ * 4.0, 1e-6);
  quietNeeded_ = lengths_.back() + onset_.size() + 1;
}

void Reverb::makeLines(double meanLength, double longestDecay) {
  const double stretch = stretchFor(meanLength, kModalDensity * longestDecay);
  std::uint32_t next = kShortestLine;
  for (std::size_t line = 0; line < kLines; ++line) {
    const double along = static_cast<double>(line) / (kLines - 1);
    const double wanted = meanLength * kShortLine * std::pow(stretch / kShortLine, along);
    next = primeFrom(std::max(next, static_cast<std::uint32_t>(wanted)));
    lengths_[line] = next++;
  }
  std::uint32_t begin = 0;
  for (std::size_t line = 0; line < kLines; ++line) {
    begins_[line] = cursors_[line] = begin;
    begin += lengths_[line];
  }
  buffer_.assign(begin, 0.0);
}

void Reverb::makeFilters(const ReverbSettings& settings) {
  const TopDecay decay = decayOf(settings, lengths_.back(), sampleRate_);
  for (std::size_t line = 0; line < kLines; ++line) {
    const auto cascade = decayCascade(lengths_[line], decay, sampleRate_);
    sections_.resize(cascade.size());
    for (std::size_t section = 0; section < cascade.size(); ++section) {
      sections_[section].b0[line] = cascade[section].b0;
      sections_[section].b1[line] = cascade[section].b1;
      sections_[section].a1[line] = cascade[section].a1;
    }
  }
}

/// Makes the delay of the input up to the onset. The lines' own start counts towards it: their
/// passes form a renewal process, so what they give out adds up as if it had begun at full density
/// (mean^2 - variance) / (2 mean) after the input. The rest is a delay with the decay of its
/// length.
void Reverb::makeOnset(const ReverbSettings& settings) {
  double sum = 0.0;
  double squares = 0.0;
  for (const double length : lengths_) {
    sum += length;
    squares += length * length;
  }
  const double mean = sum / kLines;
  const double start = mean - squares / (2.0 * sum);
  const double rest = std::round(settings.onset * sampleRate_ - std::max(0.0, start));
  if (rest < 1.0) return;
  onset_.assign(static_cast<std::size_t>(rest), 0.0);
  const TopDecay decay = decayOf(settings, rest, sampleRate_);
  for (const ReflectionFilter& filter : decayCascade(rest, decay, sampleRate_)) {
    onsetSections_.push_back({filter});
  }
}

void Reverb::setPattern(std::size_t channel, double pattern) {
  const double even = 1.0 - pattern;
  patternGains_.at(channel) = std::sqrt(even * even + pattern * pattern / 3.0);
}

void Reverb::process(std::span<const double> in, std::span<double* const> addTo) noexcept {
  assert(addTo.size() == channels_);
  for (std::size_t sample = 0; sample < in.size(); ++sample) {
    const double input = usable(in[sample]);
    if (silent_ && input == 0.0) continue;
    Lines values;
    readLines(values);
    filterLines(values);
    mix(values);
    for (std::size_t channel = 0; channel < channels_; ++channel) {
      addTo[channel][sample] += patternGains_[channel] * outputGain_ * values[channel];
    }
    const double loudest = writeLines(values, delayInput(input));
    advance();
    listenForSilence(input, loudest);
  }
}

double Reverb::delayInput(double sample) noexcept {
  if (onset_.empty()) return sample;
  double value = onset_[onsetCursor_];
  onset_[onsetCursor_] = sample;
  onsetCursor_ = onsetCursor_ + 1 == onset_.size() ? 0 : onsetCursor_ + 1;
  for (InputSection& section : onsetSections_) {
    const double out = section.filter.b0 * value + section.state;
    section.state = section.filter.b1 * value - section.filter.a1 * out;
    value = out;
  }
  return value;
}

void Reverb::readLines(Lines& values) const noexcept {
  for (std::size_t line = 0; line < kLines; ++line)
    values[line] = buffer_[cursors_[line]];
}

void Reverb::filterLines(Lines& values) noexcept {
  for (Section& section : sections_) {
    for (std::size_t line = 0; line < kLines; ++line) {
      const double in = values[line];
      const double out = section.b0[line] * in + section.state[line];
      section.state[line] = section.b1[line] * in - section.a1[line] * out;
      values[line] = out;
    }
  }
}

/// Returns the largest magnitude written.
double Reverb::writeLines(const Lines& values, double input) noexcept {
  Lines written;
  for (std::size_t line = 0; line < kLines; ++line) {
    written[line] = flushed(values[line] + 0.25 * kInput[line] * input);
  }
  double loudest = 0.0;
  for (std::size_t line = 0; line < kLines; ++line) {
    buffer_[cursors_[line]] = written[line];
    loudest = std::max(loudest, std::abs(written[line]));
  }
  return loudest;
}

void Reverb::advance() noexcept {
  for (std::size_t line = 0; line < kLines; ++line) {
    const std::uint32_t next = cursors_[line] + 1;
    cursors_[line] = next == begins_[line] + lengths_[line] ? begins_[line] : next;
  }
  if (++sinceFlush_ == kFlushEvery) flushFilters();
}

void Reverb::flushFilters() noexcept {
  sinceFlush_ = 0;
  for (Section& section : sections_) {
    for (double& state : section.state)
      state = flushed(state);
  }
  for (InputSection& section : onsetSections_)
    section.state = flushed(section.state);
}

/// Counts quiet samples and resets after enough of them: sample by sample, so that the sizes of
/// blocks do not matter.
void Reverb::listenForSilence(double input, double loudest) noexcept {
  silent_ = false;
  quiet_ = input == 0.0 && loudest < quietLevel_ ? quiet_ + 1 : 0;
  if (quiet_ >= quietNeeded_) reset();
}

void Reverb::reset() noexcept {
  std::ranges::fill(buffer_, 0.0);
  std::ranges::fill(onset_, 0.0);
  for (Section& section : sections_)
    section.state.fill(0.0);
  for (InputSection& section : onsetSections_)
    section.state = 0.0;
  cursors_ = begins_;
  onsetCursor_ = 0;
  sinceFlush_ = 0;
  quiet_ = 0;
  silent_ = true;
}

double Reverb::decayTime(double frequency) const {
  double sum = 0.0;
  for (std::size_t line = 0; line < kLines; ++line) {
    std::vector<ReflectionFilter> cascade;
    for (const Section& section : sections_) {
      cascade.push_back({section.b0[line], section.b1[line], section.a1[line]});
    }
    sum += decayTimeOf(cascade, lengths_[line], frequency, sampleRate_);
  }
  return sum / kLines;
}

double Reverb::storedEnergy() const {
  double sum = 0.0;
  for (const double value : buffer_)
    sum += value * value;
  return sum;
}

Status Reverb::validate() const {
  const auto isWhole = [](double value) { return value == 0.0 || std::isnormal(value); };
  if (!std::ranges::all_of(buffer_, isWhole)) return Error{"a line holds a subnormal or no number"};
  if (!std::ranges::all_of(onset_, isWhole)) return Error{"the onset holds what no number is"};
  for (const Section& section : sections_) {
    if (!std::ranges::all_of(section.state, isWhole)) return Error{"a filter's state"};
  }
  for (const InputSection& section : onsetSections_) {
    if (!isWhole(section.state)) return Error{"an input filter's state"};
  }
  for (std::size_t line = 0; line < kLines; ++line) {
    if (cursors_[line] - begins_[line] >= lengths_[line]) return Error{"a cursor left its line"};
  }
  if (silent_ && storedEnergy() != 0.0) return Error{"silent, but not empty"};
  return std::monostate{};
}

}  // namespace carom::audio
