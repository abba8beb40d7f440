#include "plugin/realtime/spsc_queue.h"

#include <algorithm>
#include <cstdint>
#include <thread>

#include <gtest/gtest.h>

#include "tests/support/no_alloc_scope.h"
#include "tests/support/random.h"

namespace carom {

using namespace plugin;

namespace {

TEST(SpscQueue, HoldsAsManyAsItSays) {
  SpscQueue<int> queue(100);
  EXPECT_EQ(queue.capacity(), 128U);
  EXPECT_EQ(queue.writable(1), 128U);
  for (int i = 0; i < 128; ++i)
    queue.put(i);
  EXPECT_EQ(queue.writable(1), 0U);
  EXPECT_EQ(queue.readable(1), 0U);  // not published
  queue.publish();
  EXPECT_EQ(queue.readable(1), 128U);
  EXPECT_EQ(queue.peek(), 0);
  EXPECT_EQ(queue.peek(127), 127);
  queue.drop(3);
  EXPECT_EQ(queue.peek(), 3);
  EXPECT_EQ(queue.writable(3), 3U);
}

TEST(SpscQueue, AllocatesNothing) {
  SpscQueue<int> queue(16);
  const test::NoAllocScope scope;
  for (int i = 0; i < 100; ++i) {
    ASSERT_GE(queue.writable(1), 1U);
    queue.put(i);
    queue.publish();
    ASSERT_EQ(queue.readable(1), 1U);
    queue.drop(1);
  }
  EXPECT_EQ(scope.allocations(), 0U);
}

// Groups of items cross whole and in order, however the threads run. The thread sanitizer checks
// this test as well.
TEST(SpscQueue, HandsGroupsOverWholeAndInOrder) {
  struct Item {
    std::uint64_t number = 0;
    std::uint64_t left = 0;  // number of items left in its group
  };
  constexpr std::uint64_t kItems = 300000;
  SpscQueue<Item> queue(64);
  std::thread writer([&queue] {
    Random random(2);
    const auto groupSize = [&random] { return static_cast<std::uint64_t>(random.below(20)) + 1; };
    for (std::uint64_t number = 0; number < kItems;) {
      const std::uint64_t group = std::min(kItems - number, groupSize());
      if (queue.writable(group) < group) {
        std::this_thread::yield();
        continue;
      }
      for (std::uint64_t left = group; left > 0; --left)
        queue.put({number++, left});
      queue.publish();
    }
  });
  std::uint64_t expected = 0;
  std::uint64_t torn = 0;
  while (expected < kItems) {
    if (queue.readable(1) == 0) {
      std::this_thread::yield();
      continue;
    }
    const std::uint64_t group = queue.peek().left;
    torn += queue.readable(group) < group ? 1U : 0U;
    for (std::uint64_t i = 0; i < group; ++i)
      torn += queue.peek(i).number == expected + i ? 0U : 1U;
    expected += group;
    queue.drop(group);
  }
  writer.join();
  EXPECT_EQ(torn, 0U);
}

}  // namespace
}  // namespace carom
