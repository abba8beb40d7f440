#include "lab/report/report_files.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <set>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>
#include <variant>

#include "lab/page/page_text.h"
#include "lab/report/csv_cell.h"
#include "lab/report/report_media.h"
#include "lab/report/report_page.h"
#include "lab/report/report_text.h"
#include <nlohmann/json.hpp>

#include "audio/io/partial_file.h"

namespace carom::lab {

using namespace scenes;

using namespace audio;
using namespace native;

namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

template <class T>
Json orNull(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}

Json summary(const ErrorSummary& errors) {
  return {{"rms", numberJson(errors.rms)}, {"max", numberJson(errors.max)}};
}

Json decibels(const std::optional<double>& ratio) {
  return ratio && *ratio > 0.0 ? Json(20.0 * std::log10(*ratio)) : Json(nullptr);
}

std::string processor() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    const std::size_t colon = line.find(": ");
    if (line.starts_with("model name") && colon != std::string::npos) return line.substr(colon + 2);
  }
  return "unknown";
}

Json machineJson() {
#if defined(__clang__)
  const std::string compiler = std::string("Clang ") + __clang_version__;
#elif defined(__GNUC__)
  const std::string compiler = std::string("GCC ") + __VERSION__;
#else
  const std::string compiler = "unknown";
#endif
#ifdef NDEBUG
  const char* build = "release";
#else
  const char* build = "development";
#endif
  return {{"processor", processor()},
          {"cores", std::thread::hardware_concurrency()},
          {"compiler", compiler},
          {"build", build}};
}

const char* nameOf(LocalKind kind) {
  switch (kind) {
    case LocalKind::none:
      return "none";
    case LocalKind::path:
      return "path";
    case LocalKind::bridge:
      return "bridge";
  }
  return "";
}

Json choicesJson(const ReportChoice& choice) {
  Json choices = Json::object();
  for (const auto& [name, value] : namesOf(choice))
    std::visit([&choices, &name = name](const auto& word) { choices[name] = word; }, value);
  return choices;
}

Json bandsJson(const std::vector<BandDifference>& bands) {
  if (bands.empty()) return nullptr;
  Json list = Json::array();
  for (const BandDifference& band : bands)
    list.push_back({{"frequency", std::round(band.frequency)}, {"difference_db", band.difference}});
  return list;
}

Json variantJson(const VariantReport& variant) {
  const RunTime& time = variant.runTime;
  Json object = {{"id", variant.choice.id},
                 {"group", nameOf(variant.choice.group)},
                 {"label", variant.choice.label},
                 {"choices", choicesJson(variant.choice)},
                 {"run_time",
                  {{"total", time.total()},
                   {"mechanics", time.mechanics},
                   {"sound", time.sound},
                   {"spread", time.spread},
                   {"runs", time.runs}}},
                 {"memory", orNull(variant.memory)},
                 {"local_reference", nameOf(variant.local)}};
  if (const auto& events = variant.events) {
    object["events"] = {{"reference", events->reference},
                        {"matched", events->matched},
                        {"missed", events->missed},
                        {"spurious", events->spurious}};
    object["event_time_error"] = summary(events->timeError);
    object["impulse_error"] = summary(events->impulseError);
  } else {
    for (const char* key : {"events", "event_time_error", "impulse_error"})
      object[key] = nullptr;
  }
  object["local_waveform_error"] = orNull(variant.localWaveformError);
  object["local_waveform_error_db"] = decibels(variant.localWaveformError);
  object["diverged_at"] = numberJson(variant.divergedAt);
  object["compared_until"] = variant.comparedUntil;
  object["waveform_error"] = orNull(variant.waveformError);
  object["waveform_error_db"] = decibels(variant.waveformError);
  object["aligned_waveform_error"] = variant.aligned ? Json(variant.aligned->error) : Json(nullptr);
  object["aligned_waveform_error_db"] =
      variant.aligned ? decibels(variant.aligned->error) : Json(nullptr);
  object["delay"] = variant.aligned ? Json(variant.aligned->delay) : Json(nullptr);
  object["band_error_db"] = variant.bands.empty() ? Json(nullptr) : Json(rmsOf(variant.bands));
  object["bands"] = bandsJson(variant.bands);
  object["energy_drift"] = orNull(variant.energyDrift);
  object["position_error"] = orNull(variant.positionError);
  object["notes"] = variant.notes;
  return object;
}

