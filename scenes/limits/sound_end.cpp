#include "scenes/limits/sound_end.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace carom::scenes {

SoundEnd::SoundEnd(double sampleRate)
    : recent_(static_cast<std::size_t>(std::max(1.0, std::round(kWindow * sampleRate)))) {}

void SoundEnd::add(std::span<const std::vector<float>> channels, std::size_t frames) {
  for (std::size_t frame = 0; frame < frames; ++frame) {
    float largest = 0.0F;
    for (const std::vector<float>& channel : channels)
      largest = std::max(largest, std::abs(channel[frame]));
    recent_[next_] = largest;
    if (++next_ == recent_.size()) next_ = 0;  // a remainder would take longer than all else here
    peak_ = std::max(peak_, static_cast<double>(largest));
  }
}

double SoundEnd::last() const {
  return *std::ranges::max_element(recent_);
}

double SoundEnd::level() const {
  const double now = last();
  if (!(now > 0.0)) return -std::numeric_limits<double>::infinity();
  return 20.0 * std::log10(now / peak_);
}

void SoundEnd::fade(std::span<std::vector<float>> channels, std::size_t frames, std::int64_t first,
                    std::int64_t end) const {
  const auto length = static_cast<std::int64_t>(recent_.size());
  for (std::size_t frame = 0; frame < frames; ++frame) {
    const std::int64_t left = end - first - static_cast<std::int64_t>(frame);  // to the end, > 0
    if (left > length) continue;
    const double share = static_cast<double>(left - 1) / static_cast<double>(length);
    const auto gain = static_cast<float>(0.5 - 0.5 * std::cos(std::numbers::pi * share));
    for (std::vector<float>& channel : channels)
      channel[frame] *= gain;
  }
}

}  // namespace carom::scenes
