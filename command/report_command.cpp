#include "command/report_command.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <set>
#include <sstream>
#include <utility>

#include "command/command_line.h"
#include "command/library/scene_library.h"
#include "command/output/kept_inputs.h"
#include "command/output/output_target.h"
#include "command/progress_bar.h"
#include "command/terminal/terminal.h"
#include "command/view_command.h"
#include "lab/report/report.h"
#include "lab/report/report_files.h"
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "scenes/format/scene_loader.h"

namespace carom::command {

using namespace scenes;
using namespace lab;
namespace {

constexpr double kMostRuns = 1000;
constexpr std::uintmax_t kLargestPage =
    20'000'000;                                   // bytes of a page that shows a scene's variants
constexpr std::uintmax_t kFullPage = 18'000'000;  // bytes from which on little more would fit

/// A page in which a scene's variants are seen and heard.
struct ShownScene {
  std::string name;
  ViewPage page;
};

// Reads the scenes. Refuses two of one name, which could not be told apart in the report.
Result<std::vector<Scene>> readScenes(const std::vector<std::string>& files, bool confine) {
  std::vector<Scene> scenes;
  std::set<std::string> names;
  for (const std::string& file : files) {
    Result<Scene> scene = loadScene(file, {.confined = confine});
    if (!scene) return scene.error();
    if (!names.insert(scene->name).second)
      return Error{file + ": a second scene of the name '" + scene->name +
                   "'; expected scenes of different names"};
    scenes.push_back(*std::move(scene));
  }
  return scenes;
}

std::string errorText(const VariantReport& variant) {
  std::ostringstream text;
  text.precision(3);
  if (!variant.waveformError) return "-";
  const auto decibels = [](double ratio) { return std::round(200.0 * std::log10(ratio)) / 10.0; };
  if (!(*variant.waveformError > 0.0)) return "none";
  text << decibels(*variant.waveformError) << " dB";
  if (variant.aligned && variant.aligned->error > 0.0)
    text << " (" << decibels(variant.aligned->error) << " aligned)";
  return text.str();
}

std::string textOf(const SceneReport& report) {
  std::ostringstream text;
  text.precision(3);
  text << report.scene.name << ": " << report.variants.size() << " variants, "
       << report.leftOut.size() << " left out; reference: " << report.variants.front().choice.label
       << '\n';
  for (const VariantReport& variant : report.variants) {
    text << "  " << 1e3 * variant.runTime.total() << " ms/s, error " << errorText(variant) << "  "
         << variant.choice.label;
    if (std::isfinite(variant.divergedAt)) text << " (diverges at " << variant.divergedAt << " s)";
    text << '\n';
  }
  if (!talk().isVerbose() && !report.leftOut.empty())
    text << "  -v says which are left out, and why\n";
  for (const VariantLeftOut& entry : report.leftOut)
    if (talk().isVerbose()) text << "  left out: " << entry.label << ": " << entry.why << '\n';
  return text.str();
}

}  // namespace

ReportCommand::ReportCommand(CLI::App& app)
    : command_(app.add_subcommand(
          "report",
          "Run scenes in all ways that matter: error against run time\n"
          "Each variant of mechanics and sound is measured against the reference, and written as a "
          "page, JSON and CSV; -v also says which variants are left out, and why.")) {
  command_
      ->add_option("SCENE", scenes_,
                   "files (JSON, docs/scenes.md), or scenes of the library by name")
      ->required()
      ->transform(sceneName());
  command_
      ->add_option("-o,--output", output_,
                   "folder to write index.html, report.json, report.csv and a page for each scene "
                   "to; is made if it is not there")
      ->required()
      ->check(folderName());
  command_->add_option("--runs", runs_, "of each variant, of whose times the median counts")
      ->check(wholeNumberRange(1, kMostRuns))
      ->capture_default_str();
  command_
      ->add_option("--budget", budget_, "variants whose mechanics would take longer are left out")
      ->check(numberRange(0.001, 1e6, "seconds"))
      ->capture_default_str();
  command_->add_flag("--confine,!--no-confine", confine_,
                     "refuse files that a scene names outside of its folder; on by default");
  command_->add_flag("--no-view", noView_,
                     "leave out the pages in which the variants are seen and heard");
  command_
      ->add_option("--template", template_,
                   "page without runs, as 'cmake --preset web' makes it; default: the one that "
                   "was built or installed with this program")
      ->type_name("FILE.html");
  addLimits(*command_, run_);
  command_->add_flag("--json", json_, "print what is in report.json instead of text");
  command_->footer(
      "Example:\n"
      "  carom report two_balls newtons_cradle -o report");
}

bool ReportCommand::parsed() const {
  return command_->parsed();
}

int ReportCommand::run() const {
  if (const Status valid =
          refuseStandardOutput(output_, "--output", "a report is several files; expected a folder");
      !valid)
    return fail(kBadInput, valid.error().message);
  const std::filesystem::path folder = output_;
  if (const Status valid = checkReportFolder(folder); !valid)
    return fail(kBadInput, "--output: " + valid.error().message);
  const ReportFiles files = reportFilesIn(folder);
  Result<std::vector<Scene>> scenes = readScenes(scenes_, confine_);
  if (!scenes) return fail(kBadInput, scenes.error().message);
  std::vector<std::filesystem::path> read(scenes_.begin(), scenes_.end());
  read.emplace_back(template_);
  std::vector<WrittenFile> outputs = {
      {"--output", files.json}, {"--output", files.csv}, {"--output", files.html}};
  for (std::size_t index = 0; index < scenes->size(); ++index) {
    const Scene& scene = (*scenes)[index];
    outputs.push_back({"--output", folder / viewName(scene.name, index)});
    read.insert(read.end(), scene.files.begin(), scene.files.end());
  }
  if (const Status kept = checkKept(outputs, read); !kept)
    return fail(kBadInput, kept.error().message);

  std::optional<std::filesystem::path> pageTemplate;
  std::string whyNoPages = "left out";
  if (!noView_) {
    const auto found = findTemplate(template_, pageFolders());
    if (!found && !template_.empty()) return fail(kBadInput, found.error().message);
    if (found) pageTemplate = *found;
    if (!found) whyNoPages = found.error().message;
  }

  RunLimits limits = run_.limits();
  capMemory(limits.memory);
  const ResourceWatch watch(limits);
  std::vector<SceneReport> reports;
  std::vector<ShownScene> shown;
  for (std::size_t index = 0; index < scenes->size(); ++index) {
    const Scene& scene = (*scenes)[index];
    ProgressBar bar("measuring " + scene.name);
    limits.spent = watch.seconds();
    RunGuard guard(scene, limits);
    ReportOptions options;
    options.guard = &guard;
    options.runs = runs_;
    options.budget = budget_;
    options.progress = [&bar](double share, const std::string&) { bar.show(share); };
    if (pageTemplate) {
      Result<ViewPage> page = ViewPage::create(*pageTemplate, scene.name);
      if (!page) return fail(kBadInput, page.error().message);
      if (const Status head = addDefaultHead(*page); !head)
        return fail(kFailed, head.error().message);
      shown.push_back({viewName(scene.name, index), *std::move(page)});
      ViewPage& filled = shown.back().page;
      options.show = [&filled](const ViewRun& run) { return filled.add(run, kLargestPage); };
      options.isFull = [&filled] { return filled.bytes() > kFullPage; };
    }
    Result<SceneReport> report = reportScene(scene, options);
    bar.clear();
    if (guard.ended()) return endedEarly(scenes_[index], *guard.ended(), "");
    if (!report) return fail(kFailed, report.error().message);
    if (!report->shown.empty()) report->page = shown.back().name;
    reports.push_back(*std::move(report));
  }
  std::erase_if(shown, [](const ShownScene& scene) { return scene.page.runs() == 0; });
  if (const Status made = makeReportFolder(folder); !made)
    return fail(kFailed, made.error().message);
  for (const ShownScene& scene : shown)
    if (const auto written = scene.page.write(folder / scene.name); !written)
      return fail(kFailed, written.error().message);
  if (const Status written = writeReport(reports, folder); !written)
    return fail(kFailed, written.error().message);
  if (json_) return answer(jsonText(reportJson(reports)));
  std::string text;
  for (const SceneReport& report : reports)
    text += textOf(report);
  text += "wrote " + reportFilesIn(folder).html.string() + "\n";
  if (!pageTemplate) text += "without pages to see the variants in: " + whyNoPages + "\n";
  return answer(text);
}

}  // namespace carom::command
