#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <thread>

namespace carom {

/// A second thread that does one of two halves at a time. Internal to native/. [one thread]
class JelloWorker {
 public:
  JelloWorker();
  ~JelloWorker();
  JelloWorker(const JelloWorker&) = delete;
  JelloWorker& operator=(const JelloWorker&) = delete;

  /// Calls half(0) here and half(1) there, and returns when both have. Neither throws.
  void run(const std::function<void(std::size_t)>& half);

 private:
  void work();

  const std::function<void(std::size_t)>* half_ = nullptr;
  std::atomic<std::uint32_t> asked_ = 0;  // how often, plus one to end
  std::atomic<std::uint32_t> done_ = 0;
  bool ends_ = false;
  std::thread thread_;
};

}  // namespace carom
