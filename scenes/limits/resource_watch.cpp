#include "scenes/limits/resource_watch.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <sstream>

#include "scenes/limits/machine_memory.h"

namespace carom::scenes {
namespace {

constexpr double kMemoryPeriod = 0.02;  // s, between looks at the memory

double clockSeconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
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
