#include "audio/synthesis/train_store.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/random.h"

namespace carom {

using namespace audio;

namespace {

struct Kept {
  std::span<const PulseNode> nodes;
  double mark = 0.0;  // each of its weights
  std::int64_t last = 0;
};

bool isWhole(const Kept& kept) {
  for (const PulseNode& node : kept.nodes)
    if (node.weight != kept.mark) return false;
  for (std::size_t i = 0; i < Pulse::kRulePadding; ++i)
    if ((kept.nodes.data() + kept.nodes.size())[i].weight != 0.0) return false;
  return true;
}

/// Keeps trains of all lengths that are over in any order; returns how many found no room.
int keepMany(TrainStore& store, std::uint64_t seed) {
  Random random(seed);
  std::vector<Kept> alive;
  int refused = 0;
  for (std::int64_t now = 0; now < 20000; ++now) {
    std::erase_if(alive, [now](const Kept& kept) { return kept.last < now; });
    const auto size = static_cast<std::size_t>(1 + random.below(60));
    const double mark = 1.0 + static_cast<double>(now);
    const std::vector<PulseNode> train(size, PulseNode{0.5, mark});
    const std::int64_t last = now + random.below(40);
    const auto nodes = store.keep(train, last, now);
    if (nodes.empty()) {
      ++refused;
    } else {
      EXPECT_EQ(nodes.size(), size);
      alive.push_back({nodes, mark, last});
    }
    for (const Kept& kept : alive)
      if (!isWhole(kept)) {
        ADD_FAILURE() << "overwritten at " << now;
        return refused;
      }
  }
  return refused;
}

TEST(TrainStore, WhatIsKeptStaysUntilItIsOver) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    TrainStore endless;
    EXPECT_EQ(keepMany(endless, seed), 0);
    TrainStore small(500);
    const int refused = keepMany(small, seed);
    EXPECT_GT(refused, 0);
    EXPECT_LT(refused, 20000);
    TrainStore ample(20000);
    EXPECT_EQ(keepMany(ample, seed), 0);
  }
}

TEST(TrainStore, WithoutRoomItKeepsNothing) {
  TrainStore none(0);
  const std::vector<PulseNode> train(3);
  EXPECT_TRUE(none.keep(train, 10, 0).empty());
  TrainStore store(15);  // room for one train with its padding
  EXPECT_EQ(store.keep(train, 10, 0).size(), 3U);
  EXPECT_TRUE(store.keep(train, 10, 10).empty());  // the first train's last sample is still to come
  EXPECT_EQ(store.keep(train, 20, 11).size(), 3U);
  store.clear();
  EXPECT_EQ(store.keep(train, 10, 0).size(), 3U);
}

}  // namespace
}  // namespace carom
