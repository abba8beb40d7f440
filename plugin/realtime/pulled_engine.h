#pragma once

#include <atomic>

#if CAROM_THREADS
#include <thread>
#endif

namespace carom::plugin {

class SoundEngine;

/// The engine that a host's audio callback pulls from, which the simulation may take away at any
/// time. A pull is wait-free; whoever takes the engine away waits for the pull that has it, which
/// takes a block at most.
class PulledEngine {
 public:
  /// Shows an engine where there was none. [simulation thread]
  void show(SoundEngine& engine) noexcept { engine_ = &engine; }
  /// Takes the engine away, if there is one: when this returns, nobody uses it. [simulation thread]
  void hide() noexcept {
    engine_ = nullptr;
    // A pull that begins now finds no engine, and one that has found it counts already: both
    // threads write before they read, and all four have one order.
#if CAROM_THREADS
    while (pulls_ > 0)
      std::this_thread::yield();
#endif
  }
  /// Calls `render` with the engine, or with null if there is none. [audio thread]
  template <class Render>
  void pull(const Render& render) noexcept {
    ++pulls_;
    render(engine_.load());
    --pulls_;
  }

 private:
  std::atomic<SoundEngine*> engine_ = nullptr;
  std::atomic<int> pulls_ = 0;  // that are under way
};

}  // namespace carom::plugin
