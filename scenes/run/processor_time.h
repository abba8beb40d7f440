#pragma once

#include <chrono>
#include <ctime>

namespace carom::scenes {

/// Returns the time (s) that the process has computed, on all threads, since some instant. A
/// WebAssembly module has only a clock, and one thread. [any thread]
inline double processorSeconds() {
#if defined(__wasi__)
  using Clock = std::chrono::steady_clock;
  return std::chrono::duration<double>(Clock::now().time_since_epoch()).count();
#else
  return static_cast<double>(std::clock()) / static_cast<double>(CLOCKS_PER_SEC);
#endif
}

}  // namespace carom::scenes
