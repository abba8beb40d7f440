#include "carom/audio/limiter.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <sstream>
#include <string>

namespace carom {
namespace {

constexpr double kGainUnits = 0x1p36;    // in a gain of 1: sums of a longest window stay below 2^63
constexpr double kReleased = 0x1p-24;    // a gain this near to 1 counts as 1
constexpr std::size_t kLeastWindow = 2;  // frames: one before the peak, and the peak

Status validate(const LimiterSettings& settings) {
  std::ostringstream text;
  if (!(settings.sampleRate > 0.0 && settings.sampleRate <= 1e6))
    text << "sample rate " << settings.sampleRate << " Hz is not above 0 up to 1e6 Hz";
  else if (settings.channels < 1 || settings.channels > 1024)
    text << settings.channels << " channels; it takes 1 to 1024";
  else if (!(settings.ceiling > 0.0F && std::isfinite(settings.ceiling)))
    text << "ceiling " << settings.ceiling << " is not above 0 and finite";
  else if (!(settings.lookAhead >= 1e-4 && settings.lookAhead <= 0.02))
    text << "look-ahead " << settings.lookAhead << " s is not from 1e-4 to 0.02 s";
  else if (!(settings.release >= 1e-3 && settings.release <= 10.0))
    text << "release " << settings.release << " s is not from 1e-3 to 10 s";
  if (text.str().empty()) return std::monostate{};
  return Error{text.str()};
}

std::size_t earlyLength(std::size_t window) {
  return (window + 1) / 2;
}

// Together the two means reach over `window` frames.
std::size_t lateLength(std::size_t window) {
  return window + 1 - earlyLength(window);
}

std::uint64_t unitsOf(double gain) {
  return static_cast<std::uint64_t>(gain * kGainUnits);  // rounded down, to be never too loud
}

}  // namespace

Limiter::RunningSum::RunningSum(std::size_t length, std::uint64_t start) : values_(length) {
  fill(start);
}

void Limiter::RunningSum::fill(std::uint64_t value) noexcept {
  std::ranges::fill(values_, value);
  sum_ = value * values_.size();
  next_ = 0;
}

std::uint64_t Limiter::RunningSum::push(std::uint64_t value) noexcept {
  sum_ += value;
  sum_ -= values_[next_];
  values_[next_] = value;
  next_ = next_ + 1 == values_.size() ? 0 : next_ + 1;
  return sum_;
}

void Limiter::RunningMinimum::clear() noexcept {
  first_ = 0;
  count_ = 0;
  frame_ = 0;
}

double Limiter::RunningMinimum::push(double value) noexcept {
  const std::size_t length = entries_.size();
  const auto at = [&](std::size_t index) -> Entry& { return entries_[(first_ + index) % length]; };
  if (count_ > 0 && at(0).frame + length <= frame_) {
    first_ = (first_ + 1) % length;
    --count_;
  }
  while (count_ > 0 && at(count_ - 1).value >= value)
    --count_;
  at(count_) = {value, frame_};
  ++count_;
  ++frame_;
  return at(0).value;
}

Result<Limiter> Limiter::create(const LimiterSettings& settings) {
  if (const Status valid = validate(settings); !valid)
    return Error{"limiter: " + valid.error().message};
  const auto window =
      static_cast<std::size_t>(std::lround(settings.lookAhead * settings.sampleRate));
  return Limiter(settings, std::max(window, kLeastWindow));
}

Limiter::Limiter(const LimiterSettings& settings, std::size_t window)
    : ceiling_(settings.ceiling),
      channels_(settings.channels),
      delay_(window - 1),
      releaseShare_(1.0 - std::exp(-1.0 / (settings.release * settings.sampleRate))),
      unity_(static_cast<double>(earlyLength(window) * lateLength(window)) * kGainUnits),
      minimum_(window),
      early_(earlyLength(window), unitsOf(1.0)),
      late_(lateLength(window), unitsOf(1.0) * earlyLength(window)),
      line_(delay_ * channels_) {}

void Limiter::reset() noexcept {
  minimum_.clear();
  early_.fill(unitsOf(1.0));
  late_.fill(unitsOf(1.0) * early_.length());
  std::ranges::fill(line_, 0.0F);
  place_ = 0;
  released_ = 1.0;
  leastGain_ = 1.0;
  notFinite_ = 0;
}

/// Returns the gain that brings the loudest channel to the ceiling; samples that are not finite
/// become 0.
double Limiter::wantedGain(std::span<float* const> channels, std::size_t frame) noexcept {
  float loudest = 0.0F;
  for (float* const channel : channels) {
    if (!std::isfinite(channel[frame])) {
      channel[frame] = 0.0F;
      ++notFinite_;
    }
    loudest = std::max(loudest, std::abs(channel[frame]));
  }
  return loudest > ceiling_ ? static_cast<double>(ceiling_) / static_cast<double>(loudest) : 1.0;
}

double Limiter::smoothGain(double wanted) noexcept {
  const double least = minimum_.push(wanted);
  const double risen = released_ + (1.0 - released_) * releaseShare_;
  released_ = std::min(least, 1.0 - risen < kReleased ? 1.0 : risen);
  return static_cast<double>(late_.push(early_.push(unitsOf(released_)))) / unity_;
}

void Limiter::process(std::span<float* const> channels, std::size_t frames) noexcept {
  assert(channels.size() == channels_);
  if (channels.size() != channels_) return;
  for (std::size_t frame = 0; frame < frames; ++frame) {
    const double gain = smoothGain(wantedGain(channels, frame));
    leastGain_ = std::min(leastGain_, gain);
    float* const delayed = line_.data() + place_ * channels_;
    for (std::size_t channel = 0; channel < channels_; ++channel) {
      const auto limited = static_cast<float>(static_cast<double>(delayed[channel]) * gain);
      delayed[channel] = channels[channel][frame];
      channels[channel][frame] = std::clamp(limited, -ceiling_, ceiling_);  // against rounding
    }
    place_ = place_ + 1 == delay_ ? 0 : place_ + 1;
  }
}

double Limiter::largestReduction() const {
  return leastGain_ < 1.0 ? -20.0 * std::log10(leastGain_) : 0.0;
}

}  // namespace carom
