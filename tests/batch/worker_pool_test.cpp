#include "lab/batch/worker_pool.h"

#include <cstdint>
#include <cstdlib>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

namespace carom::lab {
namespace {

using testing::HasSubstr;

/// The ends of jobs 0 to `number` - 1.
std::map<std::uint64_t, JobEnd> endsOf(std::uint64_t number,
                                       const std::function<std::string(std::uint64_t)>& answer,
                                       const PoolSettings& settings) {
  std::map<std::uint64_t, JobEnd> ends;
  std::uint64_t next = 0;
  PoolWork work;
  work.next = [&]() -> std::optional<std::uint64_t> {
    if (next == number) return std::nullopt;
    return next++;
  };
  work.answer = [&](std::uint64_t job, const std::function<void()>&) { return answer(job); };
  work.ended = [&](const JobEnd& end) {
    EXPECT_TRUE(ends.emplace(end.job, end).second) << "job " << end.job << " ended twice";
    return true;
  };
  const Status done = runPool(work, settings);
  EXPECT_TRUE(done) << done.error().message;
  return ends;
}

TEST(WorkerPool, EveryJobIsAnsweredOnce) {
  for (const std::size_t processes : {1U, 2U, 5U}) {
    const auto ends = endsOf(20, [](std::uint64_t job) { return std::string(1000 * job, 'x'); },
                             {.processes = processes});
    ASSERT_EQ(ends.size(), 20U);
    for (const auto& [job, end] : ends) {
      EXPECT_TRUE(end.hasAnswer);
      EXPECT_EQ(end.text.size(), 1000 * job);
    }
  }
}

TEST(WorkerPool, JobsRunInOtherProcesses) {
  const auto ends =
      endsOf(4, [](std::uint64_t) { return std::to_string(::getpid()); }, {.processes = 2});
  for (const auto& [job, end] : ends)
    EXPECT_NE(end.text, std::to_string(::getpid()));
}

TEST(WorkerPool, OneThatCrashesCostsItself) {
  const auto answer = [](std::uint64_t job) {
    if (job == 3) ::kill(::getpid(), SIGKILL);  // which no sanitizer turns into an exit
    if (job == 5) ::_exit(7);
    return std::string("well");
  };
  const auto ends = endsOf(10, answer, {.processes = 2});
  ASSERT_EQ(ends.size(), 10U);
  for (const auto& [job, end] : ends)
    EXPECT_EQ(end.hasAnswer, job != 3 && job != 5) << job;
  EXPECT_THAT(ends.at(3).text, HasSubstr("signal 9"));
  EXPECT_THAT(ends.at(5).text, HasSubstr("exit code 7"));
}

TEST(WorkerPool, OneThatSaysThatItGoesOnIsNotEnded) {
  std::vector<JobEnd> ends;
  std::uint64_t next = 0;
  PoolWork work;
  work.next = [&]() -> std::optional<std::uint64_t> {
    if (next == 2) return std::nullopt;
    return next++;
  };
  work.answer = [](std::uint64_t, const std::function<void()>& goesOn) {
    for (int time = 0; time < 8; ++time) {
      ::usleep(200'000);
      goesOn();
    }
    return std::string("well");
  };
  work.ended = [&](const JobEnd& end) {
    ends.push_back(end);
    return true;
  };
  ASSERT_TRUE(runPool(work, {.processes = 2, .longest = 1.0}));
  ASSERT_EQ(ends.size(), 2U);
  for (const JobEnd& end : ends) {
    EXPECT_TRUE(end.hasAnswer);
    EXPECT_EQ(end.text, "well");
  }
}

TEST(WorkerPool, OneThatHangsCostsItself) {
  const auto answer = [](std::uint64_t job) {
    while (job == 1)
      ::usleep(1000);
    return std::string("well");
  };
  const auto ends = endsOf(4, answer, {.processes = 2, .longest = 0.3});
  ASSERT_EQ(ends.size(), 4U);
  EXPECT_TRUE(ends.at(1).isHung);
  EXPECT_FALSE(ends.at(1).hasAnswer);
  for (const std::uint64_t job : {0U, 2U, 3U})
    EXPECT_TRUE(ends.at(job).hasAnswer);
}

TEST(WorkerPool, StopsWhereItIsTold) {
  std::uint64_t next = 0;
  int ended = 0;
  PoolWork work;
  work.next = [&]() -> std::optional<std::uint64_t> { return next++; };
  work.answer = [](std::uint64_t, const std::function<void()>&) { return std::string(); };
  work.ended = [&](const JobEnd&) { return ++ended < 5; };
  EXPECT_TRUE(runPool(work, {.processes = 2}));
  EXPECT_LE(ended, 6);  // another may have been under way
}

TEST(WorkerPool, EachProcessBeginsFirst) {
  static int begun = 0;
  PoolWork work;
  std::uint64_t next = 0;
  work.next = [&]() -> std::optional<std::uint64_t> {
    if (next == 6) return std::nullopt;
    return next++;
  };
  work.begin = [] { ++begun; };
  work.answer = [](std::uint64_t, const std::function<void()>&) { return std::to_string(begun); };
  work.ended = [](const JobEnd& end) {
    EXPECT_EQ(end.text, "1");
    return true;
  };
  EXPECT_TRUE(runPool(work, {.processes = 2}));
  EXPECT_EQ(begun, 0);  // here
}

}  // namespace
}  // namespace carom::lab
