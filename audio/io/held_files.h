#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

namespace carom::audio {

/// Returns the bytes of a file that a program without files of its own holds in memory, or null.
using HeldFiles = const std::vector<std::byte>* (*)(std::string_view path);

/// Has readBytes and isRegularFile ask `held` from now on. Only a build with CAROM_FILES=OFF has
/// it. [one thread]
void setHeldFiles(HeldFiles held);

}  // namespace carom::audio
