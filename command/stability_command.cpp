#include "command/stability_command.h"

#include <optional>
#include <span>
#include <sstream>
#include <string_view>
#include <vector>

#include "command/command_line.h"
#include "command/output/output_target.h"
#include "command/progress_bar.h"
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "audio/io/byte_file.h"
#include "audio/io/partial_file.h"

namespace carom::command {

using namespace lab;

using namespace audio;

namespace {

/// Says that no case has such an id, and lists all ids.
std::string noCaseMessage(const std::string& pattern, const std::vector<StabilityCase>& cases) {
  std::ostringstream text;
  text << "--only: no case has '" << pattern << "' in its name; expected a part of ";
  for (std::size_t at = 0; at < cases.size(); ++at)
    text << (at == 0 ? "" : at + 1 == cases.size() ? " or " : ", ") << cases[at].id;
  return text.str();
}

Status writeText(const std::string& file, const std::string& text) {
  return writeBytes(file, std::as_bytes(std::span(text)));
}

/// A run, and why it has ended before its last case.
struct BoundedRun {
  StabilityReport report;
  std::string limit;  // empty if it has not
  std::string next;   // id of the case that was not run
};

BoundedRun runWithBar(const std::vector<StabilityCase>& cases, StabilityForm form,
                      scenes::ResourceWatch& watch) {
  std::optional<ProgressBar> bar;
  BoundedRun run;
  run.report = runStability(cases, form, [&](std::string_view id, double share) {
    bar.reset();  // each case has its own label, in place of the last one's
    if (share >= 1.0) return true;
    run.limit = watch.exceeded();
    run.next = id;
    if (run.limit.empty()) bar.emplace("stability " + std::string(id)).show(share);
    return run.limit.empty();
  });
  return run;
}

}  // namespace

StabilityCommand::StabilityCommand(CLI::App& app)
    : command_(app.add_subcommand(
          "stability",
          "Run stiff and extreme cases, each against what theory expects\n"
          "Exit code 1 says that a case has failed; docs/stability.md tells what each is.")) {
  command_->add_flag("--short", short_,
                     "fewer points, and no case that takes long: a few seconds instead of minutes");
  command_
      ->add_option("--only", only_,
                   "cases with this in their name; '*' stands for anything in between")
      ->type_name("PART");
  CLI::Option* list = command_->add_flag("--list", list_, "say which cases there are; run none");
  command_
      ->add_option("-o,--output", output_,
                   "JSON file to write, beside what is printed; for standard output there is "
                   "--json")
      ->type_name("FILE.json")
      ->check(fileName())
      ->excludes(list);
  command_->add_flag("--json", json_, "print one JSON object instead of text");
  addResourceLimits(*command_, run_);
  command_->footer(
      "Examples:\n"
      "  carom stability --short\n"
      "  carom stability --only jello -o jello.json\n"
      "  carom stability --only 'native*day' --json");
}

int StabilityCommand::list(const std::vector<StabilityCase>& cases) const {
  return answer(json_ ? jsonText(stabilityListJson(cases)) : stabilityListText(cases));
}

bool StabilityCommand::parsed() const {
  return command_->parsed();
}

int StabilityCommand::run() const {
  const std::vector<StabilityCase> all = selectCases(stabilityCases(), form(), "");
  const std::vector<StabilityCase> cases = selectCases(all, form(), only_);
  if (cases.empty()) return fail(kBadInput, noCaseMessage(only_, all));
  if (list_) return list(cases);
  if (const Status valid = refuseStandardOutput(output_, "--output", "expected --json"); !valid)
    return fail(kBadInput, valid.error().message);
  if (!output_.empty())
    if (const Status valid = checkWritable(output_); !valid)
      return fail(kFailed, output_ + ": " + valid.error().message);

  capMemory(run_.limits().memory);
  scenes::ResourceWatch watch(run_.limits());
  const auto [report, limit, next] = runWithBar(cases, form(), watch);
  if (!limit.empty()) return endedEarly("stability, before " + next, watch, limit);
  const nlohmann::ordered_json object = stabilityJson(report);
  if (!output_.empty())
    if (const Status written = writeText(output_, jsonText(object)); !written)
      return fail(kFailed, written.error().message);
  const int answered = answer(json_ ? jsonText(object) : stabilityText(report));
  return answered == kDone ? report.exitCode() : answered;
}

}  // namespace carom::command
