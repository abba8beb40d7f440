#include "plugin/listen/bullet_function.h"

#include <cstdint>
#include <mutex>
#include <string_view>
#include <vector>

#include <dlfcn.h>
#include <link.h>

namespace carom::listen {
namespace {

/// The start of the library that an address is in; null if it is in none.
const void* baseOf(const void* address) {
  Dl_info info{};
  return dladdr(address, &info) != 0 ? info.dli_fbase : nullptr;
}

const link_map* mapOf(const void* address) {
  Dl_info info{};
  link_map* map = nullptr;
  const int found = dladdr1(address, &info, reinterpret_cast<void**>(&map), RTLD_DL_LINKMAP);
  return found != 0 ? map : nullptr;
}

bool isOurs(const void* function) {
  static const char mark = 0;
  return baseOf(function) == baseOf(&mark);
}

/// Looks a function up in a library that is open, and in those that it is linked to.
void* findIn(const char* library, const char* name) {
  void* const handle = dlopen(library, RTLD_LAZY | RTLD_NOLOAD);
  void* const function = handle != nullptr ? dlsym(handle, name) : nullptr;
  return function != nullptr && !isOurs(function) ? function : nullptr;
}

int addName(dl_phdr_info* info, std::size_t /*size*/, void* names) {
  static_cast<std::vector<std::string>*>(names)->emplace_back(info->dlpi_name);
  return 0;
}

void* findAnywhere(const char* name) {
  std::vector<std::string> libraries;
  dl_iterate_phdr(addName, &libraries);
  for (const std::string& library : libraries) {
    if (library.empty()) continue;
    if (void* const function = findIn(library.c_str(), name)) return function;
  }
  return nullptr;
}

/// The library with the class of the world comes first: a process may have several Bullets.
void* search(const char* name, const void* table) {
  const link_map* const ofClass = mapOf(table);
  if (ofClass != nullptr && ofClass->l_name[0] != '\0') {
    if (void* const function = findIn(ofClass->l_name, name)) return function;
  }
  if (void* const function = dlsym(RTLD_NEXT, name)) return function;
  return findAnywhere(name);
}

/// Returns the soname of a library, or nothing.
std::string_view sonameOf(const link_map& map) {
  std::uintptr_t strings = 0;
  std::uintptr_t place = 0;
  for (const ElfW(Dyn)* entry = map.l_ld; entry != nullptr && entry->d_tag != DT_NULL; ++entry) {
    if (entry->d_tag == DT_STRTAB) strings = entry->d_un.d_ptr;
    if (entry->d_tag == DT_SONAME) place = entry->d_un.d_val;
  }
  if (strings == 0 || place == 0) return {};
  // The loader's table has addresses as numbers.
  return reinterpret_cast<const char*>(strings + place);  // NOLINT(performance-no-int-to-ptr)
}

/// Reads 324 from "libBulletDynamics.so.3.24"; 0 if there is no such number.
int versionIn(std::string_view soname) {
  constexpr std::string_view kBefore = ".so.";
  constexpr int kPerMajor = 100;
  const std::size_t found = soname.find(kBefore);
  if (!soname.starts_with("libBullet") || found == std::string_view::npos) return 0;
  int parts[2] = {0, 0};
  std::size_t part = 0;
  for (const char letter : soname.substr(found + kBefore.size())) {
    const bool isDigit = letter >= '0' && letter <= '9';
    if (!isDigit && ++part == 2) break;
    if (isDigit) parts[part] = 10 * parts[part] + (letter - '0');
  }
  return part == 0 ? 0 : kPerMajor * parts[0] + parts[1];
}

/// A function that was found, by its name and the class of the world.
struct KnownFunction {
  std::string_view name;
  const void* table = nullptr;
  void* function = nullptr;
};

}  // namespace

void* findBulletFunction(const char* name, const void* world) {
  static std::mutex& mutex = *new std::mutex;  // worlds may be static, and outlive it
  static auto& known = *new std::vector<KnownFunction>;
  const void* const table = *static_cast<const void* const*>(world);
  const std::lock_guard lock(mutex);
  for (const KnownFunction& one : known)
    if (one.table == table && one.name == name) return one.function;
  void* const function = search(name, table);
  if (function != nullptr) known.push_back({name, table, function});
  return function;
}

BulletLibrary libraryOf(const void* function, const char* name) {
  BulletLibrary library;
  if (const link_map* const map = mapOf(function)) {
    library.file = map->l_name;
    library.version = versionIn(sonameOf(*map));
  }
  library.isReachable = dlsym(RTLD_NEXT, name) == function;
  return library;
}

}  // namespace carom::listen
