#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <unordered_map>

#include "carom/sound.h"

class btDiscreteDynamicsWorld;

namespace carom::listen {

/// The worlds of a program that knows nothing of Carom, and their sounds, by the options of
/// `carom listen`. Nothing is told to the program, but all to the report.
///
/// Each world has a lock, held during its steps: a program may end in one thread while another one
/// steps, and the recordings are to be completed then. They are without the lock if a step takes
/// longer than the end may wait.
class HeardWorlds {
 public:
  /// Never destroyed: worlds may be static.
  static HeardWorlds& instance();

  // [the thread that steps the world]
  void beforeStep(btDiscreteDynamicsWorld& world);
  void afterStep(const void* world);

  /// Completes the recording of a world that is about to be destroyed. [any thread]
  void end(const void* world);
  /// Completes all recordings, at the end of the program. [any thread]
  void endAll();

 private:
  struct HeardWorld {
    std::recursive_timed_mutex mutex;
    int number = 0;               // of its file
    const void* table = nullptr;  // of the world's class, when its sound was attached
    std::optional<Sound> sound;
  };

  HeardWorlds() = default;
  std::shared_ptr<HeardWorld> find(const void* world);
  std::shared_ptr<HeardWorld> add(btDiscreteDynamicsWorld& world);
  static void attach(HeardWorld& heard, btDiscreteDynamicsWorld& world);
  static void close(HeardWorld& heard);
  static void abandon(HeardWorld& heard);

  /// True in the process that was listened to, false in its forks, which have a copy of it.
  bool isOwnProcess() const;

  std::mutex mutex_;
  int process_ = -1;  // in which a sound was first attached
  std::unordered_map<const void*, std::shared_ptr<HeardWorld>> worlds_;
};

}  // namespace carom::listen
