#include "command/batch_command.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <sstream>
#include <thread>
#include <vector>

#include "command/command_line.h"
#include "command/output/kept_inputs.h"
#include "command/output/output_target.h"
#include "command/progress_bar.h"
#include "command/run_options.h"
#include "command/signals.h"
#include "command/terminal/terminal.h"
#include "lab/batch/batch_page.h"
#include "lab/batch/batch_plan.h"
#include "lab/batch/batch_run.h"
#include "lab/batch/batch_trial.h"
#include "lab/batch/manifest.h"
#include "lab/batch/run_program.h"
#include "lab/batch/sample_run.h"
#include "lab/batch/tar_shards.h"
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "audio/io/partial_file.h"
#include "scenes/limits/machine_memory.h"
#include "scenes/limits/resource_watch.h"

namespace carom::command {

using namespace lab;

namespace {

constexpr double kMostProcesses = 1024;
constexpr double kMostSamples = 1e9;
constexpr double kRoomForAll = 0.5;  // share of the machine's memory for all processes

/// Parses "I/N", I from 0 to N - 1.
std::optional<BatchShard> shardOf(const std::string& text) {
  const std::size_t slash = text.find('/');
  BatchShard shard;
  if (slash == std::string::npos ||
      !CLI::detail::lexical_cast(text.substr(0, slash), shard.index) ||
      !CLI::detail::lexical_cast(text.substr(slash + 1), shard.count) || shard.index >= shard.count)
    return std::nullopt;
  return shard;
}

CLI::Validator shardRange() {
  const auto check = [](const std::string& text) -> std::string {
    if (shardOf(text)) return {};
    return "'" + text + "' is no share; expected I/N, such as 0/7, I from 0 to N - 1";
  };
  return {check, "I/N", "such as 0/7, I from 0 to N - 1"};
}

std::size_t processors() {
  return std::max(1U, std::thread::hardware_concurrency());
}

/// Returns a duration in words: "40 s", "3 min", "2.5 h".
std::string durationText(double seconds) {
  constexpr double kMinute = 60.0;
  constexpr double kHour = 3600.0;
  std::ostringstream text;
  text.precision(2);
  if (seconds < 2.0 * kMinute) {
    text << std::ceil(seconds) << " s";
  } else if (seconds < 2.0 * kHour) {
    text << std::ceil(seconds / kMinute) << " min";
  } else {
    text << seconds / kHour << " h";
  }
  return text.str();
}

std::string noteOf(const BatchProgress& progress) {
  std::ostringstream text;
  text << progress.done << " of " << progress.samples;
  if (progress.failed > 0) text << ", " << progress.failed << " failed";
  const std::uint64_t ended = progress.made + progress.failed;
  if (ended > 0 && progress.seconds > 0.0) {
    const double rate = static_cast<double>(ended) / progress.seconds;
    const std::uint64_t left =
        progress.samples - std::min(progress.samples, progress.done + progress.failed);
    text.precision(3);
    text << ", " << rate << " a second, " << durationText(static_cast<double>(left) / rate)
         << " left";
  }
  return text.str();
}

}  // namespace

BatchCommand::BatchCommand(CLI::App& app)
    : command_(app.add_subcommand(
          "batch",
          "Plan, make and verify batches of scenes\n"
          "Thousands of scenes that differ in their parameters, with their sounds, events and a "
          "manifest of hashes (docs/batch.md).")) {
  command_->require_subcommand(1);
  addPlan();
  addRun();
  addVerify();
  addRepeat();
  addReport();
  addPack();
  addSchedulers();
  command_->footer(
      "Examples:\n"
      "  carom batch plan scenes/batches/bouncing_balls.json -o balls --count 100\n"
      "  carom batch run balls\n"
      "  carom batch verify balls\n"
      "  carom batch repeat balls 12 -o twelve.wav\n"
      "  carom batch slurm balls");
}

CLI::App* BatchCommand::add(const char* name, const char* description) {
  CLI::App* const command = command_->add_subcommand(name, description);
  command->add_flag("--json", json_, "print one JSON object instead of text");
  return command;
}

void BatchCommand::addPlan() {
  plan_ = add("plan", "Settle what the samples of a batch are, and try some");
  plan_->add_option("BATCH", input_, "batch file (JSON, docs/batch.md)")
      ->required()
      ->type_name("FILE.json");
  plan_->add_option("-o,--output", output_, "folder for the batch; is made if it is not there")
      ->required()
      ->check(folderName());
  plan_->add_option("--count", count_, "number of samples; default: the batch's own")
      ->check(wholeNumberRange(1, kMostSamples));
}

void BatchCommand::addRun() {
  run_ = add("run", "Make the samples that are not made yet");
  run_->add_option("FOLDER", input_, "folder that 'carom batch plan' made")->required();
  run_->add_option("-j,--jobs", processes_, "processes at a time; default: one for each processor")
      ->check(wholeNumberRange(1, kMostProcesses));
  run_->add_option("--shard", shard_, "only every N-th sample, from the I-th on; default: all")
      ->check(shardRange());
  run_->add_flag("--retry", retry_, "also try again what has failed before");
  run_->add_flag("--repair", thorough_,
                 "look at the hash of each file that is there, and make "
                 "damaged ones anew");
}

void BatchCommand::addVerify() {
  verify_ = add("verify", "Hash all files again, and write the manifest anew");
  verify_->add_option("FOLDER", input_, "folder that 'carom batch run' filled")->required();
}

void BatchCommand::addRepeat() {
  repeat_ = add("repeat", "Make one sample again, into a file of its own");
  repeat_->add_option("FOLDER", input_, "folder that 'carom batch plan' made")->required();
  repeat_->add_option("INDEX", index_, "index of the sample, from 0")
      ->required()
      ->check(wholeNumberRange(0, kMostSamples));
  repeat_->add_option("--branch", branch_, "which of the batch's branches; default: the first")
      ->type_name("NAME");
  repeat_->add_option("-o,--output", output_, "WAV file to write")
      ->required()
      ->type_name("FILE.wav")
      ->check(fileName());
}

void BatchCommand::addReport() {
  report_ = add("report", "Write a page: what was drawn, what came out, players, failures");
  report_->add_option("FOLDER", input_, "folder that 'carom batch run' filled")->required();
}

void BatchCommand::addPack() {
  pack_ = add("pack", "Pack the samples into tar files, as WebDataset reads them");
  pack_->add_option("FOLDER", input_, "folder that 'carom batch run' filled")->required();
  pack_->add_option("--samples", samples_, "most samples in a file")
      ->check(wholeNumberRange(1, kMostSamples))
      ->capture_default_str();
}

void BatchCommand::addSchedulers() {
  slurm_ = add("slurm", "Write an array job of Slurm, and submit it");
  parallel_ = add("parallel", "Write a script that runs all shares by GNU parallel");
  snakemake_ = add("snakemake", "Write a Snakefile that runs all shares");
  for (CLI::App* const command : {slurm_, parallel_, snakemake_}) {
    command->add_option("FOLDER", input_, "folder that 'carom batch plan' made")->required();
    command
        ->add_option("--shards", shards_,
                     "number of shares; default: as many as take a minute each, at most 1000")
        ->check(wholeNumberRange(1, 1e6));
  }
  slurm_->add_flag("--dry-run", dryRun_, "only write it");
}

bool BatchCommand::parsed() const {
  return command_->parsed();
}

int BatchCommand::run() const {
  if (plan_->parsed()) return plan();
  if (run_->parsed()) return runAll();
  if (verify_->parsed()) return verify();
  if (slurm_->parsed()) return slurm();
  if (parallel_->parsed()) return writeJobs("parallel.sh", parallelScript);
  if (report_->parsed()) return report();
  if (pack_->parsed()) return pack();
  if (snakemake_->parsed()) return writeJobs("Snakefile", snakefile);
  return repeat();
}

int BatchCommand::plan() const {
  if (const Status valid =
          refuseStandardOutput(output_, "--output", "a batch is many files; expected a folder");
      !valid)
    return fail(kBadInput, valid.error().message);
  std::optional<std::uint64_t> count;
  if (count_ > 0.0) count = static_cast<std::uint64_t>(count_);
  const Result<BatchPlan> plan = makePlan(input_, output_, count);
  if (!plan) return fail(kBadInput, plan.error().message);
  std::vector<std::filesystem::path> read = {input_};
  for (const std::string& scene : plan->spec.scenes)
    read.push_back(plan->home / scene);
  const std::filesystem::path file = std::filesystem::path(output_) / "plan.json";
  if (const Status kept = checkKept({{"--output", file}}, read); !kept)
    return fail(kBadInput, kept.error().message);
  if (const Status saved = savePlan(*plan); !saved) return fail(kFailed, saved.error().message);
  ProgressBar bar("trying samples of " + plan->spec.name);
  const Result<BatchTrial> trial = tryBatch(*plan, [&bar](double share) { bar.show(share); });
  bar.clear();
  if (!trial) return fail(kFailed, trial.error().message);
  if (const Status kept = keepTrialSeconds(*plan, trial->seconds); !kept)
    return fail(kFailed, kept.error().message);
  for (const std::string& warning : trial->warnings)
    warn(input_ + ": " + warning);
  if (json_)
    return answer(jsonText({{"samples", plan->spec.count},
                            {"branches", plan->spec.branches.size()},
                            {"seed", plan->spec.seed},
                            {"plan_hash", plan->hash},
                            {"estimate",
                             {{"tried", trial->tried},
                              {"seconds_per_sample", trial->seconds},
                              {"bytes_per_sample", trial->bytes},
                              {"wall_s", trial->seconds * static_cast<double>(plan->spec.count)},
                              {"bytes", trial->bytes * static_cast<double>(plan->spec.count)}}},
                            {"warnings", trial->warnings}}));
  std::ostringstream text;
  const double samples = static_cast<double>(plan->spec.count);
  text << output_ << ": " << plan->spec.count << " samples of " << plan->spec.name;
  if (plan->spec.branches.size() > 1)
    text << ", each in " << plan->spec.branches.size() << " branches";
  text << "\nplan      " << plan->hash << "\nexpected  " << durationText(trial->seconds * samples)
       << " of one processor, " << scenes::bytesText(trial->bytes * samples) << " on the disk (by "
       << trial->tried << " samples that were tried)\n";
  return answer(text.str());
}

int BatchCommand::runAll() const {
  Result<BatchPlan> plan = loadPlan(input_);
  if (!plan) return fail(kBadInput, plan.error().message);
  BatchRunOptions options;
  options.processes = processes_ > 0.0 ? static_cast<std::size_t>(processes_) : processors();
  if (!shard_.empty()) options.shard = *shardOf(shard_);
  options.done = {.failuresCount = !retry_, .hashes = thorough_};
  std::uint64_t& memory = plan->spec.limits.memory;
  if (memory == 0)
    memory = static_cast<std::uint64_t>(kRoomForAll * static_cast<double>(scenes::machineMemory()) /
                                        static_cast<double>(options.processes));
  options.beginProcess = [&memory] {
    endSilentlyOnSignals();
    capMemory(memory);
  };
  ProgressBar bar("making " + plan->spec.name);
  options.progress = [&bar](const BatchProgress& progress) {
    const auto all = static_cast<double>(std::max<std::uint64_t>(1, progress.samples));
    bar.show(static_cast<double>(progress.done + progress.failed) / all, noteOf(progress));
  };
  const Result<BatchRunReport> report = runBatch(*plan, options);
  bar.clear();
  if (!report) return fail(kFailed, report.error().message);
  const double factor = report->wallTime > 0.0 ? report->soundTime / report->wallTime : 0.0;
  const int code = report->failed > 0 ? kFailed : kDone;
  if (json_) {
    const int said = answer(jsonText({{"done", report->done},
                                      {"failed", report->failed},
                                      {"remaining", report->remaining},
                                      {"wall_s", report->wallTime},
                                      {"realtime_factor", factor},
                                      {"content_hash", report->contentHash}}));
    return said == kDone ? code : said;
  }
  std::ostringstream text;
  text.precision(3);
  text << input_ << ": " << report->done << " samples are whole, " << report->failed
       << " have failed, " << report->remaining << " remain\ntook      " << report->wallTime
       << " s, " << factor << " times faster than real time\ncontent   " << report->contentHash
       << '\n';
  if (report->failed > 0)
    text << "failures  " << (std::filesystem::path(input_) / "failures.jsonl").string() << '\n';
  const int said = answer(text.str());
  return said == kDone ? code : said;
}

int BatchCommand::verify() const {
  const Result<BatchPlan> plan = loadPlan(input_);
  if (!plan) return fail(kBadInput, plan.error().message);
  const Result<BatchCheck> check = verifyBatch(*plan);
  if (!check) return fail(kFailed, check.error().message);
  const int code = check->missing + check->damaged > 0 ? kFailed : kDone;
  if (json_) {
    const int said = answer(jsonText({{"whole", check->whole},
                                      {"missing", check->missing},
                                      {"damaged", check->damaged},
                                      {"content_hash", check->contentHash},
                                      {"faults", check->faults},
                                      {"made_on", check->machines}}));
    return said == kDone ? code : said;
  }
  std::ostringstream text;
  text << input_ << ": " << check->whole << " whole, " << check->missing << " missing, "
       << check->damaged << " damaged\ncontent   " << check->contentHash << '\n';
  for (const std::string& machine : check->machines)
    text << "made on   " << machine << '\n';
  if (check->machines.size() > 1)
    text << "          the bits of samples that were made on different ones may differ\n";
  for (const std::string& fault : check->faults)
    text << "  " << fault << '\n';
  if (check->damaged > 0)
    text << "'carom batch run " << input_ << " --repair' makes damaged ones anew\n";
  const int said = answer(text.str());
  return said == kDone ? code : said;
}

int BatchCommand::report() const {
  const Result<BatchPlan> plan = loadPlan(input_);
  if (!plan) return fail(kBadInput, plan.error().message);
  const Result<BatchRows> rows = readRows(*plan);
  if (!rows) return fail(kFailed, rows.error().message);
  const std::filesystem::path page = std::filesystem::path(input_) / "report.html";
  if (const Status written = writeSampleFile(page, batchPage(*plan, *rows)); !written)
    return fail(kFailed, written.error().message);
  if (json_) return answer(jsonText({{"file", page.string()}, {"sounds", rows->rows.size()}}));
  return answer("wrote " + page.string() + "\n");
}

int BatchCommand::pack() const {
  const Result<BatchPlan> plan = loadPlan(input_);
  if (!plan) return fail(kBadInput, plan.error().message);
  const Result<BatchRows> rows = readRows(*plan);
  if (!rows) return fail(kFailed, rows.error().message);
  const auto shards = packBatch(*plan, *rows, static_cast<std::uint64_t>(samples_));
  if (!shards) return fail(kFailed, shards.error().message);
  if (json_) return answer(jsonText({{"files", *shards}}));
  std::string text;
  for (const std::string& shard : *shards)
    text += (std::filesystem::path(input_) / shard).string() + '\n';
  return answer(text);
}

int BatchCommand::writeJobs(const char* file, std::string (*text)(const JobSet&)) const {
  const Result<BatchPlan> plan = loadPlan(input_);
  if (!plan) return fail(kBadInput, plan.error().message);
  std::error_code failed;
  JobSet jobs{.name = plan->spec.name,
              .program = std::filesystem::read_symlink("/proc/self/exe", failed),
              .folder = std::filesystem::canonical(input_, failed)};
  if (jobs.program.empty()) jobs.program = "carom";
  jobs.shards = shards_ > 0.0 ? static_cast<std::uint64_t>(shards_)
                              : shardsFor(trialSeconds(*plan).value_or(1.0), plan->spec.count);
  const std::filesystem::path path = std::filesystem::path(input_) / file;
  if (const Status written = writeSampleFile(path, text(jobs)); !written)
    return fail(kFailed, written.error().message);
  if (json_) return answer(jsonText({{"file", path.string()}, {"shards", jobs.shards}}));
  return answer(path.string() + ": " + std::to_string(jobs.shards) + " shares\n");
}

int BatchCommand::slurm() const {
  constexpr const char* kFile = "slurm.sh";
  const int written = writeJobs(kFile, slurmScript);
  if (written != kDone || dryRun_) return written;
  const std::string output = (std::filesystem::path(input_) / "slurm-%A_%a.log").string();
  const std::string script = (std::filesystem::path(input_) / kFile).string();
  const int code = runProgram({"sbatch", "--output", output, script});
  if (code == kDone) return code;
  return fail(kFailed, "sbatch did not take " + script +
                           "; expected Slurm on this machine, or --dry-run to write it only");
}

int BatchCommand::repeat() const {
  const Result<BatchPlan> plan = loadPlan(input_);
  if (!plan) return fail(kBadInput, plan.error().message);
  const auto index = static_cast<std::uint64_t>(index_);
  if (index >= plan->spec.count)
    return fail(kBadInput, "INDEX: " + std::to_string(index) + "; expected one below " +
                               std::to_string(plan->spec.count) + ", the number of samples");
  const std::string branch = branch_.empty() ? plan->spec.branches.front().name : branch_;
  if (const Status valid =
          refuseStandardOutput(output_, "--output", "a sample may have stems; expected FILE.wav");
      !valid)
    return fail(kBadInput, valid.error().message);
  if (const Status kept =
          checkKept({{"--output", output_}}, {std::filesystem::path(input_) / "plan.json"});
      !kept)
    return fail(kBadInput, kept.error().message);
  if (!isWavName(output_))
    return fail(kBadInput,
                "--output: '" + output_ + "' is not the name of a WAV file; expected FILE.wav");
  if (const Status valid = audio::checkWritable(output_); !valid)
    return fail(kFailed, output_ + ": " + valid.error().message);
  const Result<SampleRunner::Outcome> outcome = SampleRunner(*plan).repeat(index, branch, output_);
  if (!outcome) return fail(kFailed, outcome.error().message);
  if (!outcome->failures.empty()) {
    const SampleFailure& failure = outcome->failures.front();
    return fail(failure.kind == "limit" ? kLimited : kFailed,
                "sample " + std::to_string(index) + ": " + failure.kind + ": " + failure.message);
  }
  const nlohmann::ordered_json& row = outcome->rows.front();
  if (json_) return answer(jsonText(row));
  return answer(output_ + ": sample " + std::to_string(index) + ", " + row.at("parameters").dump() +
                "\nsha256    " + row.value("sha256", "") + '\n');
}

}  // namespace carom::command
