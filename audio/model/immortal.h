#pragma once

#include <utility>

namespace carom::audio {

/// Makes a value that is never destroyed, for a table that is made when it is first needed. A sound
/// may be a static object that is older than the table: it goes later, and still needs it to finish
/// its recording.
///
///     static const auto& table = immortal([] { return makeTable(); });
template <class Make>
auto& immortal(Make&& make) {
  return *new auto(std::forward<Make>(make)());
}

}  // namespace carom::audio
