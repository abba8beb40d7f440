#include "audio/synthesis/moving_ring.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace carom::audio {
namespace {

/// Square of the least angle (rad) of a pole: one that does not oscillate would have no phase.
constexpr double kLeastTurn = 1e-24;
/// Share of the mean over directions at 1 m below which a mode cannot be told from one at rest.
constexpr double kLeastHeard = 1e-9;

/// Returns the pole of a resonator: what its oscillation is multiplied by in a sample.
std::complex<double> poleOf(double a1, double a2) {
  const double real = 0.5 * a1;
  return {real, std::sqrt(std::max(-a2 - real * real, kLeastTurn))};
}

}  // namespace

void MovingRing::reserve(std::size_t count) {
  if (states_.size() >= count) return;
  numbers_.resize(6 * count);
  tuned_ = std::span(numbers_).first(2 * count);
  y_ = std::span(numbers_).subspan(2 * count, 2 * count);
  change_ = std::span(numbers_).last(2 * count);
  states_.resize(count);  // last, as its size tells that there is room in all
}

void MovingRing::begin(const ResonatorSet& set, std::size_t count,
                       const RingMotion& motion) noexcept {
  assert(count <= states_.size());
  set_ = &set;
  count_ = count;
  modes_ = std::min(set.modes, count);
  active_ = 0;
  length_ = 0.0;
  rate_ = motion.rate;
  for (const std::span<double> values : {tuned_, y_, change_})
    std::fill_n(values.begin(), 2 * count, 0.0);
  for (std::size_t mode = 0; mode < modes_; ++mode) {
    states_[mode].oscillation = 0.0;
    states_[mode].heard = {motion.transfers[mode], motion.transfers[count + mode]};
  }
  setPoles(set.a1, set.a2);
}

void MovingRing::setPoles(std::span<const double> a1, std::span<const double> a2) noexcept {
  for (std::size_t mode = 0; mode < modes_; ++mode)
    states_[mode].logPole = std::log(poleOf(a1[mode], a2[mode]));
}

void MovingRing::damp(std::span<const double> taps, std::int64_t now) noexcept {
  advance(now);
  setPoles(taps, taps.subspan(count_));
  restart();
}

void MovingRing::move(const RingMotion& motion, std::int64_t now) noexcept {
  advance(now);
  for (std::size_t mode = 0; mode < modes_; ++mode)
    states_[mode].next = {motion.transfers[mode], motion.transfers[count_ + mode]};
  length_ = motion.length;
  rate_ = motion.rate;
  restart();
}

void MovingRing::join(std::span<const double> y, const RingMotion& motion,
                      std::int64_t now) noexcept {
  advance(now);
  for (std::size_t mode = 0; mode < modes_; ++mode) {
    // Until now it has been that of the free body.
    const Complex pole = std::pow(poleOf(set_->a1[mode], set_->a2[mode]), motion.rate);
    add(mode, pole, y, {motion.transfers[mode], motion.transfers[count_ + mode]});
  }
  active_ = count_;
  restart();
}

void MovingRing::join(std::span<const double> y, std::int64_t now) noexcept {
  advance(now);
  for (std::size_t mode = 0; mode < modes_; ++mode)
    if (std::abs(states_[mode].heard) > kLeastHeard)
      add(mode, poleOf(set_->a1[mode], set_->a2[mode]), y, states_[mode].heard);
  active_ = count_;
  restart();
}

void MovingRing::adopt(std::span<const double> y, std::int64_t now) noexcept {
  advance(now);
  for (std::size_t mode = 0; mode < modes_; ++mode)
    if (std::abs(states_[mode].heard) > kLeastHeard)
      add(mode, std::exp(states_[mode].logPole), y, states_[mode].heard);
  active_ = count_;
  restart();
}

/// Adds an oscillation A with a pole that has been heard by a factor H: y1 = Re(A H / pole) and
/// y2 = Re(A H / pole^2).
void MovingRing::add(std::size_t mode, const Complex& pole, std::span<const double> y,
                     const Complex& heard) noexcept {
  const double y1 = y[mode];
  const double y2 = y[count_ + mode];
  const Complex last(y1, (y2 * std::norm(pole) - y1 * pole.real()) / pole.imag());
  states_[mode].oscillation += last * pole / heard;
}

