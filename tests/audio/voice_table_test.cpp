#include "audio/synthesis/voice_table.h"

#include <algorithm>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/no_alloc_scope.h"
#include "tests/support/random.h"

namespace carom {

using namespace audio;

namespace {

struct Listed {
  std::uint32_t voice = 0;
  double peak = 0.0;
  bool begun = false;
  std::vector<std::uint32_t> slots{};
};

/// The quietest voice that has not begun, of equals the newest, found by looking at all.
std::uint32_t quietestOf(const std::vector<Listed>& list) {
  std::uint32_t quietest = VoiceTable::kNone;
  double peak = 0.0;
  for (const Listed& entry : list) {
    if (entry.begun || (quietest != VoiceTable::kNone && entry.peak > peak)) continue;
    quietest = entry.voice;
    peak = entry.peak;
  }
  return quietest;
}

// The oracle is a list that is searched from end to end.
TEST(VoiceTable, KnowsTheQuietestThatHasNotBegun) {
  constexpr std::size_t kVoices = 40;
  constexpr std::size_t kSlots = 200;
  Random random(3);
  VoiceTable table;
  table.reserve(kVoices, kSlots);
  std::vector<Listed> list;
  std::vector<std::uint32_t> freeSlots;
  for (std::uint32_t slot = 0; slot < kSlots; ++slot)
    freeSlots.push_back(slot);
  for (int turn = 0; turn < 20000; ++turn) {
    const bool grows = list.empty() || (random.chance(0.55) && !table.isFull());
    if (grows && freeSlots.size() >= 5) {
      Listed entry{.peak = random.below(12) / 4.0};  // equal peaks are common
      entry.voice = table.add(entry.peak);
      for (int i = 1 + random.below(5); i > 0; --i) {
        entry.slots.push_back(freeSlots.back());
        freeSlots.pop_back();
        table.attach(entry.voice, entry.slots.back());
      }
      list.push_back(entry);
    } else if (!list.empty()) {
      const auto at = static_cast<std::size_t>(random.below(static_cast<int>(list.size())));
      Listed& entry = list[at];
      if (!entry.begun && random.chance(0.3)) {
        table.begin(entry.voice);
        entry.begun = true;
      } else {
        const std::uint32_t slot = entry.slots.back();
        ASSERT_EQ(table.voiceOf(slot), entry.voice);
        entry.slots.pop_back();
        freeSlots.push_back(slot);
        table.detach(slot);
        if (entry.slots.empty()) list.erase(list.begin() + static_cast<std::ptrdiff_t>(at));
      }
    }
    ASSERT_EQ(table.size(), list.size());
    ASSERT_EQ(table.isFull(), list.size() == kVoices);
    ASSERT_EQ(table.quietest(), quietestOf(list)) << turn;
  }
}

TEST(VoiceTable, ListsTheSlotsOfAVoice) {
  VoiceTable table;
  table.reserve(4, 10);
  const std::uint32_t first = table.add(1.0);
  const std::uint32_t second = table.add(2.0);
  for (const std::uint32_t slot : {0U, 3U, 5U})
    table.attach(first, slot);
  table.attach(second, 4);
  table.detach(3);
  std::vector<std::uint32_t> slots;
  for (std::uint32_t slot = table.firstSlot(first); slot != VoiceTable::kNone;
       slot = table.nextSlot(slot))
    slots.push_back(slot);
  std::ranges::sort(slots);
  EXPECT_EQ(slots, (std::vector<std::uint32_t>{0, 5}));
  table.detach(0);
  table.detach(5);
  EXPECT_EQ(table.size(), 1U);
  EXPECT_EQ(table.quietest(), second);
}

TEST(VoiceTable, AllocatesOnlyInReserve) {
  VoiceTable table;
  table.reserve(100, 300);
  const test::NoAllocScope scope;
  for (int round = 0; round < 3; ++round) {
    for (std::uint32_t slot = 0; !table.isFull(); ++slot)
      table.attach(table.add(0.01 * slot), slot);
    for (std::uint32_t slot = 0; slot < 100; ++slot)
      table.detach(slot);
  }
  EXPECT_EQ(scope.allocations(), 0U);
}

}  // namespace
}  // namespace carom
