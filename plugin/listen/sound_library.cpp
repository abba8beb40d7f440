#include "plugin/listen/sound_library.h"

#include <atomic>
#include <filesystem>
#include <mutex>
#include <optional>

#include <dlfcn.h>
#include <unistd.h>

#include "plugin/listen/bullet_function.h"
#include "plugin/listen/listen_report.h"

namespace carom::listen {
namespace {

std::filesystem::path folderOfThis() {
  static const char mark = 0;
  Dl_info info{};
  if (dladdr(&mark, &info) == 0 || info.dli_fname == nullptr) return {};
  return std::filesystem::path(info.dli_fname).parent_path();
}

std::string lastError() {
  const char* const error = dlerror();
  return error != nullptr ? error : "unknown error";
}

/// Returns "3.24".
std::string versionText(int version) {
  constexpr int kPerMajor = 100;
  const std::string minor = std::to_string(version % kPerMajor);
  return std::to_string(version / kPerMajor) + (minor.size() < 2 ? ".0" : ".") + minor;
}

/// Lets what is opened later be linked to a library that was opened for another one alone.
void makeReachable(const BulletLibrary& library) {
  if (library.isReachable || library.file.empty()) return;
  dlopen(library.file.c_str(), RTLD_LAZY | RTLD_NOLOAD | RTLD_GLOBAL);
}

/// Returns where the functions of Bullet are that what is opened later is linked to, those of the
/// library that came first into the program; nothing if there are none.
std::optional<BulletLibrary> linkedLibrary() {
  constexpr const char* kConstructor = "_ZN21btConvexInternalShapeC2Ev";  // hosts do not define it
  const void* const constructor = dlsym(RTLD_DEFAULT, kConstructor);
  if (constructor == nullptr) return std::nullopt;
  return libraryOf(constructor, kConstructor);
}

}  // namespace

bool isHeardProcess() {
  static std::atomic<pid_t> asked{0};
  static std::atomic<bool> isHeard{false};
  static std::mutex& mutex = *new std::mutex;
  const pid_t process = getpid();
  if (asked.load() == process) return isHeard.load();
  const std::lock_guard lock(mutex);
  if (asked.load() == process) return isHeard.load();
  isHeard = claim(kProcessFile);
  asked = process;
  return isHeard.load();
}

const SoundFunctions* SoundLibrary::opened() const {
  return isOpen_ && isHeardProcess() ? &functions_ : nullptr;
}

const SoundFunctions* SoundLibrary::open(const void* step, const char* name) {
  static std::mutex& mutex = *new std::mutex;
  if (!isHeardProcess()) return nullptr;
  const std::lock_guard lock(mutex);
  const auto [known, isNew] = known_.try_emplace(step, false);
  if (isNew) known->second = isOfUse(step, name);
  return known->second ? opened() : nullptr;
}

bool SoundLibrary::isOfUse(const void* step, const char* name) {
  const std::string why = fault(step, name);
  if (!why.empty()) tellUser(why);
  return why.empty();
}

/// Opens the library; returns why it is of no use. Another version of Bullet has other classes: its
/// worlds must not be touched.
std::string SoundLibrary::fault(const void* step, const char* name) {
  const BulletLibrary bullet = libraryOf(step, name);
  const std::string place = bullet.file.empty() ? "in the program itself" : bullet.file;
  if (bullet.version != kCompiledVersion)
    return "its Bullet is " +
           (bullet.version == 0 ? "of unknown version" : versionText(bullet.version)) + " (" +
           place + ") and is not heard; expected the shared libraries of Bullet " +
           versionText(kCompiledVersion);
  if (isOpen_) return {};
  const std::string file = (folderOfThis() / kind_.library).string();
  makeReachable(bullet);
  const std::optional<BulletLibrary> linked = linkedLibrary();
  if (linked && linked->version != kCompiledVersion)
    return "its Bullet in " + place + " is not heard: another one comes before it, " +
           (linked->file.empty() ? "in the program itself" : linked->file) +
           "; expected one Bullet in a program";
  void* const handle = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (handle == nullptr)
    return "its Bullet in " + std::string(kind_.scalar) + " (" + place +
           ") cannot be heard: " + lastError();
  SoundFunctions found;
  found.beforeStep = reinterpret_cast<WorldFunction>(dlsym(handle, kBeforeStep));
  found.afterStep = reinterpret_cast<WorldFunction>(dlsym(handle, kAfterStep));
  found.worldEnds = reinterpret_cast<WorldFunction>(dlsym(handle, kWorldEnds));
  if (found.beforeStep == nullptr || found.afterStep == nullptr || found.worldEnds == nullptr)
    return file + " is of another version of Carom; install both anew";
  functions_ = found;
  isOpen_ = true;
  return {};
}

}  // namespace carom::listen
