#include "plugin/realtime/sound_engine.h"

#include <algorithm>
#include <cassert>
#include <chrono>
#include <cmath>
#include <limits>
#include <utility>

namespace carom::plugin {

using namespace audio;

namespace {

/// Clicks taken out of the queue for each frame that is rendered, so that a burst does not hold up
/// a block.
constexpr std::size_t kArrivalsPerFrame = 16;
/// Rings taken out of the queue for each frame that is rendered.
constexpr std::size_t kRingsPerFrame = 2;
/// s: time constant over which work and time are compared.
constexpr double kMeasuring = 1.0;
/// Least work before the cost estimate is used; then its limits in ns.
constexpr double kEnoughWork = 1e5;
constexpr double kLeastCost = 0.2;
constexpr double kMostCost = 50.0;
constexpr std::size_t kInterleavedFrames = 256;

/// s: longest time beyond the look-ahead for which the nodes of slides are held: a step and the
/// delay of a path.
constexpr double kTrainsHeld = 0.1;
/// s: time whose nodes can cross at once: more than a frame of the host.
constexpr double kTrainsQueued = 0.06;

/// Number of nodes in so many seconds, of both bodies of each sliding contact.
std::size_t nodesOf(const SoundSettings& settings, double seconds) {
  const auto bodies = 2.0 * static_cast<double>(settings.budget.slidingContacts);
  return static_cast<std::size_t>(std::ceil(bodies * settings.synth.sampleRate * seconds));
}

PlayerCapacity capacityOf(const SoundSettings& settings) {
  const VoiceBudget& budget = settings.budget;
  return {.voices = budget.voices,
          .buses = budget.buses,
          // A body that clicks and rings needs its nodes twice.
          .nodes = 2 * nodesOf(settings, settings.latency + kTrainsHeld),
          .longestContact = budget.longestContact,
          .rings = {.banks = budget.ringingBodies,
                    .modes = budget.modes,
                    .rings = 4 * budget.ringingBodies,
                    .longestContact = budget.longestContact}};
}

/// Rounds a number of modes up to whole vectors of resonators, as their taps are.
std::size_t padded(std::size_t modes) {
  constexpr std::size_t kWidth = ResonatorKernels::kWidth;
  return (modes + kWidth - 1) / kWidth * kWidth;
}

/// Twice the number of clicks that may wait in the player.
std::size_t queueCapacity(const SoundSettings& settings, const SoundPaths& paths) {
  const std::size_t perEvent = paths.channels.size() * paths.paths.size() + 1;
  const std::size_t most = capacityOf(settings).clicks;
  return 2 * std::clamp(settings.budget.voices * perEvent, perEvent, std::max(most, perEvent));
}

void scale(std::span<float* const> channels, std::size_t frames, double fullScale) {
  const double perPascal = 1.0 / fullScale;
  for (float* const channel : channels) {
    std::transform(channel, channel + frames, channel, [perPascal](float pressure) {
      return static_cast<float>(perPascal * static_cast<double>(pressure));
    });
  }
}

}  // namespace

Result<std::optional<Limiter>> makeLimiter(const SoundSettings& settings, std::size_t channels) {
  if (!settings.limiter) return std::optional<Limiter>();
  LimiterSettings wanted = *settings.limiter;
  wanted.sampleRate = settings.synth.sampleRate;
  wanted.channels = channels;
  Result<Limiter> made = Limiter::create(wanted);
  if (!made) return made.error();
  return std::optional<Limiter>(*std::move(made));
}

Result<std::unique_ptr<SoundEngine>> SoundEngine::create(const SoundSettings& settings) {
  auto paths = makeSoundPaths(settings.synth, settings.listeners);
  if (!paths) return paths.error();
  Result<std::optional<Limiter>> limiter = makeLimiter(settings, (*paths)->channels.size());
  if (!limiter) return limiter.error();
  return std::unique_ptr<SoundEngine>(new SoundEngine(settings, *paths, *std::move(limiter)));
}

SoundEngine::SoundEngine(const SoundSettings& settings,
                         const std::shared_ptr<const SoundPaths>& paths,
                         std::optional<Limiter> limiter)
    : settings_(settings),
      layer_(paths),
      timeline_(settings.clock, settings.synth.sampleRate, settings.latency),
      queue_(queueCapacity(settings, *paths)),
      rings_(2 * capacityOf(settings).rings.rings),
      taps_(rings_.capacity() * 2 * padded(settings.budget.modes) / kTaps),
      trains_(nodesOf(settings, kTrainsQueued)),
      ringTrains_(nodesOf(settings, kTrainsQueued)),
      gain_(settings.synth.sampleRate),
      player_(paths, capacityOf(settings)),
      limiter_(std::move(limiter)),
      arrived_(player_.clicksPerEvent()),
      arrivedEars_(player_.clicksPerEvent()),
      arrivedRings_(rings_.capacity()),
      arrivedTaps_(taps_.capacity() * kTaps),
      arrivedTrain_(trains_.capacity()),
      planar_(kInterleavedFrames * paths->channels.size()) {
  for (std::size_t channel = 0; channel < paths->channels.size(); ++channel)
    planarChannels_.push_back(&planar_[channel * kInterleavedFrames]);
}

void SoundEngine::post(const ImpulseEvent& event) {
  posted_.push_back(event);
}

void SoundEngine::updateContact(const ContactState& contact) {
  if (layer_.hearsTouches()) touched_.push_back(contact);
}

void SoundEngine::advanceTo(double seconds) {
  const TimelineStep step = timeline_.advance(seconds, rendered());
  counters_.stalls += step == TimelineStep::stalled ? 1 : 0;
  counters_.jumps += step == TimelineStep::jumped ? 1 : 0;
  if (step == TimelineStep::skipped) {
    counters_.skipped += posted_.size();
  } else {
    layTouches();
    for (const ImpulseEvent& event : posted_)
      lay(event);
    send();
  }
  posted_.clear();
  touched_.clear();
}

void SoundEngine::lay(const ImpulseEvent& event) {
  const ScheduledSound sound = layer_.lay(event, timeline_.shiftAt(event.time));
  if (!sound.rings.empty()) sendRings(sound);
  if (sound.clicks.empty()) return;
  keepClicks(sound);
  if (laid_.size() >= 2 * settings_.budget.voices)
    counters_.stolen += keepLoudest(settings_.budget.voices);
}

void SoundEngine::keepClicks(const ScheduledSound& sound) {
  laid_.push_back(
      {sound.peak, laidClicks_.size(), sound.clicks.size(), laidNodes_.size(), sound.train.size()});
  laidClicks_.insert(laidClicks_.end(), sound.clicks.begin(), sound.clicks.end());
  laidEars_.insert(laidEars_.end(), sound.ears.begin(), sound.ears.end());
  laidNodes_.insert(laidNodes_.end(), sound.train.begin(), sound.train.end());
}

/// Lays the lasting contacts of a step. At each moment as many of them slide as the budget allows;
/// a step of the world may be several of its mechanics.
void SoundEngine::layTouches() {
  for (std::size_t first = 0; first < touched_.size();) {
    const std::size_t begin = first;
    std::size_t end = first + 1;
    while (end < touched_.size() && touched_[end].time == touched_[first].time)
      ++end;
    const double least = rankToSlide(std::span(touched_).subspan(first, end - first));
    for (; first < end; ++first)
      layTouch(touched_[first], slideRanks_[first - begin], least);
  }
}

/// Returns the least rank with which a contact of that moment slides; leaves the ranks of all in
/// slideRanks_.
double SoundEngine::rankToSlide(std::span<const ContactState> moment) {
  slideRanks_.clear();
  for (const ContactState& contact : moment)
    slideRanks_.push_back(layer_.slideRank(contact));
  constexpr double kAny = std::numeric_limits<double>::min();
  const std::size_t most = settings_.budget.slidingContacts;
  if (most == 0) return std::numeric_limits<double>::infinity();
  if (slideRanks_.size() <= most) return kAny;
  sortedRanks_ = slideRanks_;
  const auto last = sortedRanks_.begin() + static_cast<std::ptrdiff_t>(most - 1);
  std::ranges::nth_element(sortedRanks_, last, std::ranges::greater{});
  return std::max(*last, kAny);
}

void SoundEngine::layTouch(const ContactState& contact, double rank, double least) {
  SampleShift shift = timeline_.shiftAt(contact.time);
  const ScheduledSound changes = layer_.updateContact(contact, shift);
  for (const ModalExcitation& ring : changes.rings)
    sendRings({.rings = std::span(&ring, 1), .taps = changes.taps});
  if (rank < least) {
    layer_.endSlide(contact);
    counters_.slidesLeftOut += rank > 0.0 ? 1 : 0;
    return;
  }
  const SampleShift end = timeline_.shiftAt(contact.time + contact.duration);
  const double longer =
      static_cast<double>(end.whole - shift.whole) + end.fraction - shift.fraction;
  shift.stretch += longer / (contact.duration * settings_.synth.sampleRate);
  for (const bool first : {true, false}) {
    const ScheduledSound sound = layer_.slide(contact, first, shift);
    if (!sound.rings.empty()) sendRings(sound);
    if (!sound.clicks.empty()) keepClicks(sound);
  }
}

/// Queues rings with as many of the first modes as the player has room for; the audio thread sees
/// them when the step is sent.
void SoundEngine::sendRings(const ScheduledSound& sound) {
  const std::size_t count = std::min(sound.rings.front().count, padded(settings_.budget.modes));
  const std::size_t chunks = sound.rings.size() * 2 * count / kTaps;
  const std::size_t nodes = sound.train.size();
  if (rings_.writable(sound.rings.size()) < sound.rings.size() || taps_.writable(chunks) < chunks ||
      ringTrains_.writable(nodes) < nodes) {
    ++counters_.queueFaults;
    return;
  }
  for (const PulseNode& node : sound.train)
    ringTrains_.put(node);
  for (std::size_t index = 0; index < sound.rings.size(); ++index) {
    ModalExcitation ring = sound.rings[index];
    for (std::size_t at = 0; at < 2 * count; at += kTaps) {
      QueuedTaps chunk;
      for (std::size_t i = 0; i < kTaps; ++i) {
        const std::size_t tap = at + i < count ? at + i : ring.count + at + i - count;
        chunk[i] = sound.taps[ring.taps + tap];
      }
      taps_.put(chunk);
    }
    ring.count = count;
    rings_.put({ring, static_cast<std::uint32_t>(sound.rings.size() - index),
                static_cast<std::uint32_t>(nodes)});
  }
}

/// Keeps the loudest of the step's events; returns how many were dropped.
std::uint64_t SoundEngine::keepLoudest(std::size_t events) {
  if (laid_.size() <= events) return 0;
  const std::uint64_t gone = laid_.size() - events;
  std::ranges::nth_element(laid_, laid_.begin() + static_cast<std::ptrdiff_t>(events),
                           [](const Laid& a, const Laid& b) {
                             return a.peak != b.peak ? a.peak > b.peak : a.first < b.first;
                           });
  laid_.resize(events);
  std::ranges::sort(laid_, {}, &Laid::first);
  std::size_t end = 0;
  for (Laid& laid : laid_) {
    const auto first = static_cast<std::ptrdiff_t>(laid.first);
    const auto to = static_cast<std::ptrdiff_t>(end);
    const auto count = static_cast<std::ptrdiff_t>(laid.count);
    std::copy_n(laidClicks_.begin() + first, count, laidClicks_.begin() + to);
    if (!laidEars_.empty()) std::copy_n(laidEars_.begin() + first, count, laidEars_.begin() + to);
    laid.first = std::exchange(end, end + laid.count);
  }
  laidClicks_.resize(end);
  if (!laidEars_.empty()) laidEars_.resize(end);
  return gone;
}

/// Hands over the step's events: as many as there is room for, the loudest of them.
void SoundEngine::send() {
  counters_.stolen += keepLoudest(settings_.budget.voices);
  const std::size_t room = queue_.writable(laidClicks_.size());
  if (room < laidClicks_.size()) {
    const std::size_t perEvent = player_.clicksPerEvent();
    counters_.queueFaults += keepLoudest(room / perEvent);
  }
  for (const Laid& laid : laid_) {
    if (trains_.writable(laid.nodes) < laid.nodes) {
      ++counters_.queueFaults;
      continue;
    }
    for (std::size_t i = 0; i < laid.nodes; ++i)
      trains_.put(laidNodes_[laid.firstNode + i]);
    for (std::size_t i = 0; i < laid.count; ++i) {
      const std::size_t at = laid.first + i;
      queue_.put({laidClicks_[at], laidEars_.empty() ? SphereWeights{} : laidEars_[at], laid.peak,
                  static_cast<std::uint32_t>(laid.count - i),
                  static_cast<std::uint32_t>(laid.nodes)});
    }
  }
  trains_.publish();  // before the clicks that need them
  queue_.publish();
  ringTrains_.publish();
  taps_.publish();
  rings_.publish();
  laid_.clear();
  laidClicks_.clear();
  laidEars_.clear();
  laidNodes_.clear();
}

SoundStatistics SoundEngine::statistics() const {
  SoundStatistics all = counters_;
  const ContactSoundCounters& layer = layer_.counters();
  all.events = layer.events;
  all.immovable = layer.immovable;
  all.rejected = layer.rejected;
  all.inaudible = layer.inaudible;
  constexpr auto kRelaxed = std::memory_order_relaxed;
  all.stolen += shared_.stolen.load(kRelaxed);
  all.late = shared_.late.load(kRelaxed);
  all.overBudget = shared_.overBudget.load(kRelaxed);
  all.noBus = shared_.noBus.load(kRelaxed);
  all.tooLong = shared_.tooLong.load(kRelaxed);
  all.rings = layer.rings;
  all.slides = layer.slides;
  all.slidesInaudible = layer.inaudibleSlides;
  all.slidesLeftOut += shared_.noTrain.load(kRelaxed);
  all.modalVoicesExhausted = shared_.modalVoicesExhausted.load(kRelaxed);
  all.ringing = shared_.banks.load(kRelaxed);
  all.modes = shared_.modes.load(kRelaxed);
  all.voices = shared_.voices.load(kRelaxed);
  all.buses = shared_.buses.load(kRelaxed);
  all.cpuShare = shared_.cpuShare.load(kRelaxed);
  all.worstBlock = shared_.worstBlock.load(kRelaxed);
  all.gainReduction = shared_.gainReduction.load(kRelaxed);
  return all;
}

void SoundEngine::render(std::span<float* const> channels, std::size_t frames) noexcept {
  if (frames == 0) return;
  const auto begin = std::chrono::steady_clock::now();
  receive(frames);
  receiveRings(frames);
  player_.render<float>(channels, frames);
  if (settings_.fullScale) scale(channels, frames, *settings_.fullScale);
  gain_.apply(channels, frames);
  if (limiter_) limiter_->process(channels, frames);
  rendered_.store(player_.position(), std::memory_order_release);
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begin;
  measure(taken.count(), frames);
  publish();
}

/// Moves events from the queue into the player.
void SoundEngine::receive(std::size_t frames) noexcept {
  const std::size_t most = std::max(kArrivalsPerFrame * frames, arrived_.size());
  const bool hasEars = layer_.paths().hasHeads;
  for (std::size_t taken = 0; queue_.readable(1) > 0;) {
    const std::size_t count = queue_.peek().ofEvent;
    if (taken + count > most) break;
    assert(queue_.readable(count) >= count);  // published together
    for (std::size_t i = 0; i < count; ++i) {
      arrived_[i] = queue_.peek(i).click;
      if (hasEars) arrivedEars_[i] = queue_.peek(i).ears;
    }
    player_.add({.peak = queue_.peek().peak,
                 .clicks = std::span(arrived_).first(count),
                 .ears = std::span(arrivedEars_).first(hasEars ? count : 0),
                 .train = arrivedTrain(trains_, queue_.peek().nodes)});
    queue_.drop(count);
    taken += count;
  }
}

/// Takes the next nodes out of a queue; they are valid until the next call.
std::span<const PulseNode> SoundEngine::arrivedTrain(SpscQueue<PulseNode>& from,
                                                     std::size_t nodes) noexcept {
  [[maybe_unused]] const std::size_t there = from.readable(nodes);
  assert(there >= nodes);  // published before the event that has them
  for (std::size_t i = 0; i < nodes; ++i)
    arrivedTrain_[i] = from.peek(i);
  from.drop(nodes);
  return std::span(arrivedTrain_).first(nodes);
}

void SoundEngine::receiveRings(std::size_t frames) noexcept {
  for (std::size_t taken = 0; taken < kRingsPerFrame * frames && rings_.readable(1) > 0;) {
    const std::size_t rings = rings_.peek().ofEvent;
    const std::size_t count = rings_.peek().ring.count;
    const std::size_t chunks = rings * 2 * count / kTaps;
    [[maybe_unused]] const std::size_t there = taps_.readable(chunks);
    assert(there >= chunks && rings_.readable(rings) >= rings);  // published together
    for (std::size_t i = 0; i < rings; ++i) {
      arrivedRings_[i] = rings_.peek(i).ring;
      arrivedRings_[i].taps = i * 2 * count;
    }
    for (std::size_t chunk = 0; chunk < chunks; ++chunk)
      std::ranges::copy(taps_.peek(chunk),
                        arrivedTaps_.begin() + static_cast<std::ptrdiff_t>(chunk * kTaps));
    player_.add({.rings = std::span(arrivedRings_).first(rings),
                 .taps = arrivedTaps_,
                 .train = arrivedTrain(ringTrains_, rings_.peek().nodes)});
    rings_.drop(rings);
    taps_.drop(chunks);
    taken += rings;
  }
}

/// Measures what work costs on this machine, and sets how much of it may be done.
void SoundEngine::measure(double seconds, std::size_t frames) noexcept {
  const double duration = static_cast<double>(frames) / settings_.synth.sampleRate;
  const double fading = std::exp(-duration / kMeasuring);
  const double share = seconds / duration;
  cpuShare_ = fading * cpuShare_ + (1.0 - fading) * share;
  worstBlock_ = std::max(worstBlock_, share);
  measuredTime_ = fading * measuredTime_ + seconds;
  const double work = player_.takeWork();
  measuredWork_ = fading * measuredWork_ + work;
  if (measuredWork_ < kEnoughWork) return;
  const double cost = std::clamp(1e9 * measuredTime_ / measuredWork_, kLeastCost, kMostCost);
  player_.setAllowance(settings_.budget.cpuShare * 1e9 / cost);
}

void SoundEngine::publish() noexcept {
  constexpr auto kRelaxed = std::memory_order_relaxed;
  const ClickRendererCounters& player = player_.counters();
  shared_.late.store(player.late, kRelaxed);
  shared_.stolen.store(player.stolen, kRelaxed);
  shared_.overBudget.store(player.overBudget, kRelaxed);
  shared_.noBus.store(player.noBus, kRelaxed);
  shared_.tooLong.store(player.tooLong, kRelaxed);
  shared_.noTrain.store(player.noTrain, kRelaxed);
  const ModalBank& rings = player_.rings();
  shared_.modalVoicesExhausted.store(rings.counters().modalVoicesExhausted, kRelaxed);
  shared_.banks.store(rings.banksInUse(), kRelaxed);
  shared_.modes.store(rings.resonatorsInUse(), kRelaxed);
  shared_.voices.store(player_.voices(), kRelaxed);
  shared_.buses.store(player_.busesInUse(), kRelaxed);
  shared_.cpuShare.store(cpuShare_, kRelaxed);
  shared_.worstBlock.store(worstBlock_, kRelaxed);
  if (limiter_) shared_.gainReduction.store(limiter_->largestReduction(), kRelaxed);
}

void SoundEngine::renderInterleaved(float* samples, std::size_t frames) noexcept {
  const std::size_t channels = planarChannels_.size();
  for (std::size_t done = 0; done < frames;) {
    const std::size_t part = std::min(kInterleavedFrames, frames - done);
    render(planarChannels_, part);
    for (std::size_t channel = 0; channel < channels; ++channel)
      for (std::size_t frame = 0; frame < part; ++frame)
        samples[(done + frame) * channels + channel] = planarChannels_[channel][frame];
    done += part;
  }
}

}  // namespace carom::plugin
