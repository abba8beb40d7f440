#include "audio/model/immortal.h"

#include <new>
#include <utility>

#include "audio/model/mutex.h"

namespace carom::audio {
namespace {

/// One value in the list of all; the list itself has no destructor either.
struct ImmortalEntry {
  void* value;
  void (*remove)(void*);
  ImmortalEntry* before;
};

struct ImmortalList {
  Mutex mutex;
  ImmortalEntry* latest = nullptr;
};

ImmortalList& immortals() {
  alignas(ImmortalList) static unsigned char place[sizeof(ImmortalList)];
  static auto* const list = new (place) ImmortalList;
  return *list;
}

}  // namespace

void noteImmortal(void* value, void (*remove)(void*)) {
  auto* const entry = new ImmortalEntry{value, remove, nullptr};
  ImmortalList& list = immortals();
  const MutexLock lock(list.mutex);
  entry->before = std::exchange(list.latest, entry);
}

void deleteImmortals() {
  ImmortalList& list = immortals();
  for (ImmortalEntry* entry = std::exchange(list.latest, nullptr); entry != nullptr;) {
    entry->remove(entry->value);
    delete std::exchange(entry, entry->before);
  }
}

}  // namespace carom::audio
