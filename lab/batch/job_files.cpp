#include "lab/batch/job_files.h"

#include <algorithm>
#include <cmath>
#include <fstream>

#include "lab/batch/sample_run.h"
#include <nlohmann/json.hpp>

namespace carom::lab {
namespace {

constexpr const char* kTrialFile = "trial.json";

/// Returns a text as one word of a POSIX shell.
std::string quotedForShell(const std::string& text) {
  std::string word = "'";
  for (const char letter : text)
    word += letter == '\'' ? std::string("'\\''") : std::string(1, letter);
  return word + '\'';
}

/// Returns a text as a literal of Python.
std::string quotedForPython(const std::string& text) {
  std::string literal = "'";
  for (const char letter : text) {
    if (letter == '\'' || letter == '\\') literal += '\\';
    literal += letter;
  }
  return literal + '\'';
}

std::string runOf(const JobSet& jobs, const std::string& shard) {
  return quotedForShell(jobs.program.string()) + " batch run " +
         quotedForShell(jobs.folder.string()) + " -j 1 --shard " + shard + "/" +
         std::to_string(jobs.shards);
}

/// Returns a job's name without what a scheduler may not like.
std::string plainName(std::string name) {
  std::ranges::replace_if(
      name,
      [](char c) {
        return (c < 'a' || c > 'z') && (c < 'A' || c > 'Z') && (c < '0' || c > '9') && c != '-' &&
               c != '_';
      },
      '_');
  return name;
}

}  // namespace

std::uint64_t shardsFor(double secondsPerSample, std::uint64_t samples) {
  constexpr double kMinute = 60.0;
  constexpr double kMost = 1000.0;
  const double minutes = secondsPerSample * static_cast<double>(samples) / kMinute;
  const auto shards = static_cast<std::uint64_t>(std::clamp(std::ceil(minutes), 1.0, kMost));
  return std::min(shards, std::max<std::uint64_t>(1, samples));
}

Status keepTrialSeconds(const BatchPlan& plan, double seconds) {
  const nlohmann::json object = {{"seconds_per_sample", seconds}};
  return writeSampleFile(plan.folder / kTrialFile, object.dump() + "\n");
}

std::optional<double> trialSeconds(const BatchPlan& plan) {
  std::ifstream stream(plan.folder / kTrialFile, std::ios::binary);
  const auto object = nlohmann::json::parse(stream, nullptr, false);
  if (!object.is_object()) return std::nullopt;
  const auto seconds = object.find("seconds_per_sample");
  if (seconds == object.end() || !seconds->is_number()) return std::nullopt;
  const auto value = seconds->get<double>();
  if (std::isfinite(value) && value > 0.0) return value;
  return std::nullopt;
}

std::string slurmScript(const JobSet& jobs) {
  const std::string folder = jobs.folder.string();
  return "#!/bin/sh\n"
         "#SBATCH --job-name=" +
         plainName(jobs.name) + "\n#SBATCH --array=0-" + std::to_string(jobs.shards - 1) +
         "\n#SBATCH --ntasks=1\n#SBATCH --cpus-per-task=1\n"
         "# One task makes one share of the samples; what is whole is not made again, so the job "
         "may be\n"
         "# submitted any number of times, and each share that ends writes the manifest anew.\n" +
         runOf(jobs, "\"$SLURM_ARRAY_TASK_ID\"") + "\n";
}

std::string parallelScript(const JobSet& jobs) {
  return "#!/bin/sh\n"
         "# Options are those of GNU parallel, such as -j 8 or --sshlogin HOSTS.\n"
         "parallel \"$@\" " +
         quotedForShell(runOf(jobs, "{}")) + " ::: $(seq 0 " + std::to_string(jobs.shards - 1) +
         ")\n" + quotedForShell(jobs.program.string()) + " batch verify " +
         quotedForShell(jobs.folder.string()) + "\n";
}

std::string snakefile(const JobSet& jobs) {
  const std::string shards = std::to_string(jobs.shards);
  return "PROGRAM = " + quotedForPython(jobs.program.string()) +
         "\nFOLDER = " + quotedForPython(jobs.folder.string()) + "\nSHARDS = " + shards +
         "\n\n"
         "rule verified:\n"
         "    input: expand(\"shards/{shard}.done\", shard=range(SHARDS))\n"
         "    shell: \"{PROGRAM:q} batch verify {FOLDER:q}\"\n\n"
         "rule shard:\n"
         "    output: touch(\"shards/{shard}.done\")\n"
         "    shell: \"{PROGRAM:q} batch run {FOLDER:q} -j 1 --shard "
         "{wildcards.shard}/{SHARDS}\"\n";
}

}  // namespace carom::lab
