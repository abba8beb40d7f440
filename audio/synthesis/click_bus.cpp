#include "audio/synthesis/click_bus.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <utility>

namespace carom::audio {
namespace {

/// Pa: a filter's state that gives no more becomes 0. It is 206 dB below the threshold of hearing
/// (20 uPa).
constexpr double kSilence = 1e-15;

}  // namespace

void ClickBus::restart(const BusChain& chain, std::int64_t position) {
  chain_ = chain;
  position_ = position;
  std::ranges::fill(far_, 0.0);
  std::ranges::fill(near_, 0.0);
  begin_ = held_ = 0;
  hasNear_ = false;
  ringing_ = false;
  last_ = beforeLast_ = 0.0;
  reflected_.assign(chain.reflections.size(), 0.0);
}

void ClickBus::reserve(std::size_t frames, std::size_t samples) {
  const std::size_t needed = kHistory + frames + samples + 2 * ClickKernels::kRoom;
  if (far_.size() >= needed) return;
  const std::size_t room = std::max(needed, 2 * far_.size());
  near_.resize(room, 0.0);
  far_.resize(room, 0.0);  // last, as its size tells that there is room in both
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
  if (near != 0.0) {
    kernels_->add(x, near, &near_[at]);
    hasNear_ = true;
  }
  begin_ = held_ == 0 ? at : std::min(begin_, at);
  held_ = std::max(held_, at + x.size());
}

void ClickBus::advance(std::span<double> to) noexcept {
  assert(to.size() <= kMaxFrames);
  position_ += static_cast<std::int64_t>(to.size());
  if (isSilent()) return;
  // Held samples are heard from kHistory samples before the first of them on; until then the
  // output is silent.
  const std::size_t quiet = ringing_ ? 0 : begin_ - std::min(begin_, kHistory);
  const std::size_t skipped = std::min(quiet, to.size());
  std::array<double, kMaxFrames> buffer{};
  const std::span<double> pressure(buffer.data(), to.size() - skipped);
  drive(skipped, pressure.first(std::min(pressure.size(), held_ - std::min(held_, skipped))));
  shift(to.size());
  ring(pressure);
  for (std::size_t i = 0; i < pressure.size(); ++i)
    to[skipped + i] += pressure[i];
}

void ClickBus::forgetAbove(double most) noexcept {
  const auto forget = [most](double& value) {
    if (!(std::abs(value) <= most)) value = 0.0;
  };
  std::ranges::for_each(far_, forget);
  std::ranges::for_each(near_, forget);
  std::ranges::for_each(reflected_, forget);
  forget(last_);
  forget(beforeLast_);
}

void ClickBus::drive(std::size_t from, std::span<double> pressure) const noexcept {
  if (pressure.empty()) return;
  const std::size_t at = kHistory + from;
  if (chain_.radiation == nullptr) {
    std::copy_n(&far_[at], pressure.size(), pressure.data());
    return;
  }
  const HeldInput held{static_cast<std::ptrdiff_t>(begin_) - static_cast<std::ptrdiff_t>(at),
                       static_cast<std::ptrdiff_t>(held_) - static_cast<std::ptrdiff_t>(at)};
  kernels_->filter(chain_.radiation->far(), &far_[at], held, pressure);
  if (hasNear_) kernels_->filter(chain_.radiation->near(), &near_[at], held, pressure);
}

void ClickBus::shift(std::size_t frames) noexcept {
  if (held_ == 0) return;
  const std::size_t left = held_ - std::min(held_, frames);
  const std::size_t kept = begin_ - std::min(begin_, frames);
  for (std::vector<double>* input : {&far_, &near_}) {
    std::copy(input->data() + kept + frames, input->data() + left + frames, input->data() + kept);
    std::fill(input->data() + std::max(left, begin_), input->data() + held_, 0.0);
  }
  begin_ = kept;
  held_ = left;
}

void ClickBus::ring(std::span<double> pressure) noexcept {
  if (pressure.empty()) return;
  ringing_ = false;
  if (chain_.radiation != nullptr && chain_.radiation->b2() != 0.0) {
    const double b1 = chain_.radiation->b1();
    const double b2 = chain_.radiation->b2();
    // The recursion of a large body takes up little in a sample, and gives 1 / (1 - b1 - b2) of it.
    const double silence = kSilence * (1.0 - b1 - b2);
    for (double& sample : pressure) {
      const double before = std::exchange(beforeLast_, last_);
      last_ = sample + b1 * last_ + b2 * before;
      // Both samples end together: an oscillation that loses one of them alone may go on for ever.
      if (std::abs(last_) < silence && std::abs(beforeLast_) < silence) last_ = beforeLast_ = 0.0;
      sample = last_;
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

}  // namespace carom::audio
