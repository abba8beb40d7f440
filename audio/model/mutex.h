#pragma once

#include <utility>

#if CAROM_THREADS
#include <mutex>
#endif

namespace carom::audio {

// Mutexes guard the few things that a process shares: caches of tables, the registry of hooked
// worlds. A build for a platform without threads (CAROM_THREADS=OFF) has nothing to guard.

#if CAROM_THREADS
using Mutex = std::mutex;
using OnceFlag = std::once_flag;
#else
struct Mutex {
  void lock() {}
  void unlock() {}
};
struct OnceFlag {
  bool done = false;
};
#endif

/// Calls `make` the first time that it is called with this flag; threads that call meanwhile wait
/// for it.
template <class Make>
void callOnce(OnceFlag& flag, Make&& make) {
#if CAROM_THREADS
  std::call_once(flag, std::forward<Make>(make));
#else
  if (!flag.done) make();
  flag.done = true;
#endif
}

/// Holds a mutex for as long as it lives.
class MutexLock {
 public:
  explicit MutexLock(Mutex& mutex) : mutex_(mutex) { mutex_.lock(); }
  ~MutexLock() { mutex_.unlock(); }
  MutexLock(const MutexLock&) = delete;
  MutexLock& operator=(const MutexLock&) = delete;

 private:
  Mutex& mutex_;
};

}  // namespace carom::audio
