#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "audio/model/pulse.h"

namespace carom::audio {

/// Holds the nodes of lasting contacts until all of their sound has begun, in ring buffers of
/// memory from which finished trains are freed at one end. With a capacity there is one such
/// buffer, made in advance, and nothing allocates. [one thread]
class TrainStore {
 public:
  explicit TrainStore(std::optional<std::size_t> capacity = std::nullopt);

  /// Returns a copy of `train`, behind which there are Pulse::kRulePadding nodes of weight 0; it
  /// stays until `played` is beyond `last`, both samples of the clock. Empty if there is no room
  /// for it.
  std::span<const PulseNode> keep(std::span<const PulseNode> train, std::int64_t last,
                                  std::int64_t played);
  void clear();

 private:
  struct Kept {
    std::size_t begin = 0;
    std::size_t end = 0;
    std::int64_t last = 0;
  };
  struct Arena {
    explicit Arena(std::size_t size);
    PulseNode* place(std::size_t size, std::int64_t last, std::int64_t played);
    std::vector<PulseNode> nodes;
    std::vector<Kept> kept;  // a ring buffer
    std::size_t oldest = 0;
    std::size_t count = 0;
  };
  std::optional<std::size_t> capacity_;
  std::vector<Arena> arenas_;
};

}  // namespace carom::audio
