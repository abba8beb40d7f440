#include "audio/synthesis/noise_bed.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <map>
#include <numbers>

#include <unsupported/Eigen/FFT>

#include "audio/dsp/spread_kernel.h"
#include "audio/model/immortal.h"
#include "audio/model/mutex.h"

namespace carom::audio {
namespace {

/// Samples of the loops: even, and products of 2, 3 and 5, for which transforms are fast.
constexpr std::array<std::size_t, kThirdOctaves> kLoops = {
    20000, 20250, 20480, 20736, 21600, 21870, 22500, 23040, 23328, 24000, 24300, 24576, 25000,
    25600, 25920, 26244, 27000, 27648, 28800, 29160, 30000, 30720, 31104, 31250, 32000, 32400};
/// Samples between the places at which two channels read a loop.
constexpr std::size_t kApart = 7919;

/// A generator of random numbers (splitmix64: Steele, Lea, Flood 2014) that are the same
/// everywhere: a phase, uniform over the circle.
double nextPhase(std::uint64_t& state) {
  state += 0x9E3779B97F4A7C15U;
  std::uint64_t z = state;
  z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9U;
  z = (z ^ (z >> 27U)) * 0x94D049BB133111EBU;
  z ^= z >> 31U;
  return 2.0 * std::numbers::pi * static_cast<double>(z >> 11U) * 0x1.0p-53;
}

std::vector<float> makeLoop(std::size_t size, double low, double high, std::uint64_t seed) {
  std::vector<float> loop(size, 0.0F);
  const auto count = static_cast<double>(size);
  const auto first = static_cast<std::size_t>(std::ceil(low * count));
  const auto end = static_cast<std::size_t>(std::ceil(std::min(high, kBand) * count));
  if (end <= first) return loop;
  // Lines of the same power and random phases: many of them are Gaussian noise.
  const double amplitude = std::sqrt(0.5 / static_cast<double>(end - first));
  std::vector<std::complex<float>> lines(size / 2 + 1);
  for (std::size_t line = first; line < end; ++line)
    lines[line] = std::complex<float>(std::polar(amplitude, nextPhase(seed)));
  Eigen::FFT<float> transform;
  transform.SetFlag(Eigen::FFT<float>::Unscaled);
  transform.SetFlag(Eigen::FFT<float>::HalfSpectrum);
  transform.inv(loop, lines, static_cast<Eigen::Index>(size));
  return loop;
}

std::size_t wrapped(std::int64_t position, std::size_t size) {
  const auto period = static_cast<std::int64_t>(size);
  const std::int64_t rest = position % period;
  return static_cast<std::size_t>(rest < 0 ? rest + period : rest);
}

}  // namespace

BandNoise::BandNoise(double sampleRate) {
  const double half = 0.5 * kThirdOctaveWidth;
  for (std::size_t band = 0; band < kThirdOctaves; ++band) {
    const double centre = thirdOctaves()[band] / sampleRate;
    // The edges of a third octave are a 20th of a decade below and above.
    const double edge = half + std::sqrt(1.0 + half * half);
    loops_.push_back(makeLoop(kLoops[band], centre / edge, centre * edge, band + 1));
  }
}

std::shared_ptr<const BandNoise> BandNoise::at(double sampleRate) {
  struct Known {
    Mutex mutex;
    std::map<double, std::weak_ptr<const BandNoise>> all;
    // Kept for whoever opens one sound after another, as a game does for each of its levels: to
    // make it takes two thirds of the time in which a sound begins.
    std::shared_ptr<const BandNoise> latest;
  };
  static Known& known = immortal([] { return Known(); });
  const MutexLock lock(known.mutex);
  std::weak_ptr<const BandNoise>& place = known.all[sampleRate];
  known.latest = place.lock();
  if (!known.latest) known.latest.reset(new BandNoise(sampleRate));
  place = known.latest;
  return known.latest;
}

NoiseBed::NoiseBed(double sampleRate, std::size_t channels, std::optional<std::size_t> capacity)
    : channels_(channels),
      capacity_(capacity),
      noise_(BandNoise::at(sampleRate)),
      points_(capacity.value_or(16)),
      powers_(points_.size() * channels * kThirdOctaves),
      silence_(channels * kThirdOctaves),
      before_(channels * kThirdOctaves),
      after_(channels * kThirdOctaves) {}

const NoiseBed::Point& NoiseBed::point(std::size_t index) const {
  return points_[(oldest_ + index) % points_.size()];
}

std::span<const float> NoiseBed::powersOf(std::size_t index) const {
  const std::size_t size = silence_.size();
  return std::span(powers_).subspan((oldest_ + index) % points_.size() * size, size);
}

/// Doubles the room for levels.
void NoiseBed::grow() {
  std::vector<Point> points(2 * points_.size());
  std::vector<float> powers(2 * powers_.size());
  for (std::size_t index = 0; index < count_; ++index) {
    points[index] = point(index);
    std::ranges::copy(powersOf(index),
                      powers.begin() + static_cast<std::ptrdiff_t>(index * silence_.size()));
  }
  points_.swap(points);
  powers_.swap(powers);
  oldest_ = 0;
}

bool NoiseBed::add(const NoiseLevel& level) {
  if (level.powers.size() != silence_.size()) return false;
  // A listener who has come nearer hears this one before those that are still on their way.
  while (count_ > 0 && point(count_ - 1).since >= level.since)
    --count_;
  if (count_ == points_.size()) {
    if (capacity_) return false;
    grow();
  }
  const std::int64_t earliest = count_ > 0 ? point(count_ - 1).at : level.since;
  const std::int64_t since = std::max(level.since, earliest);
  const std::size_t place = (oldest_ + count_) % points_.size();
  points_[place] = {.at = std::max(level.at, since + 1), .since = since, .lasting = level.lasting};
  std::ranges::copy(level.powers,
                    powers_.begin() + static_cast<std::ptrdiff_t>(place * silence_.size()));
  ++count_;
  return true;
}

void NoiseBed::drop() noexcept {
  oldest_ = (oldest_ + 1) % points_.size();
  --count_;
}

/// Drops the levels that no sample from `position` on depends on.
void NoiseBed::forget(std::int64_t position) noexcept {
  while (count_ > 1 && point(1).at <= position)
    drop();
  if (count_ == 1 && point(0).at + point(0).lasting + kHop <= position) count_ = 0;
}

/// Finds the amplitudes at a moment, from the level before it and the one after it.
void NoiseBed::aim(std::int64_t position) noexcept {
  forget(position);
  std::ranges::fill(after_, 0.0F);
  const auto remaining = [position](const Point& from, std::int64_t until) {
    const auto age = static_cast<float>(std::min(position, until) - from.at);
    return std::clamp(1.0F - age / static_cast<float>(from.lasting), 0.0F, 1.0F);
  };
  for (std::size_t index = 0; index < std::min<std::size_t>(count_, 2); ++index) {
    const Point& here = point(index);
    float share = 0.0F;
    if (here.at <= position) {
      share = remaining(here, count_ > 1 ? point(1).since : position);
      if (count_ > 1 && position > point(1).since)
        share *= static_cast<float>(point(1).at - position) /
                 static_cast<float>(point(1).at - point(1).since);
    } else if (position > here.since) {
      share = static_cast<float>(position - here.since) / static_cast<float>(here.at - here.since);
    }
    const std::span<const float> powers = powersOf(index);
    for (std::size_t i = 0; i < after_.size(); ++i)
      after_[i] += share * powers[i];
    if (here.at > position) break;
  }
  for (float& amplitude : after_)
    amplitude = std::sqrt(amplitude);
}

void NoiseBed::mix(std::int64_t position, const Output& to) noexcept {
  for (std::size_t done = 0; done < to.frames && count_ > 0;) {
    const std::int64_t now = position + static_cast<std::int64_t>(done);
    const std::int64_t hop = now >= 0 ? now / kHop : -((kHop - 1 - now) / kHop);
    if (!isAimed_ || hop != hop_) {
      if (isAimed_ && hop == hop_ + 1)
        before_ = after_;
      else
        std::ranges::fill(before_, 0.0F);
      aim(hop * kHop);
      hop_ = hop;
      isAimed_ = true;
    }
    const auto left = static_cast<std::size_t>((hop + 1) * kHop - now);
    const std::size_t part = std::min(left, to.frames - done);
    mixHop(now,
           {to.samples + done, to.stride, part, to.send != nullptr ? to.send + done : nullptr});
    done += part;
  }
  if (count_ == 0) isAimed_ = false;
}

/// Adds samples within one hop.
void NoiseBed::mixHop(std::int64_t position, const Output& to) noexcept {
  using Ramp = Eigen::Array<float, kHop, 1>;
  static const Ramp ramp = Ramp::LinSpaced(0.0F, static_cast<float>(kHop - 1));
  const auto from = static_cast<std::size_t>(position - hop_ * kHop);
  for (std::size_t channel = 0; channel < channels_; ++channel) {
    Ramp sum = Ramp::Zero();
    for (std::size_t band = 0; band < kThirdOctaves; ++band) {
      const std::size_t index = channel * kThirdOctaves + band;
      const float slope = (after_[index] - before_[index]) / static_cast<float>(kHop);
      const float begin = before_[index];
      if (begin == 0.0F && slope == 0.0F) continue;
      const std::span<const float> loop = noise_->loop(band);
      std::size_t at = wrapped(position + static_cast<std::int64_t>(channel * kApart), loop.size());
      for (std::size_t done = 0; done < to.frames;) {
        const std::size_t part = std::min(to.frames - done, loop.size() - at);
        const auto count = static_cast<Eigen::Index>(part);
        const auto first = static_cast<Eigen::Index>(done);
        sum.segment(first, count) +=
            (begin + ramp.segment(static_cast<Eigen::Index>(from) + first, count) * slope) *
            Eigen::Map<const Eigen::ArrayXf>(&loop[at], count);
        done += part;
        at = 0;
      }
    }
    const bool isSent = to.send != nullptr && channel + 1 == channels_;
    double* const samples = isSent ? to.send : to.samples + channel * to.stride;
    for (std::size_t i = 0; i < to.frames; ++i)
      samples[i] += static_cast<double>(sum[static_cast<Eigen::Index>(i)]);
  }
}

void NoiseBed::clear() {
  count_ = 0;
  isAimed_ = false;
}

}  // namespace carom::audio
