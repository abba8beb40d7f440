#include "audio/synthesis/click_renderer.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <tuple>
#include <utility>

#include "audio/dsp/spread_kernel.h"
#include "audio/propagation/hrtf.h"

namespace carom::audio {
namespace {

/// Frames summed in double before they are handed on: few enough to stay in the first cache.
constexpr std::size_t kMixFrames = ClickBus::kMaxFrames;

// Rough costs for `work`, in nanoseconds on a machine whose widest vectors have four doubles.
constexpr double kArrivalWork = 100.0;
constexpr double kClickWork = 120.0;
constexpr double kSampleWork = 0.7;     // per sample and filter
constexpr double kNodeWork = 6.0;       // per node, or per sample of a long one
constexpr double kResponseWork = 0.1;   // per sample and tap of an ear, or of the air
constexpr double kAirWork = 0.3;        // per square of the air's taps
constexpr double kBusWork = 8.0;        // per sample and bus that is not silent
constexpr double kResonatorWork = 0.2;  // per sample and mode
constexpr double kReverbWork = 60.0;    // per sample and channel

/// Levels of noise that may wait in a renderer with a capacity: more than a second of steps.
constexpr std::size_t kNoiseLevels = 512;
constexpr double kNoiseWork = 10.0;  // per sample and channel

/// Prefetches an object that will be read soon.
template <class T>
void prefetch(const T& object) {
#if defined(__GNUC__)
  const auto* bytes = reinterpret_cast<const std::byte*>(&object);
  for (std::size_t at = 0; at < sizeof(T); at += 64)
    __builtin_prefetch(bytes + at);
#else
  static_cast<void>(object);
#endif
}

}  // namespace

ClickRenderer::ClickRenderer(std::shared_ptr<const SoundPaths> paths,
                             std::optional<RendererCapacity> capacity)
    : paths_(std::move(paths)),
      capacity_(capacity),
      settings_(paths_->settings),
      modalBank_(paths_, capacity_ ? std::optional(capacity_->modes) : std::nullopt),
      trains_(capacity_ ? std::optional(capacity_->nodes) : std::nullopt),
      sampler_(settings_.comparison.sampling, kernels_),
      ear_(paths_->longestResponse),
      air_(paths_->air ? paths_->air->mostTaps() : 0),
      response_(ear_.size() + air_.size()),
      mix_(kMixFrames * paths_->channels.size()),
      send_(kMixFrames) {
  SpreadTable::instance();  // made now, not while rendering
  if (settings_.reverb) {
    std::size_t first = 0;  // channel of the listener
    for (const Listener& listener : paths_->listeners) {
      Reverb& reverb = reverbs_.emplace_back(paths_->reverbs.at(channelCount(listener)));
      for (std::size_t channel = 0; channel < reverb.channels(); ++channel)
        reverb.setPattern(channel, paths_->channels[first + channel].receiver.pattern);
      first += reverb.channels();
    }
  }
  if (settings_.lasting == LastingDetail::heard) {
    const std::size_t sends = reverbs_.empty() ? 0 : 1;
    bed_.emplace(settings_.sampleRate, paths_->channels.size() + sends,
                 capacity_ ? std::optional(kNoiseLevels) : std::nullopt);
  }
  if (capacity_) makeRoom();
}

/// Allocates all the memory that a renderer with a capacity ever has.
void ClickRenderer::makeRoom() {
  const Pulse& pulse = Pulse::of(settings_.comparison.pulse);
  const double longest =
      (pulse.end() - pulse.begin()) * capacity_->longestContact * settings_.sampleRate;
  const std::size_t perEvent = clicksPerEvent();
  const std::size_t most = capacity_->clicksPerWay * perEvent;
  slots_ = std::min(capacity_->voices * perEvent, std::max(capacity_->clicks, perEvent));
  slots_ = std::max(slots_, most);
  voices_.reserve(capacity_->voices, slots_);
  chosen_.reserve(capacity_->voices);
  arriving_.reserve(most);
  clicks_.reserve(slots_);
  freeSlots_.reserve(slots_);
  if (paths_->hasHeads) ears_.resize(slots_);
  waiting_.reserve(slots_);
  busOrder_.reserve(capacity_->buses);
  buses_.reserve(capacity_->buses);
  Click longestClick;
  longestClick.samples = static_cast<std::uint32_t>(longest) + 2 * kSpreadWidth;
  longestClick.air = paths_->air ? 1 : 0;
  reserveScratch(longestClick);
  const std::size_t longestTrain = std::max<std::size_t>(longestClick.samples, kMostImpactNodes);
  mostNodes_ = std::min(capacity_->nodes, longestTrain);
  sampler_.reserve(std::max(kMostNodes, mostNodes_), longestClick.samples);
  const auto& longestChain =
      *std::ranges::max_element(paths_->chains, {}, [](const auto& chain) { return chain.size(); });
  for (std::size_t bus = 0; bus < capacity_->buses; ++bus) {
    buses_.push_back({ClickBus(kernels_), 0, 0});
    buses_.back().line.restart({.reflections = longestChain}, position_);
    buses_.back().line.reserve(kMixFrames, mostSamples_);
  }
}

std::size_t ClickRenderer::clicksPerEvent() const {
  return paths_->channels.size() * paths_->paths.size() + (reverbs_.empty() ? 0 : 1);
}

/// Samples that a click may need on a bus, the responses of an ear and the air included.
std::size_t ClickRenderer::roomOf(const Click& click) const {
  return click.samples + ear_.size() + (click.air != 0 ? air_.size() : 0);
}

void ClickRenderer::add(const ScheduledSound& sound) {
  if (!sound.noise.powers.empty()) {
    if (bed_ && !bed_->add(sound.noise)) ++counters_.slidesLeftOut;
    return;
  }
  ScheduledSound kept = sound;
  if (!sound.train.empty() && !(sound.clicks.empty() && sound.excitations.empty())) {
    const bool isTooLong = capacity_ && sound.train.size() > mostNodes_;
    if (!isTooLong) kept.train = keptTrain(sound);
    if (isTooLong || kept.train.empty())
      return leaveOut(isTooLong ? &SynthCounters::tooLong : &SynthCounters::overBudget,
                      sound.isEvent);
  }
  if (!kept.clicks.empty()) addClicks(kept);
  kept.isEvent = sound.isEvent && sound.clicks.empty();
  if (!kept.excitations.empty()) modalBank_.add(kept);
}

/// Returns a copy of the sound's nodes that lives until all clicks and excitations of it have
/// begun.
std::span<const PulseNode> ClickRenderer::keptTrain(const ScheduledSound& sound) {
  std::int64_t first = std::numeric_limits<std::int64_t>::max();
  std::int64_t last = position_;
  const auto include = [&](const Click& click) {
    first = std::min(first, click.first);
    last = std::max(last, click.first);
  };
  std::ranges::for_each(sound.clicks, include);
  std::ranges::for_each(sound.excitations, include, &ModalExcitation::drive);
  last += std::max<std::int64_t>(0, position_ - first);  // a late sound begins later by as much
  return trains_.keep(sound.train, last, position_);
}

void ClickRenderer::addClicks(const ScheduledSound& sound) {
  const auto first = std::ranges::min_element(sound.clicks, {}, &Click::first)->first;
  if (first < position_) ++counters_.late;
  if (capacity_ && isTooLong(sound)) return leaveOut(&SynthCounters::tooLong, sound.isEvent);
  if (!arrive(sound)) return leaveOut(&SynthCounters::noBus, sound.isEvent);
  if (capacity_ && !makePlace(sound)) {
    for (const Click& click : arriving_)
      leaveBuses(click);
    return;
  }
  spend(kArrivalWork * static_cast<double>(arriving_.size()));
  const std::int64_t delay = capacity_ ? std::max<std::int64_t>(0, position_ - first) : 0;
  const std::uint32_t voice = capacity_ ? voices_.add(sound.peak, sound.isEvent) : kNone;
  for (Click& click : arriving_)
    click.first += delay;
  if (sound.isEvent) chooseLeader();
  for (std::size_t index = 0; index < arriving_.size(); ++index) {
    const Click& click = arriving_[index];
    if (isOver(click))
      leaveBuses(click);
    else
      enqueue(click, sound.ears.empty() ? nullptr : &sound.ears[index], voice);
  }
}

/// Marks the first of the event's clicks that can be heard; without one the event is lost.
void ClickRenderer::chooseLeader() noexcept {
  Click* leader = nullptr;
  for (Click& click : arriving_)
    if (!isOver(click) && (leader == nullptr || click.first < leader->first)) leader = &click;
  if (leader != nullptr)
    leader->isLeader = true;
  else
    ++counters_.lost;
}

/// True if no sample of the click can be heard any more.
bool ClickRenderer::isOver(const Click& click) const {
  const auto oldest = position_ - static_cast<std::int64_t>(ClickBus::kHistory);
  return click.first + static_cast<std::int64_t>(roomOf(click)) <= oldest;
}

bool ClickRenderer::isTooLong(const ScheduledSound& sound) const {
  // The contact's length decides, and not what its clicks pass.
  return std::ranges::any_of(sound.clicks, [this](const Click& click) {
    return click.samples + response_.size() > mostSamples_;
  });
}

/// Drops quieter events until the sound has room; false if there is no room and nothing quieter.
bool ClickRenderer::makePlace(const ScheduledSound& sound) noexcept {
  while (voices_.isFull() || waiting_.size() + sound.clicks.size() > slots_) {
    const std::uint32_t quietest = voices_.quietest();
    const bool isQuieter = quietest == kNone || voices_.peak(quietest) >= sound.peak;
    leaveOut(&SynthCounters::stolen, isQuieter ? sound.isEvent : voices_.isEvent(quietest));
    if (isQuieter) return false;
    dropFrom(quietest, position_);
  }
  return true;
}

/// Removes the clicks of an event that begin at `from` or later. The event goes with its last
/// click.
void ClickRenderer::dropFrom(std::uint32_t voice, std::int64_t from) noexcept {
  for (std::uint32_t slot = voices_.firstSlot(voice); slot != kNone;) {
    const std::uint32_t next = voices_.nextSlot(slot);
    if (clicks_[slot].first >= from) {
      waiting_.remove(slot);
      leaveBuses(clicks_[slot]);
      voices_.detach(slot);
      freeSlots_.push_back(slot);
    }
    slot = next;
  }
}

/// Puts the clicks of an event with their buses into arriving_; false, with no bus taken, if one of
/// them finds no bus.
bool ClickRenderer::arrive(const ScheduledSound& sound) {
  arriving_.assign(sound.clicks.begin(), sound.clicks.end());
  if (!sound.train.empty())
    for (Click& click : arriving_)
      click.nodes = sound.train;
  for (std::size_t index = 0; index < arriving_.size(); ++index) {
    if (findBuses(arriving_[index])) continue;
    for (std::size_t found = 0; found < index; ++found)
      leaveBuses(arriving_[found]);
    return false;
  }
  return true;
}

void ClickRenderer::enqueue(const Click& click, const SphereWeights* ears, std::uint32_t voice) {
  if (!capacity_) reserveScratch(click);  // before the click waits, as memory may lack
  std::uint32_t slot = static_cast<std::uint32_t>(clicks_.size());
  if (freeSlots_.empty()) {
    clicks_.push_back(click);
    freeSlots_.reserve(clicks_.capacity());  // `render` frees slots and must not allocate
  } else {
    slot = freeSlots_.back();
    freeSlots_.pop_back();
    clicks_[slot] = click;
  }
  if (ears != nullptr) {
    if (ears_.size() < clicks_.size()) ears_.resize(2 * clicks_.size());
    ears_[slot] = *ears;
  }
  if (voice != kNone) voices_.attach(voice, slot);
  waiting_.push({click.first, click.track.start, slot}, position_);
}

/// Finds the buses of a click that will wait; false, with none taken, if there is not one for each
/// filter.
bool ClickRenderer::findBuses(Click& click) {
  for (std::size_t i = 0; i < click.filters->count; ++i) {
    const std::uint32_t bus = busOf(click, i);
    if (bus == kNone) {
      for (std::size_t found = 0; found < i; ++found)
        --buses_[click.buses[found]].pending;
      return false;
    }
    click.buses[i] = bus;
    ++buses_[bus].pending;
    if (!capacity_) buses_[bus].line.reserve(kMixFrames, roomOf(click));
  }
  return true;
}

void ClickRenderer::leaveBuses(const Click& click) noexcept {
  for (std::size_t i = 0; i < click.filters->count; ++i)
    --buses_[click.buses[i]].pending;
}

void ClickRenderer::reserveScratch(const Click& click) {
  mostSamples_ = std::max(mostSamples_, roomOf(click));
  sampler_.reserve(click.nodes.size(), click.samples);
  const std::size_t room = mostSamples_ + response_.size() + 2 * ClickKernels::kRoom;
  if (x_.size() < room) x_.resize(2 * room);
  if (heard_.size() < room && !response_.empty()) heard_.resize(2 * room);
}

std::uint64_t ClickRenderer::keyOf(std::uint32_t filter, std::uint32_t chain,
                                   std::uint32_t channel) const {
  return (static_cast<std::uint64_t>(filter) * paths_->chains.size() + chain) *
             (paths_->channels.size() + 1) +
         channel;
}

/// Returns the bus of a click's filter: the one with its key, an idle one, or a new one; kNone if
/// there may be no more buses.
std::uint32_t ClickRenderer::busOf(const Click& click, std::size_t filter) {
  const std::uint64_t key = keyOf(click.filters->filters[filter], click.chain, click.channel);
  const auto place = std::ranges::lower_bound(busOrder_, key, {}, &BusOfKey::key);
  if (place != busOrder_.end() && place->key == key) return place->bus;
  const std::uint32_t index = idleBus();
  if (index == kNone) return kNone;
  if (index == buses_.size()) buses_.push_back({ClickBus(kernels_), 0, 0});
  Bus& bus = buses_[index];
  const auto old = std::ranges::lower_bound(busOrder_, bus.key, {}, &BusOfKey::key);
  if (old != busOrder_.end() && old->key == bus.key && old->bus == index) busOrder_.erase(old);
  bus.key = key;
  bus.line.restart({.radiation = paths_->isFiltered() ? click.filters->responses[filter] : nullptr,
                    .reflections = paths_->chains[click.chain]},
                   position_);
  busOrder_.insert(std::ranges::lower_bound(busOrder_, key, {}, &BusOfKey::key), {key, index});
  return index;
}

/// Returns one of the next few buses that is silent and that no click waits for, or else the number
/// of buses. With a capacity, looks at all buses, and returns kNone if none is idle.
std::uint32_t ClickRenderer::idleBus() {
  constexpr std::size_t kLooks = 8;
  const std::size_t looks = capacity_ ? buses_.size() : std::min(kLooks, buses_.size());
  for (std::size_t look = 0; look < looks; ++look) {
    idleCursor_ = (idleCursor_ + 1) % buses_.size();
    const Bus& bus = buses_[idleCursor_];
    if (bus.pending == 0 && bus.line.isSilent()) return static_cast<std::uint32_t>(idleCursor_);
  }
  return capacity_ ? kNone : static_cast<std::uint32_t>(buses_.size());
}

/// A total order by content: equal clicks are interchangeable, so the order of two calls of
/// `schedule` can never be heard.
bool ClickRenderer::isEarlier(const ClickCalendar::Entry& a, const ClickCalendar::Entry& b) const {
  if (a.first != b.first) return a.first < b.first;
  if (a.start != b.start) return a.start < b.start;
  const auto contentOf = [this](std::uint32_t slot) {
    const Click& click = clicks_[slot];
    const ClickTrack& t = click.track;
    const SphereWeights ears = paths_->hasHeads ? ears_[slot] : SphereWeights{};
    return std::tuple(click.filters->corner, click.chain, click.channel, t.length, t.bend, t.gain,
                      t.slope, t.curve, click.near, click.pulse->peakForce(), click.air, ears.index,
                      ears.weight);
  };
  return contentOf(a.slot) < contentOf(b.slot);
}

void ClickRenderer::beginUntil(std::int64_t end) noexcept {
  const std::span<ClickCalendar::Entry> due = waiting_.takeUntil(position_, end);
  std::ranges::sort(due, [this](const auto& a, const auto& b) { return isEarlier(a, b); });
  if (capacity_) chooseVoices(due, end);
  for (std::size_t i = 0; i < due.size(); ++i) {
    constexpr std::size_t kAhead = 6;
    if (i + kAhead < due.size()) prefetch(clicks_[due[i + kAhead].slot]);
    const std::uint32_t slot = due[i].slot;
    if (!capacity_ || voices_.hasBegun(voices_.voiceOf(slot)))
      begin(slot);
    else
      leaveBuses(clicks_[slot]);
    if (capacity_) voices_.detach(slot);
    freeSlots_.push_back(slot);
  }
}

/// Begins those of the due events that can be afforded, the loudest first, and removes the later
/// clicks of the others.
void ClickRenderer::chooseVoices(std::span<const ClickCalendar::Entry> due,
                                 std::int64_t end) noexcept {
  chosen_.clear();
  for (const ClickCalendar::Entry& entry : due) {
    const std::uint32_t voice = voices_.voiceOf(entry.slot);
    const double work = workOf(clicks_[entry.slot]);
    if (voices_.hasBegun(voice)) {
      spend(work);
      continue;
    }
    if (voices_.mark(voice) == 0.0) chosen_.push_back(voice);
    voices_.mark(voice) += work;
  }
  std::ranges::sort(chosen_, [this](std::uint32_t a, std::uint32_t b) {
    return voices_.peak(a) != voices_.peak(b) ? voices_.peak(a) > voices_.peak(b) : a < b;
  });
  for (const std::uint32_t voice : chosen_) {
    if (voices_.mark(voice) <= affordable_) {
      spend(voices_.mark(voice));
      voices_.begin(voice);
    } else {
      leaveOut(&SynthCounters::overBudget, voices_.isEvent(voice));
    }
  }
  for (const std::uint32_t voice : chosen_)
    if (!voices_.hasBegun(voice)) dropFrom(voice, end);
}

double ClickRenderer::workOf(const Click& click) const noexcept {
  const auto samples = static_cast<double>(click.samples);
  const auto nodes = static_cast<double>(click.nodes.empty() ? click.samples : click.nodes.size());
  const bool isEar =
      click.channel < paths_->channels.size() && paths_->channels[click.channel].isEar;
  const double ear = isEar ? kResponseWork * static_cast<double>(ear_.size()) : 0.0;
  const double taps =
      click.air != 0 ? paths_->air->tapsAbout(AirFilter::heardDistanceOf(click.air)) : 0.0;
  return kClickWork + kNodeWork * nodes + kAirWork * taps * taps +
         samples *
             (kSampleWork * static_cast<double>(click.filters->count) + ear + kResponseWork * taps);
}

void ClickRenderer::begin(std::uint32_t slot) noexcept {
  const Click& click = clicks_[slot];
  std::span<const double> samples = samplesOf(click);
  const double near = settings_.comparison.radiation == Radiation::exact ? click.near : 0.0;
  const bool isSound = canBeSound(samples) && std::isfinite(near);
  if (click.isLeader) ++(isSound ? counters_.heard : counters_.lost);
  if (!isSound) {
    counters_.silencedFrames += click.samples;
    return leaveBuses(click);
  }
  if (const std::span<const double> response = responseOf(slot); !response.empty()) {
    const std::size_t length = samples.size() + response.size() - 1;
    std::fill_n(x_.begin() + std::ssize(response_) + std::ssize(samples),
                ClickKernels::kRoom + response.size(), 0.0);
    kernels_.convolve(response, samples.data(), {heard_.data(), length});
    samples = {heard_.data(), length};
  }
  for (std::size_t i = 0; i < click.filters->count; ++i) {
    Bus& bus = buses_[click.buses[i]];
    const double weight = click.filters->weights[i];
    bus.line.add(click.first, samples, weight, weight * near);
    --bus.pending;
  }
}

/// Returns the response of the ear that hears a click; none for a microphone.
std::span<const double> ClickRenderer::earOf(std::uint32_t slot) noexcept {
  const Click& click = clicks_[slot];
  if (click.channel >= paths_->channels.size() || !paths_->channels[click.channel].isEar) return {};
  const SoundPaths::Channel& channel = paths_->channels[click.channel];
  const HrtfSet& set = *paths_->listeners[channel.listener].hrtf;
  const std::span<double> response(ear_.data(), set.alignedLength());
  set.blendAligned(ears_[slot], channel.ear, response);
  return response;
}

/// Returns the response of what a click passes before its buses: the air, an ear, or both.
std::span<const double> ClickRenderer::responseOf(std::uint32_t slot) noexcept {
  const std::span<const double> ear = earOf(slot);
  if (clicks_[slot].air == 0) return ear;
  const std::span<const double> air =
      paths_->air->taps(AirFilter::heardDistanceOf(clicks_[slot].air), air_);
  if (ear.empty()) return air;
  const std::span<double> both(response_.data(), ear.size() + air.size() - 1);
  std::ranges::fill(both, 0.0);
  for (std::size_t later = 0; later < air.size(); ++later)
    for (std::size_t tap = 0; tap < ear.size(); ++tap)
      both[later + tap] += air[later] * ear[tap];
  return both;
}

/// Returns the samples of a click, in x_ behind as many zeros as the longest response needs.
std::span<const double> ClickRenderer::samplesOf(const Click& click) noexcept {
  const std::span<double> x(x_.data() + response_.size(), click.samples);
  sampler_.sample(click, paths_->isFiltered() ? Drive::force : Drive::pressure, x);
  return x;
}

void ClickRenderer::mix(std::size_t frames) noexcept {
  std::ranges::fill(mix_, 0.0);
  std::ranges::fill(send_, 0.0);
  beginUntil(position_ + static_cast<std::int64_t>(frames));
  const std::size_t channels = paths_->channels.size();
  for (const BusOfKey& entry : busOrder_) {
    ClickBus& line = buses_[entry.bus].line;
    const std::size_t channel = entry.key % (channels + 1);
    double* to = channel < channels ? &mix_[channel * kMixFrames] : send_.data();
    if (!line.isSilent()) spend(kBusWork * static_cast<double>(frames));
    line.advance({to, frames});
  }
  spend(kResonatorWork * static_cast<double>(frames * modalBank_.resonatorsInUse()));
  modalBank_.mix({mix_.data(), kMixFrames, send_.data(), frames});
  addNoise(frames);
  silenceNotFinite(frames);
  reverberate(frames);
  position_ += static_cast<std::int64_t>(frames);
}

/// Replaces samples that can be no sound by 0, and has filters forget those that they hold. Clicks
/// and excitations that would give such are left out before they reach them (`begin`).
void ClickRenderer::silenceNotFinite(std::size_t frames) noexcept {
  bool isSound = canBeSound({send_.data(), frames});
  for (std::size_t channel = 0; channel < paths_->channels.size(); ++channel)
    isSound = isSound && canBeSound({&mix_[channel * kMixFrames], frames});
  if (isSound) return;
  const auto forget = [](double& sample) {
    if (!(std::abs(sample) <= kNoSound)) sample = 0.0;
  };
  std::ranges::for_each(mix_, forget);
  std::ranges::for_each(send_, forget);
  for (Bus& bus : buses_)
    bus.line.forgetAbove(kNoSound);
  modalBank_.forgetAbove(kNoSound);
  if (bed_) bed_->clear();
  counters_.silencedFrames += frames;
}

void ClickRenderer::addNoise(std::size_t frames) noexcept {
  if (!bed_ || bed_->isSilent()) return;
  const std::size_t channels = paths_->channels.size();
  bed_->mix(position_, {.samples = mix_.data(),
                        .stride = kMixFrames,
                        .frames = frames,
                        .send = reverbs_.empty() ? nullptr : send_.data()});
  spend(kNoiseWork * static_cast<double>(frames * channels));
}

void ClickRenderer::reverberate(std::size_t frames) noexcept {
  if (reverbs_.empty()) return;
  const std::span<const double> input(send_.data(), frames);
  const bool quiet = std::ranges::all_of(input, [](double sample) { return sample == 0.0; });
  std::size_t channel = 0;
  for (Reverb& reverb : reverbs_) {
    std::array<double*, Reverb::kMaxChannels> outputs{};
    for (std::size_t i = 0; i < reverb.channels(); ++i)
      outputs[i] = &mix_[(channel + i) * kMixFrames];
    if (!quiet || !reverb.isSilent()) {
      reverb.process(input, {outputs.data(), reverb.channels()});
      spend(kReverbWork * static_cast<double>(frames * reverb.channels()));
    }
    channel += reverb.channels();
  }
}

bool ClickRenderer::isSilent() const {
  return waiting_.size() == 0 && modalBank_.isSilent() && (!bed_ || bed_->isSilent()) &&
         std::ranges::all_of(reverbs_, &Reverb::isSilent) && busesInUse() == 0;
}

std::size_t ClickRenderer::busesInUse() const {
  return static_cast<std::size_t>(std::ranges::count_if(
      buses_, [](const Bus& bus) { return bus.pending > 0 || !bus.line.isSilent(); }));
}

void ClickRenderer::seek(std::int64_t position) {
  position_ = position;
  trains_.clear();
  waiting_.clear();
  clicks_.clear();
  freeSlots_.clear();
  buses_.clear();
  busOrder_.clear();
  idleCursor_ = 0;
  modalBank_.seek(position);
  if (bed_) bed_->clear();
  for (Reverb& reverb : reverbs_)
    reverb.reset();
  if (capacity_) makeRoom();
}

template <class Sample>
void ClickRenderer::render(std::span<Sample* const> channels, std::size_t frames) noexcept {
  assert(channels.size() == paths_->channels.size());
  for (std::size_t done = 0; done < frames;) {
    const std::size_t part = nextPart(frames - done);
    mix(part);
    for (std::size_t channel = 0; channel < channels.size(); ++channel)
      std::transform(&mix_[channel * kMixFrames], &mix_[channel * kMixFrames] + part,
                     channels[channel] + done,
                     [](double pressure) { return static_cast<Sample>(pressure); });
    done += part;
  }
}

void ClickRenderer::setAllowance(double workPerSecond) noexcept {
  allowance_ = workPerSecond;
  if (std::isinf(workPerSecond)) affordable_ = workPerSecond;
}

/// Returns how many samples to mix at once. A limited allowance is not carried over to the next
/// quantum, so that no moment costs more than its share.
std::size_t ClickRenderer::nextPart(std::size_t frames) noexcept {
  const std::size_t part = std::min(kMixFrames, frames);
  if (!capacity_ || std::isinf(allowance_)) return part;
  if (untilQuantum_ == 0) {
    const double share = allowance_ * static_cast<double>(kQuantum) / settings_.sampleRate;
    affordable_ = std::min(affordable_ + share, share);
    untilQuantum_ = kQuantum;
  }
  const std::size_t now = std::min(part, untilQuantum_);
  untilQuantum_ -= now;
  return now;
}

template void ClickRenderer::render<float>(std::span<float* const>, std::size_t) noexcept;
template void ClickRenderer::render<double>(std::span<double* const>, std::size_t) noexcept;

}  // namespace carom::audio
