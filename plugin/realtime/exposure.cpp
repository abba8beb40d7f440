#include "plugin/realtime/exposure.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace carom::plugin {
namespace {

/// Time constants that the gain goes through in the time of an attack.
constexpr double kAttackConstants = 6.0;

}  // namespace

Exposure::Exposure(double sampleRate)
    : attack_(std::llround(kAttack * sampleRate)),
      approach_(1.0 -
                std::exp(-kAttackConstants * static_cast<double>(kBlock) / (kAttack * sampleRate))),
      falling_(std::pow(10.0, -kRelease / 20.0 * static_cast<double>(kBlock) / sampleRate)),
      holdBlocks_(static_cast<std::size_t>(kHold * sampleRate) / kBlock) {}

void Exposure::announce(const Announcement& announcement) noexcept {
  if (!(announcement.pressure > 0.0) || announcements_.writable(1) == 0) return;
  announcements_.put(announcement);
  announcements_.publish();
}

void Exposure::advance(std::int64_t begin, std::int64_t end) noexcept {
  if (steps_.writable(1) == 0) return;
  steps_.put({begin, end});
  steps_.publish();
}

/// Takes over what has been announced, as much as there is room for.
void Exposure::receive() noexcept {
  for (; awaitedCount_ < awaited_.size() && announcements_.readable(1) > 0; ++awaitedCount_) {
    awaited_.at(awaitedCount_) = announcements_.peek();
    announcements_.drop(1);
  }
}

/// Takes what is heard within the time of an attack.
void Exposure::takeAnnouncements(std::int64_t position) noexcept {
  receive();
  std::size_t kept = 0;
  for (std::size_t index = 0; index < awaitedCount_; ++index) {
    const Announcement& next = awaited_.at(index);
    if (next.sample > position + attack_)
      awaited_.at(kept++) = next;
    else if (next.isSound)
      hear(next.pressure);
    else if (!hasHeard_)
      level_ = std::max(level_, next.pressure);
  }
  awaitedCount_ = kept;
}

/// True if the simulation moves at that sample.
bool Exposure::isMoving(std::int64_t position) noexcept {
  while (steps_.readable(1) > 0) {
    const Step step = steps_.peek();
    if (position < step.end) return position >= step.begin;
    steps_.drop(1);
  }
  return false;
}

void Exposure::hear(double pressure) noexcept {
  if (!(pressure > 0.0) || !std::isfinite(pressure)) return;
  if (!std::exchange(hasHeard_, true)) level_ *= kPredicted;
  loudest_ = std::max(loudest_, pressure);
  if (pressure < level_) return;
  level_ = pressure;
  heldFor_ = 0;
}

void Exposure::release() noexcept {
  if (heldFor_ < holdBlocks_)
    ++heldFor_;
  else
    level_ = std::max(level_ * falling_, loudest_ / kRange);
}

/// Sets how the gain goes on in the block that begins at that sample.
void Exposure::beginBlock(std::int64_t position) noexcept {
  hear(block_);
  block_ = 0.0;
  takeAnnouncements(position);
  if (hasHeard_ && isMoving(position)) release();
  const double unknown = kTarget * kUnpredicted;
  const double level = std::max(level_ > 0.0 ? level_ : unknown, kTarget * kLeastFullScale);
  const double goal = kTarget / level;
  if (gain_ == 0.0) gain_ = goal;
  const double next = gain_ * std::pow(goal / gain_, approach_);
  slope_ = (next - gain_) / static_cast<double>(kBlock);
}

void Exposure::apply(std::span<float* const> channels, std::size_t frames,
                     std::int64_t position) noexcept {
  constexpr auto kLength = static_cast<std::int64_t>(kBlock);
  for (std::size_t frame = 0; frame < frames; ++frame) {
    const std::int64_t sample = position + static_cast<std::int64_t>(frame);
    if (sample % kLength == 0 || gain_ == 0.0) beginBlock(sample);
    for (float* const channel : channels) {
      const auto pressure = static_cast<double>(channel[frame]);
      block_ = std::max(block_, std::abs(pressure));
      channel[frame] = static_cast<float>(gain_ * pressure);
    }
    gain_ += slope_;
  }
}

}  // namespace carom::plugin
