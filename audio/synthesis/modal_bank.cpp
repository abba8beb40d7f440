#include "audio/synthesis/modal_bank.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "audio/dsp/spread_kernel.h"
#include "audio/model/pulse.h"
#include "audio/synthesis/click_bus.h"

namespace carom::audio {
namespace {

/// Share of the audible threshold at which a resonator is over: 1000 of them together are then as
/// loud as the threshold.
constexpr double kInaudible = 1e-3;
/// Pa: amplitude at which a resonator is over in any case, also with a threshold of 0.
constexpr double kInaudibleRing = 1e-15;

static_assert((ModalBank::kGrid & (ModalBank::kGrid - 1)) == 0);
static_assert(ModalBank::kGrid <= MovingRing::kMostSamples);

/// Adds the drive through the taps; it has as many zeros at its ends as they reach.
void addRest(const RestTaps<double>& rest, std::span<const double> x, std::span<double> out) {
  for (std::size_t tap = 0; tap < rest.size(); ++tap) {
    const std::size_t from = tap < kRestReach ? kRestReach - tap : 0;
    const std::size_t to = tap > kRestReach ? x.size() - (tap - kRestReach) : x.size();
    for (std::size_t n = from; n < to; ++n)
      out[n + tap - kRestReach] += rest[tap] * x[n];
  }
}

}  // namespace

ModalBank::ModalBank(std::shared_ptr<const SoundPaths> paths, std::optional<ModalCapacity> capacity)
    : paths_(std::move(paths)),
      capacity_(capacity),
      sampler_(paths_->settings.comparison.sampling, fastestKernels()),
      silence_(silence(paths_->settings)),
      ahead_(paths_->channels.size() + 1) {
  if (capacity_) makeRoom();
}

double ModalBank::silence(const SynthSettings& settings) {
  return std::max(kInaudible * settings.audibleThreshold, kInaudibleRing);
}

std::pmr::memory_resource* ModalBank::memory() noexcept {
  if (capacity_) return &arena_;
  return std::pmr::new_delete_resource();
}

/// Allocates all the memory that a bank with a capacity ever has.
void ModalBank::makeRoom() {
  const Pulse& pulse = Pulse::of(paths_->settings.comparison.pulse);
  const double longest =
      (pulse.end() - pulse.begin()) * capacity_->longestContact * paths_->settings.sampleRate;
  Click drive;
  drive.samples = static_cast<std::uint32_t>(longest) + 2 * (kSpreadWidth + kRestReach);
  mostSamples_ = drive.samples;
  reserve(drive, capacity_->modes);
  sampler_.reserve(std::max<std::size_t>({kMostNodes, kMostImpactNodes, drive.samples}),
                   drive.samples);
  const std::size_t resonators = capacity_->modes + ResonatorKernels::kWidth;
  const std::size_t slots = capacity_->excitations + capacity_->motions + capacity_->dampings;
  slots_.reserve(slots);
  freeSlots_.reserve(slots);
  for (std::size_t slot = slots; slot-- > 0;) {
    slots_.emplace_back(memory()).taps.resize(2 * resonators);
    freeSlots_.push_back(static_cast<std::uint32_t>(slot));
  }
  banks_.reserve(capacity_->banks);
  freeBanks_.reserve(capacity_->banks);
  for (std::size_t bank = capacity_->banks; bank-- > 0;) {
    Bank& added = banks_.emplace_back(memory());
    added.y.resize(2 * resonators);
    added.damped.resize(2 * resonators);
    added.moving.reserve(resonators);
    freeBanks_.push_back(static_cast<std::uint32_t>(bank));
  }
  order_.reserve(banks_.size());
  driven_.reserve(slots_.size());
  dampings_.reserve(slots_.size());
  waiting_.reserve(slots_.size());
}

void ModalBank::add(const ScheduledSound& sound) {
  std::int64_t first = std::numeric_limits<std::int64_t>::max();
  for (const ModalExcitation& excitation : sound.excitations)
    first = std::min(first, excitation.drive.first);
  const std::int64_t delay = capacity_ ? std::max<std::int64_t>(0, position_ - first) : 0;
  bool isLeader = sound.isEvent;
  for (const ModalExcitation& excitation : sound.excitations) {
    ModalExcitation later = excitation;
    later.drive.first += delay;
    later.isLeader = isLeader;
    if (!sound.train.empty()) later.drive.nodes = sound.train;
    const std::size_t size = excitation.arrays() * excitation.count;
    const bool isAdded = addOne(later, sound.taps.subspan(excitation.taps, size));
    if (isAdded) isLeader = false;
  }
  if (!isLeader) return;
  ++(isTooLong(sound.excitations.front()) ? counters_.tooLong : counters_.ringsLeftOut);
}

bool ModalBank::isTooLong(const ModalExcitation& excitation) const {
  return capacity_ && excitation.drive.samples > mostSamples_;
}

/// Adds an excitation; false if there is no room.
bool ModalBank::addOne(const ModalExcitation& excitation, std::span<const double> taps) {
  assert(!capacity_ || !excitation.isFollowed);
  const bool isFitting = !isTooLong(excitation);
  const bool isChange = excitation.isDamping() || excitation.isMotion();
  const std::uint32_t bank = isFitting && !isChange ? bankOf(excitation, taps) : kNone;
  const bool hasBank = bank != kNone || (isFitting && isChange);
  const std::uint32_t slot = hasBank && hasRoom(excitation) ? freeSlot() : kNone;
  if (slot == kNone) {
    ++counters_.modalVoicesExhausted;
    return false;
  }
  const std::size_t count = countOf(excitation);
  Waiting& waiting = slots_[slot];
  waiting.excitation = excitation;
  waiting.bank = bank;
  if (excitation.isMotion()) ++motions_;
  if (excitation.isDamping()) ++dampingSlots_;
  if (!capacity_) waiting.taps.resize(excitation.arrays() * count);
  auto to = waiting.taps.begin();
  for (std::size_t array = 0; array < excitation.arrays(); ++array)
    to = std::ranges::copy(taps.subspan(array * excitation.count, count), to).out;
  if (bank != kNone) ++banks_[bank].pending;
  if (!capacity_) reserve(excitation.drive, count);
  waiting_.push({excitation.drive.first, excitation.drive.track.start, slot}, position_);
  return true;
}

std::size_t ModalBank::countOf(const ModalExcitation& excitation) const {
  if (!capacity_) return excitation.count;
  return std::min(excitation.count, ResonatorKernels::padded(capacity_->modes));
}

/// Returns the samples that a drive may need from the clock on, in any of the buffers.
std::size_t ModalBank::roomOf(const Click& drive) const {
  return drive.samples + static_cast<std::size_t>(2 * kGrid) + ClickBus::kMaxFrames +
         2 * ClickKernels::kRoom;
}

void ModalBank::reserve(const Click& drive, std::size_t count) {
  const auto atLeast = [](std::vector<double>& values, std::size_t size) {
    if (values.size() < size) values.resize(2 * size);
  };
  const std::size_t room = roomOf(drive);
  atLeast(x_, room);
  atLeast(out_, room);
  for (std::vector<double>& ahead : ahead_)
    atLeast(ahead, room);
  atLeast(y_, 2 * (count + ResonatorKernels::kWidth));
  if (!capacity_) atLeast(own_, 2 * (count + ResonatorKernels::kWidth));
  sampler_.reserve(drive.nodes.size(), drive.samples);
}

/// Returns the bank of the excited body, channel and path, or a new one, which hears the excitation
/// as it is; kNone if there may be no more.
std::uint32_t ModalBank::bankOf(const ModalExcitation& excitation, std::span<const double> taps) {
  const auto place = placeOf(excitation);
  if (place != order_.end() && isBankOf(*place, excitation)) return *place;
  const std::uint32_t index = freeBank();
  if (index == kNone) return kNone;
  Bank& bank = banks_[index];
  bank.body = excitation.body;
  bank.channel = excitation.drive.channel;
  bank.path = excitation.path;
  bank.resonators = excitation.resonators;
  bank.count = countOf(excitation);
  if (bank.y.size() < 2 * bank.count) bank.y.resize(2 * bank.count);
  std::ranges::fill(bank.y, 0.0);
  bank.isDamped = false;
  bank.isMoving = false;
  if (bank.damped.size() < 2 * bank.count) bank.damped.resize(2 * bank.count);
  if (!capacity_) bank.moving.reserve(bank.count);
  if (bank.path != 0) beginMoving(bank, motionOf(excitation, taps.subspan(2 * excitation.count)));
  for (const std::uint32_t slot : dampings_)
    dampBank(bank, slots_[slot]);
  order_.insert(place, index);
  return index;
}

/// Returns where in order_ the bank of an excitation or motion is, or would be.
std::vector<std::uint32_t>::iterator ModalBank::placeOf(
    const ModalExcitation& excitation) noexcept {
  const auto keyOf = [this](std::uint32_t index) {
    const Bank& bank = banks_[index];
    return std::tuple(bank.body, bank.channel, bank.path, bank.resonators->order);
  };
  const auto key = std::tuple(excitation.body, excitation.drive.channel, excitation.path,
                              excitation.resonators->order);
  return std::ranges::lower_bound(order_, key, {}, keyOf);
}

bool ModalBank::isBankOf(std::uint32_t index, const ModalExcitation& excitation) const noexcept {
  const Bank& bank = banks_[index];
  return bank.body == excitation.body && bank.channel == excitation.drive.channel &&
         bank.path == excitation.path && bank.resonators == excitation.resonators;
}

/// Returns how an excitation or motion is heard, with its factors.
RingMotion ModalBank::motionOf(const ModalExcitation& excitation, std::span<const double> factors) {
  return {factors, excitation.length, excitation.rate};
}

std::uint32_t ModalBank::freeBank() {
  if (!freeBanks_.empty()) {
    const std::uint32_t bank = freeBanks_.back();
    freeBanks_.pop_back();
    return bank;
  }
  if (capacity_) return kNone;
  banks_.emplace_back(memory());
  freeBanks_.reserve(banks_.capacity());
  return static_cast<std::uint32_t>(banks_.size() - 1);
}

/// True if there may be one more; motions, changes of damping and blows leave each other's slots
/// alone.
bool ModalBank::hasRoom(const ModalExcitation& excitation) const {
  if (!capacity_) return true;
  if (excitation.isMotion()) return motions_ < capacity_->motions;
  if (excitation.isDamping()) return dampingSlots_ < capacity_->dampings;
  return freeSlots_.size() + motions_ + dampingSlots_ > capacity_->motions + capacity_->dampings;
}

void ModalBank::giveUpDamping(std::uint32_t slot) noexcept {
  freeSlots_.push_back(slot);
  --dampingSlots_;
}

std::uint32_t ModalBank::freeSlot() {
  if (!freeSlots_.empty()) {
    const std::uint32_t slot = freeSlots_.back();
    freeSlots_.pop_back();
    return slot;
  }
  if (capacity_) return kNone;
  slots_.emplace_back(memory());
  freeSlots_.reserve(slots_.capacity());
  driven_.reserve(slots_.capacity());
  dampings_.reserve(slots_.capacity());
  return static_cast<std::uint32_t>(slots_.size() - 1);
}

/// A total order by content, so that the order of two calls of `add` can never be heard.
bool ModalBank::isEarlier(const ClickCalendar::Entry& a, const ClickCalendar::Entry& b) const {
  if (a.first != b.first) return a.first < b.first;
  if (a.start != b.start) return a.start < b.start;
  const auto contentOf = [this](std::uint32_t slot) {
    const ModalExcitation& excitation = slots_[slot].excitation;
    const ClickTrack& track = excitation.drive.track;
    return std::tuple(excitation.isDamping(), excitation.isMotion(), excitation.body,
                      excitation.drive.channel, excitation.drive.chain, excitation.path,
                      track.length, track.bend, excitation.rest);
  };
  if (contentOf(a.slot) != contentOf(b.slot)) return contentOf(a.slot) < contentOf(b.slot);
  const auto tapsOf = [this](std::uint32_t slot) {
    const ModalExcitation& excitation = slots_[slot].excitation;
    return std::span(slots_[slot].taps).first(excitation.arrays() * countOf(excitation));
  };
  return std::ranges::lexicographical_compare(tapsOf(a.slot), tapsOf(b.slot));
}

void ModalBank::mix(const Mix& mix) noexcept {
  const std::int64_t end = position_ + static_cast<std::int64_t>(mix.frames);
  const std::int64_t begin = position_;
  beginUntil(end);
  while (position_ < end) {
    if (gridFrom(position_) == position_) {
      joinAt(position_);
      retire();
    }
    const std::int64_t next = std::min(end, gridFrom(position_ + 1));
    ringFreely(mix, static_cast<std::size_t>(position_ - begin),
               static_cast<std::size_t>(next - position_));
    position_ = next;
  }
  addAhead(mix);
}

void ModalBank::beginUntil(std::int64_t end) noexcept {
  const std::span<ClickCalendar::Entry> due = waiting_.takeUntil(position_, end);
  std::ranges::sort(due, [this](const auto& a, const auto& b) { return isEarlier(a, b); });
  for (const ClickCalendar::Entry& entry : due) {
    if (slots_[entry.slot].bank == kNone)
      joinLater(gridFrom(std::max(entry.first, position_)), entry.slot);
    else
      drive(entry.slot);
  }
}

void ModalBank::joinLater(std::int64_t joins, std::uint32_t slot) noexcept {
  driven_.insert(std::ranges::upper_bound(driven_, joins, {}, &Driven::joins), {joins, slot});
}

/// Puts a damping in force from now on, in place of the one before of the same body.
void ModalBank::damp(std::uint32_t slot) noexcept {
  const Waiting& waiting = slots_[slot];
  const auto before = std::ranges::find_if(dampings_, [&](std::uint32_t other) {
    return slots_[other].excitation.body == waiting.excitation.body;
  });
  // Bodies that disappear while they are touched would keep all slots in the end.
  const bool isFull = capacity_ && dampings_.size() >= capacity_->dampings / 2;
  const auto gone = before == dampings_.end() && isFull ? dampings_.begin() : before;
  if (gone != dampings_.end()) {
    giveUpDamping(*gone);
    dampings_.erase(gone);
  }
  for (const std::uint32_t index : order_)
    dampBank(banks_[index], waiting);
  const ResonatorSet& set = *waiting.excitation.resonators;
  const std::size_t count = countOf(waiting.excitation);
  if (std::equal(set.a2.begin(), set.a2.begin() + static_cast<std::ptrdiff_t>(count),
                 waiting.taps.begin() + static_cast<std::ptrdiff_t>(count)))
    giveUpDamping(slot);  // the damping of the free body
  else
    dampings_.push_back(slot);
}

void ModalBank::dampBank(Bank& bank, const Waiting& waiting) noexcept {
  if (bank.body != waiting.excitation.body || bank.resonators != waiting.excitation.resonators)
    return;
  std::copy_n(waiting.taps.begin(), 2 * bank.count, bank.damped.begin());
  bank.isDamped = true;
  if (bank.isMoving) bank.moving.damp(std::span(bank.damped).first(2 * bank.count), position_);
}

/// Moves the bank of a path from now on; one that is silent by now is left alone.
void ModalBank::move(std::uint32_t slot) noexcept {
  const Waiting& waiting = slots_[slot];
  freeSlots_.push_back(slot);
  --motions_;
  const auto place = placeOf(waiting.excitation);
  if (place == order_.end() || !isBankOf(*place, waiting.excitation)) return;
  Bank& bank = banks_[*place];
  const RingMotion motion =
      motionOf(waiting.excitation, std::span(waiting.taps).first(2 * bank.count));
  if (!bank.isMoving) {
    beginMoving(bank, motion);
    if (bank.isDamped) bank.moving.damp(std::span(bank.damped).first(2 * bank.count), position_);
    bank.moving.adopt(bank.y, position_);
    std::ranges::fill(bank.y, 0.0);
  }
  bank.moving.move(motion, position_);
}

void ModalBank::beginMoving(Bank& bank, const RingMotion& motion) noexcept {
  bank.isMoving = true;
  bank.moving.begin(*bank.resonators, bank.count, motion);
}

/// Drives an excitation's own resonators over its pulse, adds their sound to ahead_, and keeps the
/// state that goes into the bank.
void ModalBank::drive(std::uint32_t slot) noexcept {
  Waiting& waiting = slots_[slot];
  const ModalExcitation& excitation = waiting.excitation;
  const Click& click = excitation.drive;
  const std::size_t count = banks_[waiting.bank].count;
  const std::int64_t over = click.first + static_cast<std::int64_t>(click.samples);
  const std::int64_t joins = gridFrom(std::max(over, position_ + 1));
  const auto length = static_cast<std::size_t>(joins - click.first);
  const std::size_t late =
      click.first < position_ ? static_cast<std::size_t>(position_ - click.first) : std::size_t{0};
  assert(length - late <= ahead_.front().size());
  if (length + 1 > x_.size()) {  // so late that it is over
    counters_.lost += excitation.isLeader ? 1 : 0;
    return giveBack(slot);
  }
  x_[0] = 0.0;
  const std::span<double> x(x_.data() + 1, click.samples);
  sampler_.sample(click, Drive::force, x);
  std::fill(x_.begin() + 1 + std::ssize(x), x_.begin() + 1 + static_cast<std::ptrdiff_t>(length),
            0.0);
  std::fill_n(y_.begin(), 2 * count, 0.0);
  std::fill_n(out_.begin(), length, 0.0);
  kernels_.drive(ownOf(excitation, count),
                 {waiting.taps.data(), waiting.taps.data() + count, x_.data() + 1},
                 {out_.data(), length});
  addRest(excitation.rest, x, {out_.data(), length});
  const bool isSound = canBeSound({out_.data(), length}) && canBeSound({y_.data(), 2 * count});
  if (excitation.isLeader) ++(isSound ? counters_.heard : counters_.lost);
  if (!isSound) {
    counters_.silencedFrames += click.samples;
    return giveBack(slot);
  }
  std::vector<double>& ahead = ahead_[click.channel];
  const std::size_t at =
      click.first < position_ ? 0 : static_cast<std::size_t>(click.first - position_);
  for (std::size_t n = late; n < length; ++n)
    ahead[at + n - late] += out_[n];
  aheadEnd_ = std::max(aheadEnd_, at + length - late);
  std::copy_n(y_.begin(), 2 * count, waiting.taps.begin());
  joinLater(joins, slot);
}

/// Returns the resonators that an excitation drives: at the rate at which its body's time goes by.
Resonators ModalBank::ownOf(const ModalExcitation& excitation, std::size_t count) noexcept {
  const ResonatorSet& set = *excitation.resonators;
  if (excitation.rate == 1.0)
    return {set.a1.data(), set.a2.data(), y_.data(), y_.data() + count, count};
  const double sampleRate = paths_->settings.sampleRate / excitation.rate;
  std::fill_n(own_.begin(), 2 * count, 0.0);
  for (std::size_t mode = 0; mode < std::min(count, set.modes); ++mode) {
    const TwoPole two = TwoPole::of(set.pole[mode].imag(), -set.pole[mode].real(), sampleRate);
    own_[mode] = two.a1;
    own_[count + mode] = two.a2;
  }
  return {own_.data(), own_.data() + count, y_.data(), y_.data() + count, count};
}

void ModalBank::joinAt(std::int64_t position) noexcept {
  std::size_t joined = 0;
  for (; joined < driven_.size() && driven_[joined].joins <= position; ++joined) {
    const Waiting& waiting = slots_[driven_[joined].slot];
    if (waiting.excitation.isDamping()) {
      damp(driven_[joined].slot);
    } else if (waiting.excitation.isMotion()) {
      move(driven_[joined].slot);
    } else {
      join(waiting);
      giveBack(driven_[joined].slot);
    }
  }
  driven_.erase(driven_.begin(), driven_.begin() + static_cast<std::ptrdiff_t>(joined));
}

/// Adds what an excitation's own resonators have left to its bank.
void ModalBank::join(const Waiting& waiting) noexcept {
  Bank& bank = banks_[waiting.bank];
  bank.active = bank.count;
  const std::span<const double> taps(waiting.taps);
  if (bank.path != 0) {
    const RingMotion motion =
        motionOf(waiting.excitation, taps.subspan(2 * bank.count, 2 * bank.count));
    bank.moving.join(taps.first(2 * bank.count), motion, position_);
    return;
  }
  if (bank.isMoving) return bank.moving.join(taps.first(2 * bank.count), position_);
  for (std::size_t i = 0; i < 2 * bank.count; ++i)
    bank.y[i] += waiting.taps[i];
}

void ModalBank::giveBack(std::uint32_t slot) noexcept {
  --banks_[slots_[slot].bank].pending;
  freeSlots_.push_back(slot);
}

/// Silences resonators that are no longer heard, and frees the banks where none is left.
void ModalBank::retire() noexcept {
  const auto isOver = [this](std::uint32_t index) {
    Bank& bank = banks_[index];
    if (bank.active > 0) settle(bank);
    if (bank.active > 0 || bank.pending > 0) return false;
    freeBanks_.push_back(index);
    return true;
  };
  order_.erase(std::remove_if(order_.begin(), order_.end(), isOver), order_.end());
}

/// Silences the resonators of a bank that are no longer heard.
void ModalBank::settle(Bank& bank) noexcept {
  if (bank.isMoving) {
    bank.active = bank.moving.settle(kernels_, silence_, position_) ? bank.moving.active() : 0;
    return;
  }
  if (kernels_.flush(resonatorsOf(bank), silence_) == 0) bank.active = 0;
  while (bank.active > 0 && isZero(bank, bank.active - ResonatorKernels::kWidth))
    bank.active -= ResonatorKernels::kWidth;
}

/// True if the kWidth resonators from `first` on are silent.
bool ModalBank::isZero(const Bank& bank, std::size_t first) const noexcept {
  for (std::size_t i = first; i < first + ResonatorKernels::kWidth; ++i)
    if (bank.y[i] != 0.0 || bank.y[bank.count + i] != 0.0) return false;
  return true;
}

Resonators ModalBank::resonatorsOf(Bank& bank) const noexcept {
  const double* a1 = bank.isDamped ? bank.damped.data() : bank.resonators->a1.data();
  const double* a2 = bank.isDamped ? bank.damped.data() + bank.count : bank.resonators->a2.data();
  return {a1, a2, bank.y.data(), bank.y.data() + bank.count, bank.active};
}

void ModalBank::ringFreely(const Mix& mix, std::size_t from, std::size_t frames) noexcept {
  for (const std::uint32_t index : order_) {
    Bank& bank = banks_[index];
    if (bank.active == 0) continue;
    const bool isSend = bank.channel == paths_->channels.size();
    double* const to = isSend ? mix.send : mix.channels + bank.channel * mix.stride;
    if (bank.isMoving)
      bank.moving.ring(kernels_, position_, {to + from, frames});
    else
      kernels_.ring(resonatorsOf(bank), {to + from, frames});
  }
}

void ModalBank::addAhead(const Mix& mix) noexcept {
  if (aheadEnd_ == 0) return;
  const std::size_t now = std::min(mix.frames, aheadEnd_);
  for (std::size_t channel = 0; channel < ahead_.size(); ++channel) {
    std::vector<double>& ahead = ahead_[channel];
    double* const to =
        channel == paths_->channels.size() ? mix.send : mix.channels + channel * mix.stride;
    for (std::size_t n = 0; n < now; ++n)
      to[n] += ahead[n];
    std::copy(ahead.data() + now, ahead.data() + aheadEnd_, ahead.data());
    std::fill(ahead.data() + aheadEnd_ - now, ahead.data() + aheadEnd_, 0.0);
  }
  aheadEnd_ -= now;
}

void ModalBank::forgetAbove(double most) noexcept {
  const auto forget = [most](double& value) {
    if (!(std::abs(value) <= most)) value = 0.0;
  };
  for (Bank& bank : banks_) {
    std::ranges::for_each(bank.y, forget);
    std::ranges::for_each(bank.damped, forget);
    bank.moving.forgetAbove(most);
  }
  for (const Driven& driven : driven_)
    std::ranges::for_each(slots_[driven.slot].taps, forget);
  for (std::vector<double>& ahead : ahead_)
    std::ranges::for_each(ahead, forget);
}

std::size_t ModalBank::resonatorsInUse() const {
  std::size_t sum = 0;
  for (const std::uint32_t index : order_)
    sum += banks_[index].active;
  return sum;
}

void ModalBank::seek(std::int64_t position) {
  position_ = position;
  waiting_.clear();
  slots_.clear();
  freeSlots_.clear();
  driven_.clear();
  dampings_.clear();
  motions_ = dampingSlots_ = 0;
  banks_.clear();
  freeBanks_.clear();
  order_.clear();
  for (std::vector<double>& ahead : ahead_)
    std::ranges::fill(ahead, 0.0);
  aheadEnd_ = 0;
  arena_.release();
  if (capacity_) makeRoom();
}

}  // namespace carom::audio
