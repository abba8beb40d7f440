#pragma once

#include <atomic>
#include <map>
#include <string>

#include "plugin/listen/listen_protocol.h"

namespace carom::listen {

/// A kind of Bullet: its scalar, and the library that makes sound for it.
struct BulletKind {
  const char* scalar;   ///< "float" or "double"
  const char* library;  ///< file beside this one
};

/// The functions of a library with the sound.
struct SoundFunctions {
  WorldFunction beforeStep = nullptr;
  WorldFunction afterStep = nullptr;
  WorldFunction worldEnds = nullptr;
};

/// The library with the sound for one kind of Bullet, opened when a world of that kind is first
/// stepped: a process without worlds, such as a shell that starts the program, is left alone.
class SoundLibrary {
 public:
  explicit SoundLibrary(const BulletKind& kind) : kind_(kind) {}

  /// Opens the library for the Bullet in which `step` is, of that mangled name; a process may have
  /// several. Returns null, and tells the user why, if there is none for that Bullet, or the
  /// process is not the one that is heard. [any thread]
  const SoundFunctions* open(const void* step, const char* name);
  /// Returns the functions if the library is open in this process. [any thread]
  const SoundFunctions* opened() const;

 private:
  bool isOfUse(const void* step, const char* name);
  std::string fault(const void* step, const char* name);

  BulletKind kind_;
  std::map<const void*, bool> known_;  // Bullets, by `step`: true for those that are heard
  SoundFunctions functions_;
  std::atomic<bool> isOpen_ = false;
};

/// True in the process that is heard: the first that has asked. Not in its forks. [any thread]
bool isHeardProcess();

}  // namespace carom::listen
