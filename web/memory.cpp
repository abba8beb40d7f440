// How the module's memory grows. The C library grows it by as little as it needs, 64 kB or so; a
// run that goes on needs megabytes a second. Each growth costs the browser a new buffer and mostly
// a collection of garbage: together a third of a live run's time. So memory grows by a share of
// itself.

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstdint>

namespace {

constexpr std::size_t kPage = 65536;      // bytes, of WebAssembly
constexpr std::size_t kLeastGrowth = 16;  // pages
constexpr std::size_t kShare = 4;         // a growth is 1/4 of what there is

std::size_t pages() {
  return __builtin_wasm_memory_size(0);
}

bool grow(std::size_t count) {
  return __builtin_wasm_memory_grow(0, count) != SIZE_MAX;
}

}  // namespace

/// Stands for the C library's own. Returns where `increment` more bytes begin, or -1 where there
/// are none; what malloc asks for is never negative, and whole pages.
extern "C" void* sbrk(std::intptr_t increment) {
  static std::size_t end = pages();  // what has been handed out
  const std::size_t begin = end;
  const auto bytes = static_cast<std::size_t>(increment);
  const std::size_t wanted = bytes / kPage + (bytes % kPage > 0 ? 1 : 0);
  const std::size_t lacking = end + wanted > pages() ? end + wanted - pages() : 0;
  const std::size_t share = std::max(kLeastGrowth, pages() / kShare);
  if (lacking > 0 && !grow(std::max(lacking, share)) && !grow(lacking)) {
    errno = ENOMEM;
    return reinterpret_cast<void*>(-1);  // NOLINT(performance-no-int-to-ptr)
  }
  end += wanted;
  return reinterpret_cast<void*>(begin * kPage);  // NOLINT(performance-no-int-to-ptr)
}
