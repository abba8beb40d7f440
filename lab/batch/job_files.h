#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "lab/batch/batch_plan.h"

#include "carom/audio/result.h"

namespace carom::lab {

/// The jobs for a scheduler: shards of a plan, each by `carom batch run --shard`.
struct JobSet {
  std::string name;
  std::filesystem::path program;  ///< absolute path of the carom command
  std::filesystem::path folder;   ///< absolute path of the plan's folder
  std::uint64_t shards = 1;
};

/// Returns the number of shards for which each takes about a minute, by the seconds that a sample
/// takes; at most one for each sample, and at most 1000, which schedulers take as one array.
std::uint64_t shardsFor(double secondsPerSample, std::uint64_t samples);

/// The seconds of one processor that a sample takes, as the plan's trial found; kept beside the
/// plan. Nothing if there was no trial.
Status keepTrialSeconds(const BatchPlan& plan, double seconds);
std::optional<double> trialSeconds(const BatchPlan& plan);

/// Return the text of a job: an array job of Slurm, a script that calls GNU parallel, a Snakefile.
/// Each ends with a manifest of all samples.
std::string slurmScript(const JobSet& jobs);
std::string parallelScript(const JobSet& jobs);
std::string snakefile(const JobSet& jobs);

}  // namespace carom::lab
