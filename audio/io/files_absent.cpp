// Takes the place of byte_file.cpp and partial_file.cpp on platforms that have no files.
#include <algorithm>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "audio/io/byte_file.h"
#include "audio/io/held_files.h"
#include "audio/io/partial_file.h"

namespace carom::audio {

namespace fs = std::filesystem;

namespace {

constexpr const char* kNoFiles = "this build of Carom has no files (CAROM_FILES=OFF)";

HeldFiles heldFiles = nullptr;

const std::vector<std::byte>* heldFile(const fs::path& path) {
  return heldFiles == nullptr ? nullptr : heldFiles(path.native());
}

}  // namespace

void setHeldFiles(HeldFiles held) {
  heldFiles = held;
}

Result<std::vector<std::byte>> readBytes(const fs::path& path) {
  if (const std::vector<std::byte>* const bytes = heldFile(path)) return *bytes;
  return Error{kNoFiles};
}

bool isRegularFile(const fs::path& path) {
  return heldFile(path) != nullptr;
}

std::error_code makeFolder(const fs::path& /*folder*/) {
  return std::make_error_code(std::errc::function_not_supported);
}

/// Looks at the names alone, as there are no links.
bool isBelow(const fs::path& file, const fs::path& folder) {
  const std::string& base = folder.native();
  std::string_view way = file.native();
  if (!base.empty()) {
    if (!way.starts_with(base)) return false;
    way.remove_prefix(base.size());
    if (way.starts_with('/')) way.remove_prefix(1);
  }
  if (way.starts_with('/')) return false;
  for (std::size_t end = 0; end != std::string_view::npos;) {
    end = way.find('/');
    if (way.substr(0, end) == "..") return false;
    way.remove_prefix(std::min(end, way.size() - 1) + 1);
  }
  return true;
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