/// Makes `now` the sample from which the state counts.
void MovingRing::advance(std::int64_t now) noexcept {
  const auto passed = static_cast<double>(now - since_);
  const double share = length_ > 0.0 ? std::min(passed / length_, 1.0) : 0.0;
  const std::size_t modes = std::min(modes_, active_);
  for (std::size_t mode = 0; mode < modes; ++mode)
    states_[mode].oscillation *= std::exp(passed * rate_ * states_[mode].logPole);
  if (share == 1.0)
    for (std::size_t mode = 0; mode < modes_; ++mode)
      states_[mode].heard = states_[mode].next;
  else if (share > 0.0)
    for (std::size_t mode = 0; mode < modes_; ++mode)
      states_[mode].heard += share * (states_[mode].next - states_[mode].heard);
  length_ = std::max(length_ - passed, 0.0);
  since_ = now;
}

/// Tunes the resonators, and begins them with the state.
void MovingRing::restart() noexcept {
  const std::size_t modes = std::min(modes_, active_);
  for (std::size_t mode = 0; mode < modes; ++mode) {
    const Complex pole = std::exp(rate_ * states_[mode].logPole);
    tuned_[mode] = 2.0 * pole.real();
    tuned_[count_ + mode] = -std::norm(pole);
    const Complex last = states_[mode].oscillation / pole;
    const Complex beforeLast = last / pole;
    y_[mode] = (states_[mode].heard * last).real();
    y_[count_ + mode] = (states_[mode].heard * beforeLast).real();
    if (length_ == 0.0) continue;
    const Complex change = states_[mode].next - states_[mode].heard;
    change_[mode] = (change * last).real();
    change_[count_ + mode] = (change * beforeLast).real();
  }
}

bool MovingRing::settle(const ResonatorKernels& kernels, double threshold,
                        std::int64_t now) noexcept {
  if (length_ > 0.0 && static_cast<double>(now - since_) >= length_) {
    advance(now);
    restart();
  }
  std::size_t left = kernels.flush(resonators(y_), threshold);
  if (length_ > 0.0) left += kernels.flush(resonators(change_), threshold);
  if (left > 0) return true;
  advance(now);
  const bool isLeft = forgetBelow(threshold);
  restart();
  return isLeft;
}

/// Forgets the oscillations below a threshold (Pa); false if none is left.
bool MovingRing::forgetBelow(double threshold) noexcept {
  const std::size_t modes = std::min(modes_, active_);
  std::size_t left = 0;
  for (std::size_t mode = 0; mode < modes; ++mode) {
    if (std::abs(states_[mode].oscillation) > threshold)
      left = mode + 1;
    else
      states_[mode].oscillation = 0.0;
  }
  active_ = ResonatorKernels::padded(left);
  return left > 0;
}

Resonators MovingRing::resonators(std::span<double> y) const noexcept {
  return {tuned_.data(), tuned_.data() + count_, y.data(), y.data() + count_, active_};
}

void MovingRing::ring(const ResonatorKernels& kernels, std::int64_t now,
                      std::span<double> out) noexcept {
  assert(out.size() <= kMostSamples);
  kernels.ring(resonators(y_), out);
  if (length_ == 0.0) return;
  const std::span<double> growing = std::span(growing_).first(out.size());
  std::ranges::fill(growing, 0.0);
  kernels.ring(resonators(change_), growing);
  const auto passed = static_cast<double>(now - since_);
  for (std::size_t n = 0; n < out.size(); ++n)
    out[n] += std::min((passed + static_cast<double>(n)) / length_, 1.0) * growing[n];
}

void MovingRing::forgetAbove(double most) noexcept {
  const auto forget = [most](auto& value) {
    if (!(std::abs(value) <= most)) value = 0.0;
  };
  for (State& state : states_)
    forget(state.oscillation);
  std::ranges::for_each(y_, forget);
  std::ranges::for_each(change_, forget);
}

}  // namespace carom::audio
