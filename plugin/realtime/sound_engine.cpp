#include "plugin/realtime/sound_engine.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <utility>

#include "audio/run/open_contacts.h"
#include "plugin/realtime/statistics_fields.h"

namespace carom::plugin {

using namespace audio;

namespace {

/// Work taken out of the queue for each frame that is rendered, in clicks, so that a burst does not
/// hold up a block; and the work of an excitation of modes.
constexpr std::size_t kArrivalsPerFrame = 16;
constexpr std::size_t kExcitationWork = 8;
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

/// Levels of noise that can cross at once: a step of the world may be many of its mechanics.
constexpr std::size_t kLevelsQueued = 64;

/// Number of nodes in so many seconds, of both bodies of each sliding contact, and of impacts on as
/// many bodies as may ring.
std::size_t nodesOf(const SoundSettings& settings, double seconds) {
  const auto bodies = 2.0 * static_cast<double>(settings.budget.slidingContacts);
  const double ofSlides = std::ceil(bodies * settings.synth.sampleRate * seconds);
  return static_cast<std::size_t>(ofSlides) + kMostImpactNodes * settings.budget.ringingBodies;
}

/// Longest part of a step of a slide, as a share of the longest contact that the synth takes: a
/// longer step is sent in parts.
constexpr double kLongestStep = 0.9;

/// Ways of rings, from a body to a channel, that are followed as they move: a motion costs as much
/// as the mode's resonators in some hundred samples.
std::size_t followedWays(const SoundSettings& settings) {
  return std::max<std::size_t>(settings.budget.ringingBodies / 4, 1);
}
/// Motions of a way that may wait for what is told ahead and a sound's way: most are of 512
/// samples.
std::size_t motionsPerWay(const SoundSettings& settings) {
  constexpr double kWay = 0.1;  // s
  const double waiting = (settings.latency + kWay) * settings.synth.sampleRate;
  return 8 + static_cast<std::size_t>(std::ceil(waiting / 256.0));
}

/// Returns the number of recoils that can be heard at a time: as many as half of the buses suffice
/// for, as each of its poles has a bus for each channel and chain of walls.
std::size_t recoilsOf(const SoundSettings& settings, const SoundPaths& paths) {
  const std::size_t each = RecoilFilters::kMost * paths.channels.size() * paths.chains.size();
  return settings.budget.buses / 2 / each;
}

std::size_t clicksPerWay(const SoundSettings& settings, const SoundPaths& paths) {
  return recoilsOf(settings, paths) > 0 ? RecoilFilters::kMost : 1;
}

RendererCapacity rendererCapacity(const SoundSettings& settings, const SoundPaths& paths) {
  const VoiceBudget& budget = settings.budget;
  return {.voices = budget.voices,
          .clicksPerWay = clicksPerWay(settings, paths),
          .buses = budget.buses,
          // A body that clicks and rings needs its nodes twice.
          .nodes = 2 * nodesOf(settings, settings.latency + kTrainsHeld),
          .longestContact = budget.longestContact,
          .modes = {.banks = budget.ringingBodies,
                    .modes = budget.modes,
                    .excitations = 4 * budget.ringingBodies,
                    .motions = motionsPerWay(settings) * followedWays(settings),
                    .dampings = 4 * budget.ringingBodies,
                    .longestContact = budget.longestContact}};
}

/// Returns twice of what may wait in the renderer.
SoundQueue::Capacity queueCapacity(const SoundSettings& settings, const SoundPaths& paths) {
  const RendererCapacity renderer = rendererCapacity(settings, paths);
  const std::size_t perEvent = paths.channels.size() * paths.paths.size() + 1;
  const std::size_t clicks =
      std::clamp(renderer.voices * perEvent, perEvent, std::max(renderer.clicks, perEvent));
  const std::size_t nodes = nodesOf(settings, kTrainsQueued);
  return {.clicks = renderer.clicksPerWay * perEvent,
          .excitations = perEvent,
          .modes = ResonatorKernels::padded(settings.budget.modes),
          .nodes = nodes,
          .waitingClicks = 2 * clicks,
          .waitingExcitations =
              2 * renderer.modes.excitations + renderer.modes.motions + renderer.modes.dampings,
          .waitingNodes = 2 * nodes,
          .hasEars = paths.hasHeads,
          .powers = (paths.channels.size() + 1) * kThirdOctaves,
          .waitingLevels = kLevelsQueued};
}

void scale(std::span<float* const> channels, std::size_t frames, double fullScale) {
  const double perPascal = 1.0 / fullScale;
  for (float* const channel : channels) {
    std::transform(channel, channel + frames, channel, [perPascal](float pressure) {
      return static_cast<float>(perPascal * static_cast<double>(pressure));
    });
  }
}

double loudestOf(std::span<float* const> channels, std::size_t frames) {
  float loudest = 0.0F;
  for (const float* const channel : channels)
    for (std::size_t frame = 0; frame < frames; ++frame)
      loudest = std::max(loudest, std::abs(channel[frame]));
  return static_cast<double>(loudest);
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
  SynthSettings synth = settings.synth;
  synth.slideVoices = std::min(synth.slideVoices, settings.budget.slidingContacts);
  auto paths = makeSoundPaths(synth, settings.listeners);
  if (!paths) return paths.error();
  Result<std::optional<Limiter>> limiter = makeLimiter(settings, (*paths)->channels.size());
  if (!limiter) return limiter.error();
  return std::unique_ptr<SoundEngine>(new SoundEngine(settings, *paths, *std::move(limiter)));
}

SoundEngine::SoundEngine(const SoundSettings& settings,
                         const std::shared_ptr<const SoundPaths>& paths,
                         std::optional<Limiter> limiter)
    : settings_(settings),
      scheduler_(paths),
      timeline_(settings.clock, settings.synth.sampleRate, settings.latency),
      queue_(queueCapacity(settings, *paths)),
      step_(queue_, settings.budget.voices),
      gain_(settings.synth.sampleRate),
      renderer_(paths, rendererCapacity(settings, *paths)),
      limiter_(std::move(limiter)),
      planar_(kInterleavedFrames * paths->channels.size()) {
  // Each path of a way has to be looked at.
  const std::size_t ways = 8 * followedWays(settings) / (7 + paths->paths.size());
  scheduler_.followLive(std::max(ways, paths->channels.size()));
  scheduler_.limitRecoils(recoilsOf(settings, *paths));
  scheduler_.limitSteps(kLongestStep * settings.budget.longestContact);
  if (settings_.level == Level::automatic) exposure_.emplace(settings_.synth.sampleRate);
  for (std::size_t channel = 0; channel < paths->channels.size(); ++channel)
    planarChannels_.push_back(&planar_[channel * kInterleavedFrames]);
}

/// True if a change of a body waits.
bool SoundEngine::changes(BodyId id) const {
  return std::ranges::any_of(changes_, [id](const BodyChange& change) { return change.id == id; });
}

Status SoundEngine::setBody(BodyId id, const SoundBody& body) {
  if (!changes(id)) return scheduler_.setBody(id, body);
  changes_.push_back({events_.size(), id, body});
  return std::monostate{};
}

void SoundEngine::removeBody(BodyId id) {
  if (events_.empty() && contacts_.empty() && changes_.empty()) return scheduler_.removeBody(id);
  changes_.push_back({events_.size(), id});
}

void SoundEngine::moveBody(BodyId id, const ListenerPose& pose) {
  if (!changes(id)) return (void)scheduler_.moveBody(id, pose);
  changes_.push_back({events_.size(), id, std::nullopt, pose});
}

/// Makes the changes of bodies that came before an event of the step in hand.
void SoundEngine::changeBodies(std::size_t event) {
  for (; !changes_.empty() && changes_.front().after <= event; changes_.pop_front()) {
    const BodyChange& change = changes_.front();
    if (change.body)
      (void)scheduler_.setBody(change.id, *change.body);  // has been validated
    else if (change.pose)
      (void)scheduler_.moveBody(change.id, *change.pose);
    else
      scheduler_.removeBody(change.id);
  }
}

void SoundEngine::post(const ImpulseEvent& event) {
  ++counters_.posted;
  events_.push_back(event);
}

void SoundEngine::updateContact(const ContactState& contact) {
  if (!scheduler_.hearsContacts()) return;
  // The contacts of a step are scheduled before its events, at which bodies change.
  const bool isLater = !changes_.empty() && (changes(contact.body) || changes(contact.other));
  (isLater ? later_ : contacts_).push_back(contact);
}

void SoundEngine::advanceTo(double seconds) {
  const SoundTimeline before = timeline_;
  const TimelineStep step = timeline_.advance(seconds, rendered());
  counters_.stalls += step == TimelineStep::stalled ? 1 : 0;
  counters_.jumps += step == TimelineStep::jumped ? 1 : 0;
  if (step == TimelineStep::skipped) {
    skipStep(seconds);
  } else {
    scheduleStep(seconds, before);
    exposeStep(std::exchange(time_, seconds), seconds);
  }
  time_ = seconds;
  changeBodies(events_.size());
  events_.clear();
  contacts_.clear();
  std::swap(contacts_, later_);
}

/// Lets a step pass unheard, but for what its contacts damp from then on.
void SoundEngine::skipStep(double seconds) {
  counters_.skipped += events_.size();
  for (const ContactState& contact : contacts_)
    skipped_.insert_or_assign({contact.body, contact.other}, contact);
  if (seconds > time_) scheduler_.leap(seconds - time_);  // what rings does so meanwhile
}

/// Schedules the step that ends at `seconds`. Where the clock has leapt in it, what was posted
/// before is still of the time line before.
void SoundEngine::scheduleStep(double seconds, const SoundTimeline& before) {
  const auto isOld = [&](double time) {
    return seconds < time_ && isBeforeLeap(time, time_, seconds);
  };
  for (const auto& [pair, contact] : std::exchange(skipped_, {}))
    scheduler_.updateDamping(stillAt(contact, time_), timeline_.shiftAt(time_), step_);
  std::erase_if(contacts_, [&](const ContactState& contact) {
    if (!isOld(contact.time)) return false;
    scheduler_.updateDamping(contact, before.shiftAt(contact.time), step_);
    return true;
  });
  updateContacts();
  for (std::size_t index = 0; index < events_.size(); ++index) {
    changeBodies(index);
    const ImpulseEvent& event = events_[index];
    const SoundTimeline& timeline = isOld(event.time) ? before : timeline_;
    scheduler_.schedule(event, timeline.shiftAt(event.time), step_);
  }
  scheduler_.finishMoment(step_);
  followRings(seconds);
  step_.send();
}

/// Sends how rings are heard, up to the step before: poses of listeners are known up to there.
void SoundEngine::followRings(double seconds) {
  const double known = std::min(time_, seconds);
  SampleShift shift = timeline_.shiftAt(known);
  if (known < seconds) shift.stretch = stretchOver(known, seconds);
  scheduler_.advanceTo(known, shift, step_);
}

/// Returns how long a time of the simulation lasts on the samples, over its own length.
double SoundEngine::stretchOver(double from, double to) const {
  const SampleShift begin = timeline_.shiftAt(from);
  const SampleShift end = timeline_.shiftAt(to);
  const double longer =
      static_cast<double>(end.whole - begin.whole) + end.fraction - begin.fraction;
  return 1.0 + longer / ((to - from) * settings_.synth.sampleRate);
}

void SoundEngine::predict(double pressure) {
  if (exposure_) exposure_->predict(pressure);
}

/// Tells an automatic level of the step and of its loudest impact.
void SoundEngine::exposeStep(double from, double to) {
  const StepSounds::Loudest loudest = step_.takeLoudest();
  if (!exposure_) return;
  const double rate = settings_.synth.sampleRate;
  const SampleTime end = shifted(samplesOf(to, 0.0, rate), timeline_.shiftAt(to));
  const double length = std::clamp((to - from) * rate, 0.0, rate);
  exposure_->advance(end.whole - std::llround(length), end.whole);
  if (loudest.peak > 0.0) exposure_->expect(loudest.first, loudest.peak);
}

/// Schedules the lasting contacts of a step. At each moment as many of them slide as the budget
/// allows; a step of the world may be several of its mechanics.
void SoundEngine::updateContacts() {
  for (std::size_t first = 0; first < contacts_.size();) {
    const std::size_t begin = first;
    std::size_t end = first + 1;
    while (end < contacts_.size() && contacts_[end].time == contacts_[first].time)
      ++end;
    const double least = rankToSlide(std::span(contacts_).subspan(first, end - first));
    for (; first < end; ++first)
      updateContact(contacts_[first], slideRanks_[first - begin], least);
  }
}

/// Returns the least rank with which a contact of that moment slides; leaves the ranks of all in
/// slideRanks_.
double SoundEngine::rankToSlide(std::span<const ContactState> moment) {
  constexpr double kAny = std::numeric_limits<double>::min();
  const std::size_t most = settings_.budget.slidingContacts;
  slideRanks_.clear();
  if (most > 0 && scheduler_.choosesSlides()) {
    slideRanks_.resize(moment.size(), kAny);
    return kAny;
  }
  for (const ContactState& contact : moment)
    slideRanks_.push_back(scheduler_.slideRank(contact));
  if (most == 0) return std::numeric_limits<double>::infinity();
  if (slideRanks_.size() <= most) return kAny;
  sortedRanks_ = slideRanks_;
  const auto last = sortedRanks_.begin() + static_cast<std::ptrdiff_t>(most - 1);
  std::ranges::nth_element(sortedRanks_, last, std::ranges::greater{});
  return std::max(*last, kAny);
}

void SoundEngine::updateContact(const ContactState& contact, double rank, double least) {
  SampleShift shift = timeline_.shiftAt(contact.time);
  if (rank < least) {
    scheduler_.updateDamping(contact, shift, step_);
    counters_.slidesLeftOut += rank > 0.0 ? 1 : 0;
    return;
  }
  shift.stretch = stretchOver(contact.time, contact.time + contact.duration);
  scheduler_.updateContact(contact, shift, step_);
}

/// Returns what the audio thread has counted.
SynthCounters SoundEngine::rendererCounters() const {
  SynthCounters counts;
  for (std::size_t index = 0; index < kRendererCounts.size(); ++index)
    counts.*kRendererCounts[index] = shared_.counts[index].load(std::memory_order_relaxed);
  return counts;
}

SoundStatistics SoundEngine::statistics() const {
  SoundStatistics all = counters_;
  // First what the audio thread has counted, so that no more has begun than was scheduled.
  const SynthCounters rendered = rendererCounters();
  static_cast<SynthCounters&>(all) += scheduler_.counters() + rendered;
  all.stolen += step_.stolen();
  all.queueFaults += step_.faults();
  all.slidesLeftOut += step_.slidesLeftOut();
  all.modalVoicesExhausted += step_.ringsLeftOut();
  all.waiting = waitingShares(all);
  constexpr auto kRelaxed = std::memory_order_relaxed;
  all.ringing = shared_.banks.load(kRelaxed);
  all.modes = shared_.modes.load(kRelaxed);
  all.voices = shared_.voices.load(kRelaxed);
  all.buses = shared_.buses.load(kRelaxed);
  all.cpuShare = shared_.cpuShare.load(kRelaxed);
  all.worstBlock = shared_.worstBlock.load(kRelaxed);
  all.gainReduction = shared_.gainReduction.load(kRelaxed);
  all.peak = shared_.peak.load(kRelaxed);
  if (!exposure_ && !settings_.fullScale) return all;  // samples are pascals
  all.peakSample = shared_.peakSample.load(kRelaxed);
  if (!exposure_)
    all.warning = peakWarning(all.peakSample, *settings_.fullScale, limiter_.has_value());
  return all;
}

void SoundEngine::render(std::span<float* const> channels, std::size_t frames) noexcept {
  if (frames == 0) return;
  const auto begin = std::chrono::steady_clock::now();
  receive(frames);
  renderer_.render<float>(channels, frames);
  peak_ = std::max(peak_, loudestOf(channels, frames));
  if (exposure_)
    exposure_->apply(channels, frames, rendered_.load(std::memory_order_relaxed));
  else if (settings_.fullScale)
    scale(channels, frames, *settings_.fullScale);
  gain_.apply(channels, frames);
  peakSample_ = std::max(peakSample_, loudestOf(channels, frames));
  if (limiter_) limiter_->process(channels, frames);
  rendered_.store(renderer_.position(), std::memory_order_release);
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begin;
  measure(taken.count(), frames);
  publish();
}

/// Moves sounds from the queue into the renderer.
void SoundEngine::receive(std::size_t frames) noexcept {
  const std::size_t most = kArrivalsPerFrame * frames;
  for (std::size_t taken = 0; taken < most;) {
    const ScheduledSound* const sound = queue_.take();
    if (sound == nullptr) return;
    renderer_.add(*sound);
    taken += sound->clicks.size() + kExcitationWork * sound->excitations.size();
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
  const double work = renderer_.takeWork();
  if (settings_.clock == SoundClock::simulation) return;  // has all the time, and is repeatable
  measuredWork_ = fading * measuredWork_ + work;
  if (measuredWork_ < kEnoughWork) return;
  const double cost = std::clamp(1e9 * measuredTime_ / measuredWork_, kLeastCost, kMostCost);
  renderer_.setAllowance(settings_.budget.cpuShare * 1e9 / cost);
}

void SoundEngine::publish() noexcept {
  constexpr auto kRelaxed = std::memory_order_relaxed;
  const SynthCounters counts = renderer_.counters();
  for (std::size_t index = 0; index < kRendererCounts.size(); ++index)
    shared_.counts[index].store(counts.*kRendererCounts[index], kRelaxed);
  const ModalBank& modes = renderer_.modalBank();
  shared_.banks.store(modes.banksInUse(), kRelaxed);
  shared_.modes.store(modes.resonatorsInUse(), kRelaxed);
  shared_.voices.store(renderer_.voices(), kRelaxed);
  shared_.buses.store(renderer_.busesInUse(), kRelaxed);
  shared_.cpuShare.store(cpuShare_, kRelaxed);
  shared_.worstBlock.store(worstBlock_, kRelaxed);
  shared_.peak.store(peak_, kRelaxed);
  shared_.peakSample.store(peakSample_, kRelaxed);
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
