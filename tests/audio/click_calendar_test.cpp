#include "audio/synthesis/click_calendar.h"

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/no_alloc_scope.h"
#include "tests/support/random.h"

namespace carom {

using namespace audio;

namespace {

/// Slots of the entries, ascending.
std::vector<std::uint32_t> slotsOf(std::span<const ClickCalendar::Entry> entries) {
  std::vector<std::uint32_t> slots;
  for (const ClickCalendar::Entry& entry : entries)
    slots.push_back(entry.slot);
  std::ranges::sort(slots);
  return slots;
}

// The oracle is a list that is searched from end to end.
TEST(ClickCalendar, GivesWhatBeginsBeforeTheEndOnce) {
  Random random(5);
  for (const std::int64_t origin :
       {std::int64_t{0}, std::int64_t{-1000000}, std::int64_t{1} << 50}) {
    ClickCalendar queue;
    std::vector<ClickCalendar::Entry> list;
    std::vector<std::uint32_t> free;
    std::uint32_t slots = 0;
    std::int64_t now = origin;
    for (int turn = 0; turn < 2000; ++turn) {
      for (int i = random.below(6); i > 0; --i) {
        // Begins late, soon, or more than a lap of the calendar ahead.
        const double ahead =
            random.chance(0.1) ? random.between(0.0, 1e6) : random.between(-500.0, 5000.0);
        std::uint32_t slot = slots;
        if (free.empty()) {
          ++slots;
        } else {
          slot = free.back();
          free.pop_back();
        }
        list.push_back({now + static_cast<std::int64_t>(ahead), random.between(0.0, 1.0), slot});
        queue.push(list.back(), now);
      }
      const std::int64_t end = now + 1 + random.below(random.chance(0.1) ? 300000 : 400);
      std::vector<ClickCalendar::Entry> wanted;
      std::erase_if(list, [&](const ClickCalendar::Entry& entry) {
        if (entry.first < end) wanted.push_back(entry);
        return entry.first < end;
      });
      const std::span<ClickCalendar::Entry> taken = queue.takeUntil(now, end);
      ASSERT_EQ(slotsOf(taken), slotsOf(wanted)) << turn;
      for (const ClickCalendar::Entry& entry : taken)
        free.push_back(entry.slot);
      ASSERT_EQ(queue.size(), list.size());
      now = end;
    }
  }
}

TEST(ClickCalendar, TakingDoesNotAllocate) {
  ClickCalendar queue;
  for (std::uint32_t slot = 0; slot < 1000; ++slot)
    queue.push({static_cast<std::int64_t>(slot), 0.0, slot}, 0);
  const test::NoAllocScope scope;
  EXPECT_EQ(queue.takeUntil(0, 500).size(), 500u);
  EXPECT_EQ(queue.takeUntil(500, 5000).size(), 500u);
  EXPECT_EQ(scope.allocations(), 0u);
}

TEST(ClickCalendar, ClearedItIsEmpty) {
  ClickCalendar queue;
  queue.push({10, 0.0, 0}, 0);
  queue.clear();
  EXPECT_EQ(queue.size(), 0u);
  EXPECT_TRUE(queue.takeUntil(0, 1000).empty());
}

}  // namespace
}  // namespace carom
