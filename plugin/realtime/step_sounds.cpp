#include "plugin/realtime/step_sounds.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace carom::plugin {

using namespace audio;

void StepSounds::noteLoudness(const ScheduledSound& sound) {
  const double peak = std::max(sound.peak, sound.modalPeak);
  if (!sound.isEvent || !(peak > 0.0)) return;
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

/// Sends what rings on; it has the event's fate where there is no click.
void StepSounds::addRing(const ScheduledSound& sound) {
  ScheduledSound modal = sound;
  modal.clicks = {};
  modal.ears = {};
  modal.isEvent = sound.isEvent && sound.clicks.empty();
  if (queue_.put(modal)) return;
  const bool isMotion = sound.excitations.front().isMotion();
  if (modal.isEvent)
    ++faults_;
  else
    ++(sound.isEvent || isMotion ? ringsLeftOut_ : slidesLeftOut_);
}

void StepSounds::add(const ScheduledSound& sound) {
  noteLoudness(sound);
  if (!sound.excitations.empty()) addRing(sound);
  if (!sound.noise.powers.empty() && !queue_.put(sound)) ++slidesLeftOut_;
  if (sound.clicks.empty()) return;
  events_.push_back({.peak = sound.peak,
                     .first = clicks_.size(),
                     .count = sound.clicks.size(),
                     .firstNode = nodes_.size(),
                     .nodes = sound.train.size(),
                     .isEvent = sound.isEvent});
  clicks_.insert(clicks_.end(), sound.clicks.begin(), sound.clicks.end());
  ears_.insert(ears_.end(), sound.ears.begin(), sound.ears.end());
  nodes_.insert(nodes_.end(), sound.train.begin(), sound.train.end());
  if (events_.size() >= 2 * voices_) keepLoudest(voices_, stolen_);
}

/// Keeps the loudest of the step's sounds, in their order, and counts those that are dropped.
void StepSounds::keepLoudest(std::size_t events, std::uint64_t& eventsLeftOut) {
  if (events_.size() <= events) return;
  std::ranges::nth_element(events_, events_.begin() + static_cast<std::ptrdiff_t>(events),
                           [](const Event& a, const Event& b) {
                             return a.peak != b.peak ? a.peak > b.peak : a.first < b.first;
                           });
  for (const Event& event : std::span(events_).subspan(events))
    ++(event.isEvent ? eventsLeftOut : slidesLeftOut_);
  events_.resize(events);
  std::ranges::sort(events_, {}, &Event::first);
  compact();
}

/// Moves the clicks and nodes of the events together.
void StepSounds::compact() {
  std::size_t end = 0;
  std::size_t endOfNodes = 0;
  for (Event& event : events_) {
    const auto first = static_cast<std::ptrdiff_t>(event.first);
    const auto to = static_cast<std::ptrdiff_t>(end);
    std::copy_n(clicks_.begin() + first, event.count, clicks_.begin() + to);
    if (!ears_.empty()) std::copy_n(ears_.begin() + first, event.count, ears_.begin() + to);
    std::copy_n(nodes_.begin() + static_cast<std::ptrdiff_t>(event.firstNode), event.nodes,
                nodes_.begin() + static_cast<std::ptrdiff_t>(endOfNodes));
    event.first = end;
    end += event.count;
    event.firstNode = endOfNodes;
    endOfNodes += event.nodes;
  }
  nodes_.resize(endOfNodes);
  clicks_.resize(end);
  if (!ears_.empty()) ears_.resize(end);
}

/// Returns how many of the step's sounds the queue has room for.
std::size_t StepSounds::room() const {
  std::size_t lines = 0;
  std::size_t largest = 0;
  for (const Event& event : events_) {
    lines += queue_.linesOfClicks(event.count, event.nodes);
    largest = std::max(largest, event.count);
  }
  return queue_.hasRoom(lines) ? events_.size() : queue_.roomForClicks(largest, nodes_.size());
}

void StepSounds::send() {
  keepLoudest(voices_, stolen_);
  if (!events_.empty()) keepLoudest(room(), faults_);
  for (const Event& event : events_) {
    const bool isPut =
        queue_.put({.peak = event.peak,
                    .clicks = std::span(clicks_).subspan(event.first, event.count),
                    .ears = ears_.empty() ? std::span<const SphereWeights>()
                                          : std::span(ears_).subspan(event.first, event.count),
                    .train = std::span(nodes_).subspan(event.firstNode, event.nodes),
                    .isEvent = event.isEvent});
    if (!isPut) ++(event.isEvent ? faults_ : slidesLeftOut_);
  }
  queue_.publish();
  events_.clear();
  clicks_.clear();
  ears_.clear();
  nodes_.clear();
}

}  // namespace carom::plugin