Json sceneJson(const SceneReport& report) {
  Json variants = Json::array();
  for (const VariantReport& variant : report.variants)
    variants.push_back(variantJson(variant));
  Json leftOut = Json::array();
  for (const VariantLeftOut& entry : report.leftOut)
    leftOut.push_back({{"label", entry.label}, {"why", entry.why}});
  const Scene& scene = report.scene;
  return {{"name", scene.name},
          {"description", scene.description},
          {"duration", scene.duration},
          {"sample_rate", scene.sampleRate},
          {"channels", report.variants.front().signal.size()},
          {"plan", planJson(report.plan)},
          {"reference", report.variants.front().choice.id},
          {"reference_why", report.referenceWhy},
          {"page", report.page.empty() ? Json(nullptr) : Json(report.page)},
          {"shown", report.shown},
          {"variants", variants},
          {"variants_left_out", leftOut}};
}

/// A column of the CSV: a JSON pointer into a variant's object, and the column's name.
struct Column {
  const char* pointer;
  const char* name;
};

constexpr std::array kColumns = {Column{"/id", "id"},
                                 Column{"/group", "group"},
                                 Column{"/label", "label"},
                                 Column{"/choices/stepper", "stepper"},
                                 Column{"/choices/step", "step_s"},
                                 Column{"/choices/tuned", "tuned"},
                                 Column{"/choices/event_time", "event_time"},
                                 Column{"/choices/impulse", "impulse"},
                                 Column{"/choices/integrator", "integrator"},
                                 Column{"/choices/pulse", "pulse"},
                                 Column{"/choices/sampling", "sampling"},
                                 Column{"/choices/radiation", "radiation"},
                                 Column{"/choices/doppler", "doppler"},
                                 Column{"/choices/air", "air"},
                                 Column{"/choices/ringing", "ringing"},
                                 Column{"/choices/modes", "modes"},
                                 Column{"/run_time/total", "run_time"},
                                 Column{"/run_time/mechanics", "run_time_mechanics"},
                                 Column{"/run_time/sound", "run_time_sound"},
                                 Column{"/run_time/spread", "run_time_spread"},
                                 Column{"/run_time/runs", "runs"},
                                 Column{"/memory", "memory_bytes"},
                                 Column{"/local_reference", "local_reference"},
                                 Column{"/events/reference", "events_reference"},
                                 Column{"/events/matched", "matched"},
                                 Column{"/events/missed", "missed"},
                                 Column{"/events/spurious", "spurious"},
                                 Column{"/event_time_error/rms", "event_time_error_rms_s"},
                                 Column{"/event_time_error/max", "event_time_error_max_s"},
                                 Column{"/impulse_error/rms", "impulse_error_rms"},
                                 Column{"/impulse_error/max", "impulse_error_max"},
                                 Column{"/local_waveform_error_db", "local_waveform_error_db"},
                                 Column{"/diverged_at", "diverged_at_s"},
                                 Column{"/compared_until", "compared_until_s"},
                                 Column{"/waveform_error_db", "waveform_error_db"},
                                 Column{"/aligned_waveform_error_db", "aligned_waveform_error_db"},
                                 Column{"/delay", "delay_s"},
                                 Column{"/band_error_db", "band_error_db"},
                                 Column{"/energy_drift", "energy_drift"},
                                 Column{"/position_error", "position_error_m"}};

Status writeText(const PartialFile& file, const std::string& text) {
  std::ofstream stream(file.path(), std::ios::binary);
  stream << text;
  stream.close();
  if (!stream) return Error{file.finalPath().string() + ": could not be written"};
  return std::monostate{};
}

}  // namespace

Json reportJson(std::span<const SceneReport> scenes) {
  Json list = Json::array();
  for (const SceneReport& scene : scenes)
    list.push_back(sceneJson(scene));
  return {{"format", "carom report 1"},
          {"program", std::string("carom ") + CAROM_VERSION},
          {"machine", machineJson()},
          {"scenes", list}};
}

