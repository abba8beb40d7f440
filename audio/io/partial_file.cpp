#include "audio/io/partial_file.h"

#include <random>
#include <sstream>
#include <utility>

namespace carom::audio {

namespace fs = std::filesystem;

PartialFile::PartialFile(const fs::path& finalPath) {
  // An absolute path, as the working directory may change before the file gets its name.
  std::error_code failed;
  finalPath_ = fs::absolute(finalPath, failed);
  if (failed) finalPath_ = finalPath;
  path_ = finalPath_;
  std::ostringstream suffix;
  suffix << '.' << std::hex << std::random_device{}() << ".partial";
  path_ += suffix.str();
}

PartialFile::PartialFile(PartialFile&& other) noexcept
    : finalPath_(std::move(other.finalPath_)), path_(std::exchange(other.path_, {})) {}

PartialFile::~PartialFile() {
  std::error_code ignored;
  if (!path_.empty()) fs::remove(path_, ignored);
}

std::error_code PartialFile::giveName() {
  std::error_code reason;
  fs::rename(path_, finalPath_, reason);
  if (!reason) path_.clear();
  return reason;
}

Status checkWritable(const fs::path& path) {
  std::error_code ignored;
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  if (!path.has_filename()) return Error{"it names no file"};
  if (fs::is_directory(path, ignored)) return Error{"a folder has this name"};
  if (fs::exists(path, ignored) && !fs::is_regular_file(path, ignored))
    return Error{"what has this name is no regular file"};
  if (!fs::is_directory(folder, ignored))
    return Error{"folder '" + folder.string() + "' does not exist; create it first"};
  return std::monostate{};
}

bool isSameFile(const fs::path& path, const fs::path& other) {
  std::error_code reason;
  const fs::path canonical = fs::weakly_canonical(fs::absolute(path, reason), reason);
  const fs::path otherCanonical = fs::weakly_canonical(fs::absolute(other, reason), reason);
  return !reason && canonical == otherCanonical;
}

}  // namespace carom::audio
