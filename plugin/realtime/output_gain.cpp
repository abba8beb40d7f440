#include "plugin/realtime/output_gain.h"

#include <algorithm>
#include <cmath>

namespace carom::plugin {

void OutputGain::setGain(double gain) noexcept {
  if (std::isnan(gain)) return;
  gain_.store(static_cast<float>(std::clamp(gain, 0.0, static_cast<double>(kMost))),
              std::memory_order_relaxed);
}

void OutputGain::aim() noexcept {
  const bool muted = muted_.load(std::memory_order_relaxed);
  const float goal = muted ? 0.0F : gain_.load(std::memory_order_relaxed);
  if (goal == goal_) return;
  goal_ = goal;
  framesLeft_ = rampFrames_;
}

void OutputGain::apply(std::span<float* const> channels, std::size_t frames) noexcept {
  aim();
  if (framesLeft_ == 0 && now_ == 1.0F) return;
  for (std::size_t frame = 0; frame < frames; ++frame) {
    if (framesLeft_ > 0) {
      now_ += (goal_ - now_) / static_cast<float>(framesLeft_);
      if (--framesLeft_ == 0) now_ = goal_;
    }
    for (float* const channel : channels)
      channel[frame] *= now_;
  }
}

}  // namespace carom::plugin
