#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <system_error>
#include <vector>

#include "audio/io/partial_file.h"
#include "carom/audio/result.h"

namespace carom::audio {

/// Reads all of a regular file of at most 1 GiB. Errors, without the file's name: it is missing, a
/// folder, something else, too large, or may not be read. Not for files that are being written.
/// [any thread; blocks on the disk]
Result<std::vector<std::byte>> readBytes(const std::filesystem::path& path);

/// True if there is a regular file of that name. [any thread; blocks on the disk]
bool isRegularFile(const std::filesystem::path& path);

/// Makes a folder, and those that it is in. No error if it is there. [any thread; blocks on the
/// disk]
std::error_code makeFolder(const std::filesystem::path& folder);

/// True if the file, once all symbolic links are followed, is in the folder or below it, whether it
/// is there or not. [any thread; blocks on the disk]
bool isBelow(const std::filesystem::path& file, const std::filesystem::path& folder);

/// Writes a file that appears whole or not at all, and replaces a file of that name: see
/// PartialFile. [any thread; blocks on the disk]
Status writeBytes(const std::filesystem::path& path, std::span<const std::byte> bytes,
                  Sync sync = Sync::disk);

}  // namespace carom::audio
