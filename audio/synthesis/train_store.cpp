#include "audio/synthesis/train_store.h"

#include <algorithm>

namespace carom::audio {
namespace {

/// Nodes in an arena that is made on demand, unless a train needs more.
constexpr std::size_t kArena = 1U << 16U;
/// Nodes of an arena per entry in its list of trains: with shorter trains, the list is full first.
constexpr std::size_t kPerPlace = 16;

}  // namespace

TrainStore::Arena::Arena(std::size_t size) : nodes(size), kept(size / kPerPlace + 1) {}

/// Returns the place of a train that is kept until `played` is beyond `last`; null if there is no
/// room.
PulseNode* TrainStore::Arena::place(std::size_t size, std::int64_t last, std::int64_t played) {
  while (count > 0 && kept[oldest].last < played) {
    oldest = (oldest + 1) % kept.size();
    --count;
  }
  if (count == kept.size() || size > nodes.size()) return nullptr;
  std::size_t begin = 0;
  if (count > 0) {
    const std::size_t first = kept[oldest].begin;
    begin = kept[(oldest + count - 1) % kept.size()].end;
    const bool isWrapped = begin <= first;
    if (!isWrapped && begin + size > nodes.size()) begin = 0;
    if (begin <= first && begin + size > first) return nullptr;
  }
  kept[(oldest + count) % kept.size()] = {begin, begin + size, last};
  ++count;
  return nodes.data() + begin;
}

TrainStore::TrainStore(std::optional<std::size_t> capacity) : capacity_(capacity) {
  clear();
}

void TrainStore::clear() {
  arenas_.clear();
  if (capacity_) arenas_.emplace_back(*capacity_);
}

std::span<const PulseNode> TrainStore::keep(std::span<const PulseNode> train, std::int64_t last,
                                            std::int64_t played) {
  const std::size_t size = train.size() + Pulse::kRulePadding;
  PulseNode* place = nullptr;
  for (Arena& arena : arenas_)
    if (place == nullptr) place = arena.place(size, last, played);
  if (place == nullptr && !capacity_)
    place = arenas_.emplace_back(std::max(kArena, size)).place(size, last, played);
  if (place == nullptr) return {};
  std::ranges::copy(train, place);
  std::fill_n(place + train.size(), Pulse::kRulePadding, PulseNode{1.0, 0.0});
  return {place, train.size()};
}

}  // namespace carom::audio
