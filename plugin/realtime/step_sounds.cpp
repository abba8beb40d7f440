#include "plugin/realtime/step_sounds.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace carom::plugin {

using namespace audio;

void StepSounds::noteLoudness(const ScheduledSound& sound) {
  const double peak = std::max(sound.peak, sound.modalPeak);
  if (!sound.train.empty() || !(peak > 0.0)) return;
  std::int64_t first = std::numeric_limits<std::int64_t>::max();
  for (const Click& click : sound.clicks)
    first = std::min(first, click.first);
  for (const ModalExcitation& excitation : sound.excitations)
    first = std::min(first, excitation.drive.first);
  firstImpact_ = std::min(firstImpact_, first);
  power_[static_cast<std::size_t>(first / kBin) % kBins] += peak * peak;
}

StepSounds::Loudest StepSounds::takeLoudest() {
  if (firstImpact_ == std::numeric_limits<std::int64_t>::max()) return {};
  const Loudest loudest{.peak = std::sqrt(*std::ranges::max_element(power_)),
                        .first = firstImpact_};
  power_.fill(0.0);
  firstImpact_ = std::numeric_limits<std::int64_t>::max();
  return loudest;
}

void StepSounds::add(const ScheduledSound& sound) {
  noteLoudness(sound);
  if (!sound.excitations.empty()) {
    ScheduledSound modal = sound;
    modal.clicks = {};
    modal.ears = {};
    if (!queue_.put(modal)) ++faults_;
  }
  if (!sound.noise.powers.empty() && !queue_.put(sound)) ++faults_;
  if (sound.clicks.empty()) return;
  events_.push_back(
      {sound.peak, clicks_.size(), sound.clicks.size(), nodes_.size(), sound.train.size()});
  clicks_.insert(clicks_.end(), sound.clicks.begin(), sound.clicks.end());
  ears_.insert(ears_.end(), sound.ears.begin(), sound.ears.end());
  nodes_.insert(nodes_.end(), sound.train.begin(), sound.train.end());
  if (events_.size() >= 2 * voices_) stolen_ += keepLoudest(voices_);
}

/// Keeps the loudest of the step's events, in their order; returns how many were dropped.
std::uint64_t StepSounds::keepLoudest(std::size_t events) {
  if (events_.size() <= events) return 0;
  const std::uint64_t gone = events_.size() - events;
  std::ranges::nth_element(events_, events_.begin() + static_cast<std::ptrdiff_t>(events),
                           [](const Event& a, const Event& b) {
                             return a.peak != b.peak ? a.peak > b.peak : a.first < b.first;
                           });
  events_.resize(events);
  std::ranges::sort(events_, {}, &Event::first);
  compact();
  return gone;
}

/// Moves the clicks of the events together; the nodes of the few slides stay where they are.
void StepSounds::compact() {
  std::size_t end = 0;
  for (Event& event : events_) {
    const auto first = static_cast<std::ptrdiff_t>(event.first);
    const auto to = static_cast<std::ptrdiff_t>(end);
    std::copy_n(clicks_.begin() + first, event.count, clicks_.begin() + to);
    if (!ears_.empty()) std::copy_n(ears_.begin() + first, event.count, ears_.begin() + to);
    event.first = end;
    end += event.count;
  }
  clicks_.resize(end);
  if (!ears_.empty()) ears_.resize(end);
}

void StepSounds::send() {
  stolen_ += keepLoudest(voices_);
  if (!events_.empty()) faults_ += keepLoudest(queue_.roomForClicks(nodes_.size()));
  for (const Event& event : events_) {
    const bool isPut =
        queue_.put({.peak = event.peak,
                    .clicks = std::span(clicks_).subspan(event.first, event.count),
                    .ears = ears_.empty() ? std::span<const SphereWeights>()
                                          : std::span(ears_).subspan(event.first, event.count),
                    .train = std::span(nodes_).subspan(event.firstNode, event.nodes)});
    if (!isPut) ++faults_;
  }
  queue_.publish();
  events_.clear();
  clicks_.clear();
  ears_.clear();
  nodes_.clear();
}

}  // namespace carom::plugin
