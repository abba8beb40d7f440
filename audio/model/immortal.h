#pragma once

#include <type_traits>
#include <utility>

namespace carom::audio {

/// Notes a value that `immortal` has made, with what deletes it. [any thread]
void noteImmortal(void* value, void (*remove)(void*));

/// Deletes all values that `immortal` has made, for a library that is about to be unloaded: nothing
/// of it may be called any more. [one thread, the last]
void deleteImmortals();

/// Makes a value that is never destroyed, for a table that is made when it is first needed. A sound
/// may be a static object that is older than the table: it goes later, and still needs it to finish
/// its recording.
///
///     static const auto& table = immortal([] { return makeTable(); });
template <class Make>
auto& immortal(Make&& make) {
  auto* const value = new auto(std::forward<Make>(make)());
  using Value = std::remove_reference_t<decltype(*value)>;
  noteImmortal(value, [](void* made) { delete static_cast<Value*>(made); });
  return *value;
}

}  // namespace carom::audio
