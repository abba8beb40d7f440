#pragma once

#include <ctime>

namespace carom::bench {

/// CPU time of the calling thread in seconds, from POSIX's clock.
inline double cpuSeconds() {
  std::timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

}  // namespace carom::bench
