#include "modal/radiation/parallel_tasks.h"

#if CAROM_THREADS

#include <algorithm>
#include <atomic>
#include <exception>
#include <system_error>
#include <thread>
#include <vector>

#endif

namespace carom::modal {

#if CAROM_THREADS

namespace {

// The tasks that are left, of which each worker takes the next.
class Tasks {
 public:
  using Asked = std::function<bool(std::size_t)>;

  Tasks(std::size_t count, const std::function<void(std::size_t)>& task)
      : count_(count), task_(task) {}

  // Works until no task is left; false if goesOn has ended it.
  bool work(const Asked& goesOn, std::exception_ptr& thrown) {
    try {
      for (std::size_t begun = next_; begun < count_; begun = next_) {
        if (!goesOn(begun)) {
          next_ = count_;
          return false;
        }
        const std::size_t mine = next_++;
        if (mine < count_) task_(mine);
      }
    } catch (...) {
      thrown = std::current_exception();
      next_ = count_;
    }
    return true;
  }

 private:
  std::size_t count_;
  const std::function<void(std::size_t)>& task_;
  std::atomic<std::size_t> next_ = 0;
};

}  // namespace

std::size_t processorCount() {
  return std::max(std::thread::hardware_concurrency(), 1U);
}

bool runTasks(std::size_t count, std::size_t threads, const std::function<void(std::size_t)>& task,
              const std::function<bool(std::size_t)>& goesOn) {
  threads = std::clamp<std::size_t>(threads, 1, std::max<std::size_t>(count, 1));
  Tasks tasks(count, task);
  std::vector<std::exception_ptr> thrown(threads);
  std::vector<std::thread> others;
  others.reserve(threads - 1);
  try {
    while (others.size() + 1 < threads)
      others.emplace_back([&tasks, &mine = thrown[others.size() + 1]] {
        (void)tasks.work([](std::size_t) { return true; }, mine);
      });
  } catch (const std::system_error&) {
    // The system has no more threads: those that are there do it.
  }
  const bool isWhole = tasks.work(goesOn, thrown.front());
  for (std::thread& other : others)
    other.join();
  for (const std::exception_ptr& exception : thrown)
    if (exception) std::rethrow_exception(exception);
  return isWhole;
}

#else

std::size_t processorCount() {
  return 1;
}

bool runTasks(std::size_t count, std::size_t, const std::function<void(std::size_t)>& task,
              const std::function<bool(std::size_t)>& goesOn) {
  for (std::size_t next = 0; next < count; ++next) {
    if (!goesOn(next)) return false;
    task(next);
  }
  return true;
}

#endif

}  // namespace carom::modal
