#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "audio/result.h"

namespace carom {

/// All of a regular file of at most 1 GiB. Errors, without its name: it is missing, a folder,
/// something else, too large, or may not be read. [any thread but the audio thread]
Result<std::vector<std::byte>> bytesOfFile(const std::filesystem::path& path);

/// At most 120 characters, all of them printable: names and messages from outside may be long and
/// hold anything. [any thread]
std::string printable(std::string_view text);

}  // namespace carom
