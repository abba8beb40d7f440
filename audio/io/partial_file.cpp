#include "audio/io/partial_file.h"

#include <memory>
#include <random>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#if __has_include(<sys/file.h>)
#include <dirent.h>
#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>
#define CAROM_FILE_LOCKS 1
#else
#define CAROM_FILE_LOCKS 0
#endif

namespace carom::audio {

namespace fs = std::filesystem;

namespace {

constexpr std::string_view kEnding = ".partial";

// The system drops a lock when its process ends, in whichever way.
#if CAROM_FILE_LOCKS
void unlock(int lock) {
  if (lock >= 0) ::close(lock);
}

/// Opens a file and locks it; -1 if that cannot be, or if another holds the lock.
int lockFile(const fs::path& path, int flags) {
  const int file = ::open(path.c_str(), O_RDWR | O_CLOEXEC | flags, 0666);
  if (file < 0 || ::flock(file, LOCK_EX | LOCK_NB) == 0) return file;
  unlock(file);
  return -1;
}

int createLocked(const fs::path& path) {
  return lockFile(path, O_CREAT | O_EXCL);
}

/// Returns the names in a folder; none if it cannot be read. (libstdc++'s directory_iterator ends
/// the program where memory lacks.)
std::vector<std::string> namesIn(const fs::path& folder) {
  struct Close {
    void operator()(DIR* opened) const { ::closedir(opened); }
  };
  std::vector<std::string> names;
  const std::unique_ptr<DIR, Close> opened(::opendir(folder.c_str()));
  if (opened == nullptr) return names;
  while (const dirent* const entry = ::readdir(opened.get()))
    names.emplace_back(entry->d_name);
  return names;
}

void removeUnlessLocked(const fs::path& path) {
  const int lock = lockFile(path, 0);
  if (lock < 0) return;
  std::error_code ignored;
  fs::remove(path, ignored);
  unlock(lock);
}
#else
void unlock(int) {}
int createLocked(const fs::path&) {
  return -1;
}
std::vector<std::string> namesIn(const fs::path&) {
  return {};
}
void removeUnlessLocked(const fs::path&) {}
#endif

/// Returns an absolute path, as the working directory may change before the file gets its name.
fs::path absolutePath(const fs::path& path) {
  std::error_code failed;
  fs::path absolute = fs::absolute(path, failed);
  return failed ? path : absolute;
}

/// True for the name of a partial file that is to become `final`.
bool isPartialOf(std::string_view name, std::string_view final) {
  if (!name.starts_with(final) || !name.ends_with(kEnding)) return false;
  if (name.size() < final.size() + kEnding.size() + 2 || name[final.size()] != '.') return false;
  name.remove_prefix(final.size() + 1);
  name.remove_suffix(kEnding.size());
  return name.find_first_not_of("0123456789abcdef") == std::string_view::npos;
}

}  // namespace

PartialFile::PartialFile(const fs::path& finalPath)
    : finalPath_(absolutePath(finalPath)), path_(finalPath_) {
  std::ostringstream suffix;
  suffix << '.' << std::hex << std::random_device{}() << kEnding;
  path_ += suffix.str();
  lock_ = createLocked(path_);
}

PartialFile::PartialFile(PartialFile&& other) noexcept
    : finalPath_(std::move(other.finalPath_)),
      path_(std::exchange(other.path_, {})),
      lock_(std::exchange(other.lock_, -1)) {}

PartialFile::~PartialFile() {
  std::error_code ignored;
  if (!path_.empty()) fs::remove(path_, ignored);
  unlock(lock_);
}

std::error_code PartialFile::giveName() {
  std::error_code reason;
  fs::rename(path_, finalPath_, reason);
  if (!reason) path_.clear();
  return reason;
}

void PartialFile::removeLeftovers(const fs::path& finalPath) {
  const fs::path final = absolutePath(finalPath);
  const std::string name = final.filename().string();
  for (const std::string& other : namesIn(final.parent_path()))
    if (isPartialOf(other, name)) removeUnlessLocked(final.parent_path() / other);
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
