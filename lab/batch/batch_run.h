#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

#include "lab/batch/batch_plan.h"
#include "lab/batch/batch_rows.h"

#include "carom/audio/result.h"

namespace carom::lab {

/// A share of the samples: those whose index has the remainder `index` after division by `count`.
struct BatchShard {
  std::uint64_t index = 0;
  std::uint64_t count = 1;
};

/// How far a run is, of the samples of its shard.
struct BatchProgress {
  std::uint64_t samples = 0;  ///< of the shard
  std::uint64_t done = 0;     ///< before this run, or by it
  std::uint64_t made = 0;     ///< by this run
  std::uint64_t failed = 0;
  double seconds = 0.0;  ///< s, since this run began
};

struct BatchRunOptions {
  std::size_t processes = 1;
  BatchShard shard;
  DoneRules done;
  std::function<void(const BatchProgress&)> progress = {};
  std::function<void()> beginProcess = {};  ///< called in each process first
};

struct BatchRunReport {
  std::uint64_t done = 0;       ///< samples of the shard all of whose branches are whole
  std::uint64_t failed = 0;     ///< samples of the shard with a branch that failed
  std::uint64_t remaining = 0;  ///< samples of the shard that are neither
  double wallTime = 0.0;        ///< s
  double soundTime = 0.0;       ///< s, of sound that this run has made
  std::string contentHash;      ///< of all that is whole in the folder
};

/// Makes the samples of a shard that are not done yet, each in one of several processes, and the
/// manifest anew. Errors are those of the disk, and of having no process; what was made before one
/// stays, and the next run goes on. To be called where this process has no other thread that holds
/// locks. [one thread; blocks]
Result<BatchRunReport> runBatch(const BatchPlan& plan, const BatchRunOptions& options);

}  // namespace carom::lab
