#pragma once

#include <cstddef>
#include <functional>

#if CAROM_THREADS
#include <atomic>
#include <cstdint>
#include <thread>
#endif

namespace carom::native {

/// A second thread that does one of two halves at a time; in a build without threads the caller
/// does both halves. Internal to native/. [one thread]
class JelloWorker {
 public:
#if CAROM_THREADS
  JelloWorker();
  ~JelloWorker();
  JelloWorker(const JelloWorker&) = delete;
  JelloWorker& operator=(const JelloWorker&) = delete;
#endif

  /// True if two threads would run at once.
  static bool isOfUse();

  /// Calls half(0) in this thread and half(1) in the second one, and returns when both have
  /// finished. Neither throws.
  void run(const std::function<void(std::size_t)>& half);

#if CAROM_THREADS
 private:
  void work();

  const std::function<void(std::size_t)>* half_ = nullptr;
  std::atomic<std::uint32_t> asked_ = 0;  // number of requests, the one to end included
  std::atomic<std::uint32_t> done_ = 0;
  bool ends_ = false;
  std::thread thread_;
#endif
};

}  // namespace carom::native
