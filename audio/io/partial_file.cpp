#include "audio/io/partial_file.h"

#include <cerrno>
#include <memory>
#include <random>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "audio/model/immortal.h"
#include "audio/model/mutex.h"

#if __has_include(<sys/file.h>)
#include <dirent.h>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#define CAROM_FILE_LOCKS 1
#else
#define CAROM_FILE_LOCKS 0
#endif

namespace carom::audio {

namespace fs = std::filesystem;

namespace {

constexpr std::string_view kEnding = ".partial";
/// Names that are tried, before it is given up.
constexpr int kTries = 1000;

// The system drops a lock when its process ends, in whichever way.
#if CAROM_FILE_LOCKS
void unlock(int lock) {
  if (lock >= 0) ::close(lock);
}

/// Opens a file and locks it; -1 if that cannot be, or if another holds the lock.
int lockFile(const fs::path& path) {
  const int file = ::open(path.c_str(), O_RDWR | O_CLOEXEC);
  if (file < 0 || ::flock(file, LOCK_EX | LOCK_NB) == 0) return file;
  unlock(file);
  return -1;
}

/// Creates a file and locks it; -1 if that cannot be. Another's search for leftovers may have the
/// lock first, but only for a moment, so it is waited for.
int createLocked(const fs::path& path) {
  const int file = ::open(path.c_str(), O_RDWR | O_CLOEXEC | O_CREAT | O_EXCL, 0666);
  if (file < 0) return -1;
  while (::flock(file, LOCK_EX) != 0) {
    if (errno == EINTR) continue;
    unlock(file);
    return -1;
  }
  return file;
}

/// True if the locked file still has a name: another's search for leftovers may have removed it
/// between creation and lock.
bool hasName(int lock) {
  struct stat status = {};
  return ::fstat(lock, &status) == 0 && status.st_nlink > 0;
}

/// Brings a file, or the names in a folder, to the disk; systems that cannot are left alone.
std::error_code bringToDisk(const fs::path& path, int flags) {
  const int file = ::open(path.c_str(), flags | O_CLOEXEC);
  if (file < 0) return {errno, std::generic_category()};
  const int code = ::fsync(file) == 0 || errno == EINVAL || errno == ENOTSUP ? 0 : errno;
  ::close(file);
  return {code, std::generic_category()};
}
std::error_code bringFileToDisk(const fs::path& path) {
  return bringToDisk(path, O_RDWR);
}
void bringNamesToDisk(const fs::path& folder) {
  (void)bringToDisk(folder, O_RDONLY | O_DIRECTORY);
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

/// Runs an action on a file while it is locked, unless another holds its lock.
template <class Action>
void withLock(const fs::path& path, const Action& action) {
  const int lock = lockFile(path);
  if (lock < 0) return;
  action();
  unlock(lock);
}
#else
void unlock(int) {}
int createLocked(const fs::path&) {
  return -1;
}
bool hasName(int) {
  return true;
}
std::error_code bringFileToDisk(const fs::path&) {
  return {};
}
void bringNamesToDisk(const fs::path&) {}
std::vector<std::string> namesIn(const fs::path&) {
  return {};
}
template <class Action>
void withLock(const fs::path&, const Action&) {}
#endif

/// Returns an absolute path, as the working directory may change before the file gets its name.
fs::path absolutePath(const fs::path& path) {
  std::error_code failed;
  fs::path absolute = fs::absolute(path, failed);
  return failed ? path : absolute;
}

/// True for the name of a partial file that is to become `final`; the ending follows the number.
bool isPartialOf(std::string_view name, std::string_view final, std::string_view ending) {
  if (!name.starts_with(final) || !name.ends_with(ending)) return false;
  if (name.size() < final.size() + ending.size() + 2 || name[final.size()] != '.') return false;
  name.remove_prefix(final.size() + 1);
  name.remove_suffix(ending.size());
  return name.find_first_not_of("0123456789abcdef") == std::string_view::npos;
}

std::string keptEnding(const fs::path& final) {
  return std::string(kEnding) + final.extension().string();
}

/// Gives a file a name that no other has: a link is refused where there is one, in one step.
std::error_code giveFreeName(const fs::path& path, const fs::path& name) {
  std::error_code failed;
  fs::create_hard_link(path, name, failed);
  std::error_code ignored;
  if (!failed) {
    fs::remove(path, ignored);
  } else if (failed != std::errc::file_exists && !fs::exists(name, ignored)) {
    fs::rename(path, name, failed);  // a file system without links
  }
  return failed;
}

/// Gives a file the first free name of out.incomplete.wav, out.incomplete-2.wav and so on.
Result<fs::path> giveNameBeside(const fs::path& path, const fs::path& final) {
  std::error_code failed;
  for (int number = 1; number <= kTries; ++number) {
    fs::path name = final.parent_path() / final.stem();
    name += ".incomplete";
    if (number > 1) (name += "-") += std::to_string(number);
    name += final.extension();
    failed = giveFreeName(path, name);
    if (!failed) return name;
    if (failed != std::errc::file_exists) break;
  }
  return Error{failed.message()};
}

/// Visits the partial files of one name and ending whose writers are gone.
template <class Visit>
void visitLeftovers(const fs::path& final, std::string_view ending, const Visit& visit) {
  for (const std::string& name : namesIn(final.parent_path())) {
    const fs::path path = final.parent_path() / name;
    if (isPartialOf(name, final.filename().string(), ending)) withLock(path, [&] { visit(path); });
  }
}

/// The partial files of this process that are removed where it ends.
struct OpenPartials {
  static OpenPartials& instance() {
    static OpenPartials& all = immortal([] { return OpenPartials(); });
    return all;
  }
  Mutex mutex;
  std::set<fs::path> paths;
};

}  // namespace

PartialFile::PartialFile(const fs::path& finalPath, Leftover leftover)
    : finalPath_(absolutePath(finalPath)) {
  const std::string ending =
      leftover == Leftover::kept ? keptEnding(finalPath_) : std::string(kEnding);
  visitLeftovers(finalPath_, kEnding, [](const fs::path& path) {
    std::error_code ignored;
    fs::remove(path, ignored);
  });
  OpenPartials& open = OpenPartials::instance();
  const MutexLock lock(open.mutex);
  for (int tries = 0; tries < kTries; ++tries) {
    std::ostringstream suffix;
    suffix << '.' << std::hex << std::random_device{}() << ending;
    path_ = finalPath_;
    path_ += suffix.str();
    lock_ = createLocked(path_);
    if (lock_ < 0 || hasName(lock_)) break;
    unlock(std::exchange(lock_, -1));
  }
  if (leftover == Leftover::removed) open.paths.insert(path_);
}

PartialFile::PartialFile(PartialFile&& other) noexcept
    : finalPath_(std::move(other.finalPath_)),
      path_(std::exchange(other.path_, {})),
      lock_(std::exchange(other.lock_, -1)) {}

PartialFile::~PartialFile() {
  if (!path_.empty()) {
    OpenPartials& open = OpenPartials::instance();
    const MutexLock lock(open.mutex);
    std::error_code ignored;
    fs::remove(path_, ignored);
    open.paths.erase(path_);
  }
  unlock(lock_);
}

std::error_code PartialFile::giveName(Sync sync) {
  const bool toDisk = sync == Sync::disk;
  if (const std::error_code failed = toDisk ? bringFileToDisk(path_) : std::error_code(); failed)
    return failed;
  OpenPartials& open = OpenPartials::instance();
  const MutexLock lock(open.mutex);
  std::error_code reason;
  fs::rename(path_, finalPath_, reason);
  if (reason) return reason;
  open.paths.erase(path_);
  path_.clear();
  if (toDisk) bringNamesToDisk(finalPath_.parent_path());
  return {};
}

Result<fs::path> PartialFile::keepIncomplete() {
  const fs::path path = std::exchange(path_, {});
  (void)bringFileToDisk(path);  // as much of it as there is room for
  Result<fs::path> kept = finalPath_;
  if (giveFreeName(path, finalPath_)) kept = giveNameBeside(path, finalPath_);
  bringNamesToDisk(finalPath_.parent_path());
  OpenPartials& open = OpenPartials::instance();
  const MutexLock lock(open.mutex);
  open.paths.erase(path);
  if (!kept) return Error{"it stays in '" + path.string() + "': " + kept.error().message};
  return kept;
}

std::vector<fs::path> PartialFile::keepLeftovers(
    const fs::path& finalPath, const std::function<bool(const fs::path&)>& isOfUse) {
  const fs::path final = absolutePath(finalPath);
  std::vector<fs::path> kept;
  visitLeftovers(final, keptEnding(final), [&](const fs::path& path) {
    std::error_code ignored;
    if (!isOfUse(path)) {
      fs::remove(path, ignored);
    } else if (const Result<fs::path> given = giveNameBeside(path, final); given) {
      kept.push_back(*given);
    }
  });
  return kept;
}

void PartialFile::removeAll() {
  OpenPartials& open = OpenPartials::instance();
  open.mutex.lock();  // for good: see its declaration
  std::error_code ignored;
  for (const fs::path& path : open.paths)
    fs::remove(path, ignored);
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
