#include "audio/synthesis/voice_table.h"

#include <algorithm>
#include <cassert>
#include <numeric>

namespace carom::audio {

void VoiceTable::reserve(std::size_t voices, std::size_t slots) {
  voices_.resize(voices);
  ofSlot_.resize(slots);
  free_.reserve(voices);
  heap_.reserve(voices);
  clear();
}

void VoiceTable::clear() noexcept {
  free_.resize(voices_.size());
  std::iota(free_.rbegin(), free_.rend(), std::uint32_t{0});
  std::ranges::fill(ofSlot_, Slot{});
  heap_.clear();
  used_ = 0;
  number_ = 0;
}

bool VoiceTable::isQuieter(std::uint32_t a, std::uint32_t b) const {
  const Voice& va = voices_[a];
  const Voice& vb = voices_[b];
  return va.peak != vb.peak ? va.peak < vb.peak : va.number > vb.number;
}

std::uint32_t VoiceTable::add(double peak, bool isEvent) noexcept {
  assert(!isFull());
  const std::uint32_t voice = free_.back();
  free_.pop_back();
  voices_[voice] = {.peak = peak, .number = number_++, .isEvent = isEvent};
  heap_.push_back(voice);
  voices_[voice].heapPlace = static_cast<std::uint32_t>(heap_.size() - 1);
  rise(heap_.size() - 1);
  ++used_;
  return voice;
}

void VoiceTable::attach(std::uint32_t voice, std::uint32_t slot) noexcept {
  const std::uint32_t next = voices_[voice].slot;
  ofSlot_[slot] = {voice, next, kNone};
  if (next != kNone) ofSlot_[next].before = slot;
  voices_[voice].slot = slot;
}

void VoiceTable::detach(std::uint32_t slot) noexcept {
  const Slot taken = ofSlot_[slot];
  Voice& voice = voices_[taken.voice];
  (taken.before == kNone ? voice.slot : ofSlot_[taken.before].next) = taken.next;
  if (taken.next != kNone) ofSlot_[taken.next].before = taken.before;
  ofSlot_[slot] = {};
  if (voice.slot != kNone) return;
  if (!hasBegun(taken.voice)) begin(taken.voice);
  free_.push_back(taken.voice);
  --used_;
}

void VoiceTable::begin(std::uint32_t voice) noexcept {
  const std::size_t place = voices_[voice].heapPlace;
  voices_[voice].heapPlace = kNone;
  const std::uint32_t last = heap_.back();
  heap_.pop_back();
  if (last == voice) return;
  put(place, last);
  rise(place);
  sink(voices_[last].heapPlace);
}

void VoiceTable::put(std::size_t place, std::uint32_t voice) noexcept {
  heap_[place] = voice;
  voices_[voice].heapPlace = static_cast<std::uint32_t>(place);
}

void VoiceTable::rise(std::size_t place) noexcept {
  const std::uint32_t voice = heap_[place];
  while (place > 0 && isQuieter(voice, heap_[(place - 1) / 2])) {
    put(place, heap_[(place - 1) / 2]);
    place = (place - 1) / 2;
  }
  put(place, voice);
}

void VoiceTable::sink(std::size_t place) noexcept {
  const std::uint32_t voice = heap_[place];
  for (std::size_t child = 2 * place + 1; child < heap_.size(); child = 2 * place + 1) {
    if (child + 1 < heap_.size() && isQuieter(heap_[child + 1], heap_[child])) ++child;
    if (!isQuieter(heap_[child], voice)) break;
    put(place, heap_[child]);
    place = child;
  }
  put(place, voice);
}

}  // namespace carom::audio
