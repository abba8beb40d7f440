#pragma once

#include <cstddef>
#include <functional>

#if CAROM_THREADS
#include <atomic>
#include <cstdint>
#include <thread>
#endif

namespace carom::native {

/// A second thread that does one of two halves at a time; both halves are done by the caller in a
/// build without threads. Internal to native/. [one thread]
class JelloWorker {
 public:
#if CAROM_THREADS
  JelloWorker();
  ~JelloWorker();
  JelloWorker(const JelloWorker&) = delete;
  JelloWorker& operator=(const JelloWorker&) = delete;
#endif

  /// Calls half(0) here and half(1) there, and returns when both have. Neither throws.
  void run(const std::function<void(std::size_t)>& half);

#if CAROM_THREADS
 private:
  void work();

  const std::function<void(std::size_t)>* half_ = nullptr;
  std::atomic<std::uint32_t> asked_ = 0;  // how often, plus one to end
  std::atomic<std::uint32_t> done_ = 0;
  bool ends_ = false;
  std::thread thread_;
#endif
};

}  // namespace carom::native
