#include "scenes/limits/machine_memory.h"

#include <algorithm>
#include <fstream>

#include <unistd.h>

namespace carom::scenes {
namespace {

/// Returns a field of Linux's /proc/self/statm, in bytes; 0 elsewhere.
std::uint64_t memoryField(int field) {
  std::ifstream stream("/proc/self/statm");
  std::uint64_t pages = 0;
  for (int index = 0; index <= field; ++index)
    if (!(stream >> pages)) return 0;
  return pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

}  // namespace

std::uint64_t residentMemory() {
  return memoryField(1);
}

std::uint64_t mappedMemory() {
  return memoryField(5);
}

std::uint64_t machineMemory() {
  const long pages = sysconf(_SC_PHYS_PAGES);
  const long size = sysconf(_SC_PAGESIZE);
  if (pages <= 0 || size <= 0) return 0;
  std::uint64_t memory = static_cast<std::uint64_t>(pages) * static_cast<std::uint64_t>(size);
  // A container may have less than the machine.
  for (const char* file :
       {"/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"}) {
    std::ifstream stream(file);
    if (std::uint64_t limit = 0; stream >> limit) memory = std::min(memory, limit);
  }
  return memory;
}

}  // namespace carom::scenes
