#pragma once

#include <cstdint>
#include <string>

namespace carom::scenes {

/// The most that a run may take. Zero: no limit.
struct RunLimits {
  std::uint64_t memory = 0;  ///< bytes, resident in the whole process
  double time = 0.0;         ///< s, wall time since the watch or guard was made, and `spent`
  double spent = 0.0;        ///< s, of `time`, by what came before
  std::uint64_t events = 0;  ///< of all bodies; if 0, an endless rattle ends the run
};

/// Watches clock and memory, from when it is made. [one thread]
class ResourceWatch {
 public:
  explicit ResourceWatch(const RunLimits& limits);

  /// Returns the limit that is exceeded, "time" or "memory", or an empty text. Looks at the memory
  /// 50 times a second at most.
  std::string exceeded();
  /// Returns the second half of a sentence, with the option that sets the limit: "it has taken
  /// 2 s; expected more time (--max-time)".
  std::string why(const std::string& limit) const;
  double seconds() const;  ///< s, since it was made

 private:
  RunLimits limits_;
  double begin_;         // s, of the clock
  double lookedAt_ = 0;  // s, of the clock, when memory was looked at
};

/// Returns "1.5 GB", "200 kB" and so on. [any thread]
std::string bytesText(double bytes);

}  // namespace carom::scenes
