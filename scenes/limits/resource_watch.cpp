#include "scenes/limits/resource_watch.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <fstream>
#include <sstream>

#include <unistd.h>

namespace carom::scenes {
namespace {

constexpr double kMemoryPeriod = 0.02;  // s, between looks at the memory

double clockSeconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Returns a field of Linux's /proc/self/statm, in bytes; 0 elsewhere.
std::uint64_t memoryField(int field) {
  std::ifstream stream("/proc/self/statm");
  std::uint64_t pages = 0;
  for (int index = 0; index <= field; ++index)
    if (!(stream >> pages)) return 0;
  return pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

}  // namespace

std::string bytesText(double bytes) {
  constexpr std::array<const char*, 5> kUnits = {"bytes", "kB", "MB", "GB", "TB"};
  std::size_t unit = 0;
  for (; bytes >= 1000.0 && unit + 1 < kUnits.size(); ++unit)
    bytes /= 1000.0;
  std::ostringstream text;
  text.precision(3);
  text << bytes << ' ' << kUnits[unit];
  return text.str();
}

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

ResourceWatch::ResourceWatch(const RunLimits& limits)
    : limits_(limits), begin_(clockSeconds() - limits.spent) {}

double ResourceWatch::seconds() const {
  return clockSeconds() - begin_;
}

std::string ResourceWatch::exceeded() {
  const double now = clockSeconds();
  if (limits_.time > 0.0 && now - begin_ > limits_.time) return "time";
  if (limits_.memory == 0 || now - lookedAt_ < kMemoryPeriod) return {};
  lookedAt_ = now;
  return residentMemory() > limits_.memory ? "memory" : "";
}

std::string ResourceWatch::why(const std::string& limit) const {
  std::ostringstream text;
  if (limit == "time")
    text << "it has taken " << limits_.time << " s; expected less work, or more time (--max-time)";
  else
    text << "its memory has grown to " << bytesText(static_cast<double>(residentMemory()))
         << "; expected less work, or more than " << bytesText(static_cast<double>(limits_.memory))
         << " (--max-memory)";
  return text.str();
}

}  // namespace carom::scenes
