#pragma once

#include <string>

#include "carom/audio/result.h"
#include "scenes/format/scene.h"
#include "scenes/limits/run_guard.h"

namespace CLI {
class App;
}

namespace carom::command {

// The options that bound what a run may take, and the answer where a bound ends it.

/// Exit code of a run that a limit has ended.
inline constexpr int kLimited = 3;

struct RunOptions {
  std::string memory;   ///< empty: half of the machine's
  double time = 0.0;    ///< s; 0: any
  double events = 0.0;  ///< 0: any
  bool keepPartial = false;

  scenes::RunLimits limits() const;
};

/// Adds --max-memory and --max-time; `options` must outlive the parsing.
void addResourceLimits(CLI::App& command, RunOptions& options);
/// Adds these and --max-events; `options` must outlive the parsing.
void addLimits(CLI::App& command, RunOptions& options);
/// Adds --keep-partial.
void addKeepPartial(CLI::App& command, RunOptions& options);

/// True if the stepper that a scene names can run it; the reason if not.
Status validateRun(const scenes::Scene& scene);

/// Says on stderr why a run has ended, and what is left of it. Returns kLimited.
int endedEarly(const std::string& file, const scenes::EndedEarly& ended, const std::string& kept);

/// Says on stderr that a limit of `watch` has ended what was done with `file`. Returns kLimited.
int endedEarly(const std::string& file, const scenes::ResourceWatch& watch,
               const std::string& limit);

/// Keeps this process from more than twice as much memory as `bytes`, for what no guard watches, or
/// what grows faster than it looks: allocations beyond fail.
void capMemory(std::uint64_t bytes);

/// Gives the process back the limit with which it was started, for a program that it is about to
/// become. [in the child of a fork]
void liftMemoryCap();

}  // namespace carom::command
