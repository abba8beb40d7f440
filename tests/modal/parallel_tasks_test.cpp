#include "modal/radiation/parallel_tasks.h"

#include <atomic>
#include <cstddef>
#include <stdexcept>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace carom::test {

using namespace modal;

namespace {

TEST(ParallelTasks, DoEachOnce) {
  for (const std::size_t threads : {1U, 2U, 7U, 50U}) {
    std::vector<std::atomic<int>> done(20);
    EXPECT_TRUE(runTasks(
        done.size(), threads, [&](std::size_t task) { ++done[task]; },
        [](std::size_t) { return true; }));
    for (const std::atomic<int>& times : done)
      EXPECT_EQ(times.load(), 1) << threads;
  }
  const auto never = [](std::size_t) -> bool { throw std::logic_error("asked"); };
  EXPECT_TRUE(runTasks(
      0, 3, [](std::size_t) { throw std::logic_error("called"); }, never));
}

TEST(ParallelTasks, BeginNoOtherOnceTheyAreToEnd) {
  std::atomic<int> done = 0;
  EXPECT_FALSE(runTasks(
      1000, 1, [&](std::size_t) { ++done; }, [](std::size_t begun) { return begun < 10; }));
  EXPECT_EQ(done, 10);
  std::atomic<bool> isAsked = false;  // until then no task ends
  EXPECT_FALSE(runTasks(
      1000, 4,
      [&](std::size_t) {
        while (!isAsked)
          std::this_thread::yield();
      },
      [&](std::size_t) {
        isAsked = true;
        return false;
      }));
}

TEST(ParallelTasks, PassOnWhatOneThrows) {
  for (const std::size_t threads : {1U, 3U}) {
    const auto one = [](std::size_t task) {
      if (task == 5) throw std::runtime_error("five");
    };
    EXPECT_THROW(runTasks(20, threads, one, [](std::size_t) { return true; }), std::runtime_error);
  }
}

}  // namespace
}  // namespace carom::test