std::string reportCsv(std::span<const SceneReport> scenes) {
  std::string text = "scene";
  for (const Column& column : kColumns)
    text.append(",").append(column.name);
  text += "\r\n";
  for (const SceneReport& scene : scenes) {
    for (const VariantReport& variant : scene.variants) {
      const Json object = variantJson(variant);
      text += csvCell(scene.scene.name);
      for (const Column& column : kColumns) {
        const Json::json_pointer pointer(column.pointer);
        text.append(",").append(object.contains(pointer) ? csvCell(object.at(pointer)) : "");
      }
      text += "\r\n";
    }
  }
  return text;
}

std::string reportHtml(std::span<const SceneReport> scenes) {
  Json media = Json::object();
  for (const SceneReport& scene : scenes) {
    Json ofScene = mediaJson(scene);
    for (auto& [id, entry] : ofScene.items())
      media[scene.scene.name + "/" + id] = std::move(entry);
  }
  std::string page(embedded_page_html);
  std::string data = R"(<script type="application/json" id="carom-report">)";
  data += jsonInScript(reportJson(scenes));
  data += "</script>\n<script type=\"application/json\" id=\"carom-media\">";
  data += jsonInScript(media);
  data += "</script>";
  fillPage(page, "<!--carom:style-->", embedded_page_css);
  fillPage(page, "<!--carom:chart-->", embedded_chart_js);
  fillPage(page, "<!--carom:script-->", embedded_page_js);
  fillPage(page, "<!--carom:data-->", data);
  return page;
}

ReportFiles reportFilesIn(const fs::path& folder) {
  return {folder / "report.json", folder / "report.csv", folder / "index.html"};
}

std::string viewName(const std::string& scene, std::size_t index) {
  const bool isPlain =
      !scene.empty() && scene.size() < 100 && std::ranges::all_of(scene, [](char letter) {
        return (letter >= 'a' && letter <= 'z') || (letter >= '0' && letter <= '9') ||
               letter == '_' || letter == '-';
      });
  // A scene may be called "2".
  return (isPlain ? "view_" + scene : "view-" + std::to_string(index + 1)) + ".html";
}

Status checkReportFolder(const fs::path& folder) {
  std::error_code ignored;
  if (fs::exists(folder, ignored)) {
    if (!fs::is_directory(folder, ignored))
      return Error{folder.string() + ": is a file; expected a folder"};
    const ReportFiles files = reportFilesIn(folder);
    for (const fs::path& file : {files.json, files.csv, files.html})
      if (const Status valid = checkWritable(file); !valid)
        return Error{file.string() + ": " + valid.error().message};
    return std::monostate{};
  }
  const fs::path above = fs::absolute(folder, ignored).lexically_normal().parent_path();
  if (!fs::is_directory(above.empty() ? "." : above, ignored))
    return Error{folder.string() + ": there is no folder " + above.string() + " to make it in"};
  return std::monostate{};
}

Status makeReportFolder(const fs::path& folder) {
  std::error_code error;
  fs::create_directory(folder, error);
  if (error) return Error{folder.string() + ": " + error.message()};
  return std::monostate{};
}

Status writeReport(std::span<const SceneReport> scenes, const fs::path& folder) {
  if (Status made = makeReportFolder(folder); !made) return made;
  const ReportFiles names = reportFilesIn(folder);
  PartialFile json(names.json);
  PartialFile csv(names.csv);
  PartialFile html(names.html);
  const std::pair<PartialFile*, std::string> files[] = {
      {&json, reportJson(scenes).dump(1, ' ', false, Json::error_handler_t::replace) + "\n"},
      {&csv, reportCsv(scenes)},
      {&html, reportHtml(scenes)}};
  for (const auto& [file, text] : files)
    if (Status written = writeText(*file, text); !written) return written;
  for (const auto& [file, text] : files)
    if (const std::error_code failed = file->giveName())
      return Error{file->finalPath().string() + ": " + failed.message()};
  return std::monostate{};
}

}  // namespace carom::lab
