#include "audio/click_bus.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

namespace carom {
namespace {

/// Pa: what rings on below it is over. It is 220 dB below the threshold of hearing.
constexpr double kSilence = 1e-15;

}  // namespace

void ClickBus::restart(const BusChain& chain, std::int64_t position) {
  chain_ = chain;
  position_ = position;
  std::ranges::fill(far_, 0.0);
  std::ranges::fill(near_, 0.0);
  held_ = 0;
  ringing_ = false;
  last_ = beforeLast_ = 0.0;
  reflected_.assign(chain.reflections.size(), 0.0);
}

void ClickBus::reserve(std::size_t frames, std::size_t samples) {
  const std::size_t needed = kHistory + frames + samples + 2 * ClickKernels::kRoom;
  if (far_.size() >= needed) return;
  far_.resize(std::max(needed, 2 * far_.size()), 0.0);
  near_.resize(far_.size(), 0.0);
}

void ClickBus::add(std::int64_t first, std::span<const double> x, double far,
                   double near) noexcept {
  const std::int64_t begin = first - position_ + static_cast<std::int64_t>(kHistory);
  const auto cut = static_cast<std::size_t>(std::clamp<std::int64_t>(-begin, 0, std::ssize(x)));
  x = x.subspan(cut);
  if (x.empty()) return;
  const auto at = static_cast<std::size_t>(begin + static_cast<std::int64_t>(cut));
  assert(at + x.size() + ClickKernels::kRoom <= far_.size());
  kernels_->add(x, far, &far_[at]);
  if (near != 0.0) kernels_->add(x, near, &near_[at]);
  held_ = std::max(held_, at + x.size());
}

void ClickBus::advance(std::span<double> to) noexcept {
  assert(to.size() <= kMaxFrames);
  const std::size_t frames = to.size();
  position_ += static_cast<std::int64_t>(frames);
  if (isSilent()) return;
  std::array<double, kMaxFrames> buffer{};
  const std::span<double> pressure(buffer.data(), frames);
  if (held_ > 0) {
    if (chain_.radiation == nullptr) {
      std::copy_n(far_.data() + kHistory, frames, pressure.data());
    } else {
      kernels_->filter(far_.data() + kHistory, chain_.radiation->far(), pressure.data(), frames);
      kernels_->filter(near_.data() + kHistory, chain_.radiation->near(), pressure.data(), frames);
    }
    const std::size_t left = held_ > frames ? held_ - frames : 0;
    for (std::vector<double>* input : {&far_, &near_}) {
      std::copy_n(input->data() + frames, left, input->data());
      std::fill(input->data() + left, input->data() + held_, 0.0);
    }
    held_ = left;
  }
  runFilters(pressure);
  for (std::size_t i = 0; i < frames; ++i)
    to[i] += pressure[i];
}

void ClickBus::runFilters(std::span<double> pressure) noexcept {
  ringing_ = false;
  if (chain_.radiation != nullptr && chain_.radiation->b2() != 0.0) {
    const double b1 = chain_.radiation->b1();
    const double b2 = chain_.radiation->b2();
    for (double& sample : pressure) {
      double now = sample + b1 * last_ + b2 * beforeLast_;
      if (std::abs(now) < kSilence) now = 0.0;
      beforeLast_ = last_;
      last_ = sample = now;
    }
    ringing_ = last_ != 0.0 || beforeLast_ != 0.0;
  }
  for (std::size_t i = 0; i < reflected_.size(); ++i) {
    const ReflectionFilter& wall = chain_.reflections[i];
    double state = reflected_[i];
    for (double& sample : pressure) {
      const double now = wall.b0 * sample + state;
      state = wall.b1 * sample - wall.a1 * now;
      if (std::abs(state) < kSilence) state = 0.0;
      sample = now;
    }
    reflected_[i] = state;
    ringing_ = ringing_ || state != 0.0;
  }
}

}  // namespace carom
