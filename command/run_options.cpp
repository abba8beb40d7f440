#include "command/run_options.h"

#include <algorithm>
#include <optional>

#include "command/command_line.h"
#include <CLI/CLI.hpp>
#include <sys/resource.h>

#include "scenes/limits/machine_memory.h"
#include "scenes/run/bullet_only.h"
#include "scenes/run/native_only.h"

namespace carom::command {

namespace {

constexpr double kLeastMemory = 50e6;  // bytes
constexpr double kMostMemory = 1e18;   // bytes

/// The limit of memory before capMemory.
std::optional<rlimit> limitBefore;

/// Parses "2GB", "500MB" or a number of bytes; nothing if the text is neither, or out of range.
std::optional<double> memoryOf(const std::string& text) {
  double unit = 1.0;
  std::string number = text;
  const std::string small = CLI::detail::to_lower(text);
  for (const auto& [suffix, factor] :
       {std::pair{"kb", 1e3}, {"mb", 1e6}, {"gb", 1e9}, {"tb", 1e12}}) {
    if (!small.ends_with(suffix)) continue;
    unit = factor;
    number = text.substr(0, text.size() - 2);
  }
  double value = 0.0;
  if (!CLI::detail::lexical_cast(number, value)) return std::nullopt;
  value *= unit;
  if (!(value >= kLeastMemory && value <= kMostMemory)) return std::nullopt;
  return value;
}

CLI::Validator memoryRange() {
  const auto check = [](const std::string& text) -> std::string {
    if (memoryOf(text)) return {};
    return "'" + text + "' is no size of memory; expected one from 50MB to 1e6TB, such as 2GB";
  };
  return {check, "SIZE", "a size such as 2GB, from 50MB"};
}

}  // namespace

scenes::RunLimits RunOptions::limits() const {
  scenes::RunLimits limits;
  limits.memory = scenes::machineMemory() / 2;
  if (const auto given = memoryOf(memory)) limits.memory = static_cast<std::uint64_t>(*given);
  limits.time = time;
  limits.events = static_cast<std::uint64_t>(events);
  return limits;
}

void addResourceLimits(CLI::App& command, RunOptions& options) {
  command
      .add_option("--max-memory", options.memory,
                  "end the run beyond it, with exit code 3; default: half of the machine's")
      ->group(kRunLimits)
      ->check(memoryRange());
  command.add_option("--max-time", options.time, "end the run after so long; default: never")
      ->group(kRunLimits)
      ->check(numberRange(1e-3, 1e9, "seconds"));
}

void addLimits(CLI::App& command, RunOptions& options) {
  addResourceLimits(command, options);
  command
      .add_option("--max-events", options.events,
                  "end the run after so many events; default: any number, but no endless rattle")
      ->group(kRunLimits)
      ->check(wholeNumberRange(1, 1e15));
}

void addKeepPartial(CLI::App& command, RunOptions& options) {
  command
      .add_flag("--keep-partial", options.keepPartial,
                "keep what a limit cuts off, as NAME.incomplete.wav")
      ->group(kRunLimits);
}

Status validateRun(const scenes::Scene& scene) {
  return scene.stepper.type == scenes::StepperType::bullet ? scenes::validateForBullet(scene)
                                                           : scenes::validateForNative(scene);
}

int endedEarly(const std::string& file, const scenes::EndedEarly& ended, const std::string& kept) {
  return fail(kLimited,
              file + ": " + ended.what + (kept.empty() ? "" : "; what came before is in " + kept));
}

int endedEarly(const std::string& file, const scenes::ResourceWatch& watch,
               const std::string& limit) {
  return fail(kLimited, file + ": the run ends: " + watch.why(limit));
}

void capMemory(std::uint64_t bytes) {
  // Sanitizers map more than any machine has.
  if (bytes == 0 || scenes::mappedMemory() > bytes) return;
  constexpr rlim_t kRoom = rlim_t{200} << 20U;  // for the program itself
  rlimit limit{};
  if (getrlimit(RLIMIT_DATA, &limit) != 0) return;
  if (!limitBefore) limitBefore = limit;
  limit.rlim_cur = std::min<rlim_t>(limit.rlim_max, 2 * bytes + kRoom);
  setrlimit(RLIMIT_DATA, &limit);
}

void liftMemoryCap() {
  if (limitBefore) setrlimit(RLIMIT_DATA, &*limitBefore);
}

}  // namespace carom::command
