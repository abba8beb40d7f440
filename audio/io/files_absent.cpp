// Takes the place of byte_file.cpp and partial_file.cpp on platforms that have no files.
#include <system_error>
#include <utility>

#include "audio/io/byte_file.h"
#include "audio/io/partial_file.h"

namespace carom::audio {

namespace fs = std::filesystem;

namespace {

constexpr const char* kNoFiles = "this build of Carom has no files (CAROM_FILES=OFF)";

}  // namespace

Result<std::vector<std::byte>> readBytes(const fs::path& /*path*/) {
  return Error{kNoFiles};
}

Status writeBytes(const fs::path& path, std::span<const std::byte> /*bytes*/, Sync /*sync*/) {
  return Error{path.string() + ": cannot be written: " + kNoFiles};
}

PartialFile::PartialFile(const fs::path& finalPath, Leftover /*leftover*/)
    : finalPath_(finalPath), path_(finalPath) {}
PartialFile::PartialFile(PartialFile&& other) noexcept
    : finalPath_(std::move(other.finalPath_)), path_(std::exchange(other.path_, {})) {}
PartialFile::~PartialFile() = default;

std::vector<fs::path> PartialFile::keepLeftovers(
    const fs::path& /*finalPath*/, const std::function<bool(const fs::path&)>& /*isOfUse*/) {
  return {};
}

void PartialFile::removeAll() {}

Result<fs::path> PartialFile::keepIncomplete() {
  return Error{kNoFiles};
}

std::error_code PartialFile::giveName(Sync) {
  return std::make_error_code(std::errc::function_not_supported);
}

Status checkWritable(const fs::path& /*path*/) {
  return Error{kNoFiles};
}

bool isSameFile(const fs::path& path, const fs::path& other) {
  return path == other;
}

}  // namespace carom::audio
