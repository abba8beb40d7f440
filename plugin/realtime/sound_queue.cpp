#include "plugin/realtime/sound_queue.h"

#include <algorithm>
#include <cassert>
#include <cstring>
#include <span>
#include <type_traits>

namespace carom::plugin {

using namespace audio;

std::size_t SoundQueue::linesOf(const Header& header) {
  return 1 + linesOf<Click>(header.clicks) + linesOf<SphereWeights>(header.ears) +
         linesOf<ModalExcitation>(header.excitations) + linesOf<double>(header.taps) +
         linesOf<PulseNode>(header.nodes) + linesOf<float>(header.powers);
}

std::size_t SoundQueue::linesFor(const Capacity& capacity) {
  // Each sound has a header, and its arrays begin on lines of their own.
  const std::size_t perClick =
      linesOf<Click>(1) + (capacity.hasEars ? linesOf<SphereWeights>(1) : 0) + 2;
  const std::size_t perExcitation =
      linesOf<ModalExcitation>(1) + linesOf<double>(2 * capacity.modes) + 1;
  return perClick * capacity.waitingClicks + perExcitation * capacity.waitingExcitations +
         linesOf<PulseNode>(capacity.waitingNodes) +
         (1 + linesOf<float>(capacity.powers)) * capacity.waitingLevels;
}

SoundQueue::SoundQueue(const Capacity& capacity)
    : lines_(linesFor(capacity)),
      capacity_(capacity),
      compact_(2 * capacity.modes * capacity.excitations),
      clicks_(capacity.clicks),
      ears_(capacity.hasEars ? capacity.clicks : 0),
      excitations_(capacity.excitations),
      taps_(2 * capacity.modes * capacity.excitations),
      nodes_(capacity.nodes),
      powers_(capacity.powers) {}

/// Number of modes of each of the sound's excitations that cross.
std::size_t SoundQueue::countOf(const ScheduledSound& sound) const {
  if (sound.excitations.empty()) return 0;
  return std::min(sound.excitations.front().count, capacity_.modes);
}

bool SoundQueue::put(const ScheduledSound& sound) noexcept {
  const std::size_t modes = countOf(sound);
  const Header header{.peak = sound.peak,
                      .clicks = static_cast<std::uint32_t>(sound.clicks.size()),
                      .ears = static_cast<std::uint32_t>(sound.ears.size()),
                      .excitations = static_cast<std::uint32_t>(sound.excitations.size()),
                      .taps = static_cast<std::uint32_t>(2 * modes * sound.excitations.size()),
                      .nodes = static_cast<std::uint32_t>(sound.train.size()),
                      .powers = static_cast<std::uint32_t>(sound.noise.powers.size()),
                      .at = sound.noise.at,
                      .since = sound.noise.since,
                      .lasting = sound.noise.lasting,
                      .isEvent = sound.isEvent};
  const std::size_t lines = linesOf(header);
  const bool isTooLarge =
      sound.clicks.size() > capacity_.clicks || sound.excitations.size() > capacity_.excitations ||
      sound.train.size() > capacity_.nodes || sound.noise.powers.size() > capacity_.powers;
  if (isTooLarge || lines_.writable(lines) < lines) return false;
  putArray(&header, 1);
  putArray(sound.clicks.data(), sound.clicks.size());
  putArray(sound.ears.data(), sound.ears.size());
  putModes(sound, modes);
  putArray(sound.train.data(), sound.train.size());
  putArray(sound.noise.powers.data(), sound.noise.powers.size());
  return true;
}

/// Puts the excitations and their taps, both with the first `modes` of their modes.
void SoundQueue::putModes(const ScheduledSound& sound, std::size_t modes) noexcept {
  for (std::size_t index = 0; index < sound.excitations.size(); ++index) {
    const std::size_t from = sound.excitations[index].taps;
    const auto to = compact_.begin() + static_cast<std::ptrdiff_t>(2 * modes * index);
    std::ranges::copy(sound.taps.subspan(from, modes), to);
    std::ranges::copy(sound.taps.subspan(from + sound.excitations[index].count, modes),
                      to + static_cast<std::ptrdiff_t>(modes));
  }
  putArray(sound.excitations.data(), sound.excitations.size());
  putArray(compact_.data(), 2 * modes * sound.excitations.size());
}

template <class T>
void SoundQueue::putArray(const T* items, std::size_t count) noexcept {
  static_assert(std::is_trivially_copyable_v<T>);
  const auto* from = reinterpret_cast<const std::byte*>(items);
  for (std::size_t left = count * sizeof(T); left > 0;) {
    const std::size_t part = std::min(left, kLineSize);
    Line line;
    std::memcpy(line.bytes.data(), from, part);
    lines_.put(line);
    from += part;
    left -= part;
  }
}

std::size_t SoundQueue::linesOfClicks(std::size_t clicks, std::size_t nodes) const {
  const auto count = static_cast<std::uint32_t>(clicks);
  return linesOf(Header{.clicks = count,
                        .ears = capacity_.hasEars ? count : 0,
                        .nodes = static_cast<std::uint32_t>(nodes)});
}

std::size_t SoundQueue::roomForClicks(std::size_t clicks, std::size_t nodes) noexcept {
  const std::size_t lines = linesOfClicks(clicks, 0);
  const std::size_t free = lines_.writable(lines_.capacity());
  const std::size_t taken = std::min(free, linesOf<PulseNode>(nodes));
  return (free - taken) / (lines + 1);  // one more, as each array of nodes begins a line
}

const ScheduledSound* SoundQueue::take() noexcept {
  if (lines_.readable(1) == 0) return nullptr;
  Header header;
  std::memcpy(&header, lines_.peek().bytes.data(), sizeof(Header));
  [[maybe_unused]] const std::size_t lines = linesOf(header);
  assert(lines_.readable(lines) >= lines);  // published together
  lines_.drop(1);
  takeArray(clicks_, header.clicks);
  takeArray(ears_, header.ears);
  takeArray(excitations_, header.excitations);
  takeArray(taps_, header.taps);
  takeArray(nodes_, header.nodes);
  takeArray(powers_, header.powers);
  const std::size_t modes = header.excitations > 0 ? header.taps / (2 * header.excitations) : 0;
  for (std::size_t index = 0; index < header.excitations; ++index) {
    excitations_[index].count = modes;
    excitations_[index].taps = 2 * modes * index;
  }
  taken_ = {.peak = header.peak,
            .clicks = std::span(clicks_).first(header.clicks),
            .ears = std::span(ears_).first(header.ears),
            .excitations = std::span(excitations_).first(header.excitations),
            .taps = std::span(taps_).first(header.taps),
            .train = std::span(nodes_).first(header.nodes),
            .noise = {.at = header.at,
                      .since = header.since,
                      .lasting = header.lasting,
                      .powers = std::span(powers_).first(header.powers)},
            .isEvent = header.isEvent};
  return &taken_;
}

template <class T>
void SoundQueue::takeArray(std::vector<T>& items, std::size_t count) noexcept {
  assert(count <= items.size());
  auto* to = reinterpret_cast<std::byte*>(items.data());
  const std::size_t lines = linesOf<T>(count);
  std::size_t left = count * sizeof(T);
  for (std::size_t line = 0; line < lines; ++line) {
    const std::size_t part = std::min(left, kLineSize);
    std::memcpy(to, lines_.peek(line).bytes.data(), part);
    to += part;
    left -= part;
  }
  lines_.drop(lines);
}

}  // namespace carom::plugin
