#include "lab/batch/batch_page.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <sstream>
#include <utility>
#include <vector>

#include "lab/batch/manifest.h"
#include "lab/batch/sample_run.h"
#include "lab/page/page_text.h"
#include "lab/report/report_page.h"

#include "modal/json/json_reader.h"
#include "scenes/limits/resource_watch.h"

namespace carom::lab {
namespace {

using nlohmann::ordered_json;

constexpr std::size_t kMostRows = 20'000;

constexpr const char* kReader =
    R"PY("""Reads the samples of this batch: the standard library and NumPy.

    for sound, rate, row in samples("train"):
        ...  # sound: pressure in Pa, frames x channels; row: parameters, events, ... (manifest.jsonl)
"""
import json
import pathlib
import struct

import numpy as np


def wav(path):
    data, at = pathlib.Path(path).read_bytes(), 12
    while at < len(data):
        name, size = struct.unpack("<4sI", data[at:at + 8])
        if name == b"fmt ":
            channels, rate = struct.unpack("<HI", data[at + 10:at + 16])
        if name == b"data":
            return np.frombuffer(data, "<f4", size // 4, at + 8).reshape(-1, channels), rate
        at += 8 + size + size % 2


def samples(split=None, folder=pathlib.Path(__file__).parent):
    for line in open(folder / "manifest.jsonl", encoding="utf-8"):
        row = json.loads(line)
        if split in (None, row["split"]):
            sound, rate = wav(folder / row["file"])
            yield sound * row["full_scale_pa"], rate, row
)PY";

constexpr const char* kFlacReader =
    R"PY("""Reads the samples of this batch: NumPy and soundfile (pip install soundfile).

    for sound, rate, row in samples("train"):
        ...  # sound: pressure in Pa, frames x channels; row: parameters, events, ... (manifest.jsonl)
"""
import json
import pathlib

import soundfile


def samples(split=None, folder=pathlib.Path(__file__).parent):
    for line in open(folder / "manifest.jsonl", encoding="utf-8"):
        row = json.loads(line)
        if split in (None, row["split"]):
            sound, rate = soundfile.read(folder / row["file"], always_2d=True)
            yield sound * row["full_scale_pa"], rate, row
)PY";

/// Sums over all rows.
struct BatchTotals {
  double sound = 0.0;  ///< s
  double wall = 0.0;   ///< s
  double bytes = 0.0;
  std::set<std::string> machines;
  std::map<std::string, std::size_t> splits;
  std::vector<double> levels;      ///< dB SPL, ascending
  std::vector<double> durations;   ///< s, ascending
  std::vector<double> collisions;  ///< ascending
};

BatchTotals totalsOf(const BatchRows& rows) {
  BatchTotals totals;
  for (const auto& [id, row] : rows.rows) {
    totals.sound += row.value("duration_s", 0.0);
    totals.wall += row.value("wall_s", 0.0);
    for (const RowFile& keys : kRowFiles)
      totals.bytes += row.value(keys.bytes, 0.0);
    totals.machines.insert(machineOf(row));
    ++totals.splits[row.value("split", "")];
    if (const double peak = row.value("peak_pa", 0.0); peak > 0.0)
      totals.levels.push_back(20.0 * std::log10(peak / 20e-6));
    totals.durations.push_back(row.value("duration_s", 0.0));
    totals.collisions.push_back(0.5 * row.value("events", 0.0));
  }
  for (std::vector<double>* const numbers : {&totals.levels, &totals.durations, &totals.collisions})
    std::ranges::sort(*numbers);
  return totals;
}

std::string shortNumber(double value) {
  std::ostringstream text;
  text.precision(3);
  text << value;
  return text.str();
}

/// Returns the least, the middle and the largest of sorted numbers, and those at 5 and 95 %.
std::string spreadOf(const std::vector<double>& sorted) {
  if (sorted.empty()) return "| | | | | |";
  std::string text = "|";
  for (const double share : {0.0, 0.05, 0.5, 0.95, 1.0}) {
    const double at = share * static_cast<double>(sorted.size() - 1);
    text += ' ' + shortNumber(sorted[static_cast<std::size_t>(std::lround(at))]) + " |";
  }
  return text;
}

std::string listOf(const std::vector<nlohmann::json>& values) {
  constexpr std::size_t kMost = 12;
  std::string text;
  for (std::size_t at = 0; at < std::min(kMost, values.size()); ++at)
    text += (at > 0 ? ", " : "") +
            (values[at].is_string() ? values[at].get<std::string>() : values[at].dump());
  if (values.size() > kMost) text += ", and " + std::to_string(values.size() - kMost) + " more";
  return text;
}

std::string rangeOf(const BatchParameter& parameter) {
  const auto interval = [&parameter] {
    return shortNumber(parameter.low) + " to " + shortNumber(parameter.high);
  };
  switch (parameter.kind) {
    case ParameterKind::uniform:
    case ParameterKind::logUniform:
      return interval();
    case ParameterKind::normal:
      return "mean " + shortNumber(parameter.mean) + ", deviation " +
             shortNumber(parameter.deviation) +
             (std::isfinite(parameter.high) ? ", within " + interval() : "");
    case ParameterKind::expression:
      return '`' + parameter.expression + '`';
    case ParameterKind::grid:
    case ParameterKind::choice:
    case ParameterKind::permutation:
      break;
  }
  return listOf(parameter.values);
}

std::string cardOf(const BatchPlan& plan, const BatchRows& rows) {
  const BatchSpec& spec = plan.spec;
  const BatchTotals totals = totalsOf(rows);
  std::ostringstream text;
  text.precision(3);
  text << "# " << spec.name << "\n\n"
       << spec.description << "\n\n"
       << "Contact sound, computed by physics: clicks from the recoil of bodies, modes that ring, "
          "sliding and rolling.\nPressures are in pascals at the listeners; every sound comes with "
          "the exact times, places and impulses of its collisions.\n\n"
       << rows.rows.size() << " sounds of " << spec.count << " samples";
  if (spec.branches.size() > 1) text << " in " << spec.branches.size() << " branches each";
  text << ", " << totals.sound / 3600.0 << " h, " << scenes::bytesText(totals.bytes) << "; "
       << rows.failures.size() << " failed.\n\n## Files\n\n"
       << "| | |\n|---|---|\n"
       << "| `manifest.jsonl`, `manifest.csv` | a row for each sound: file, SHA-256, split, "
          "parameters, duration, peak |\n"
       << "| `samples/*/*" << (spec.outputs.form == SampleForm::flac ? ".flac" : ".wav")
       << "` | the sounds; 1.0 stands for `full_scale_pa` of the row |\n"
       << "| `samples/*/*.json` | the scene of each sound, whole, and what it was made by |\n";
  if (spec.outputs.events)
    text << "| `samples/*/*.events.csv` | each impulse event: time, bodies, impulse, place, "
            "approach speed, peak at the loudest listener |\n";
  if (spec.outputs.contacts)
    text << "| `samples/*/*.contacts.csv` | each step of each lasting contact: load, slip, rolling "
            "|\n";
  if (spec.outputs.poses > 0.0)
    text << "| `samples/*/*.poses.csv` | poses of all bodies that move, " << spec.outputs.poses
         << " times a second |\n";
  if (spec.outputs.stems)
    text
        << "| `samples/*/*.clicks.*`, `.rings.*`, `.contacts.*` | the parts that a sound is the "
           "sum of, in its unit: recoil from impacts, vibration from impacts, lasting contacts |\n";
  text << "| `failures.jsonl` | samples that have none, with the reason |\n"
       << "| `read.py` | reads the samples in Python |\n\n## Parameters\n\n"
       << "| parameter | drawn | from |\n|---|---|---|\n";
  for (const BatchParameter& parameter : spec.parameters)
    text << "| `" << parameter.name << "` | " << nameOf(parameter.kind) << " | "
         << rangeOf(parameter) << " |\n";
  if (spec.branches.size() > 1) {
    text << "\nBranches, which share the parameters of their sample:";
    for (const BatchBranch& branch : spec.branches)
      text << " `" << branch.name << '`';
    text << ".\n";
  }
  text << "\n## Statistics\n\n| | least | 5 % | median | 95 % | largest "
          "|\n|---|---|---|---|---|---|\n"
       << "| peak, dB SPL " << spreadOf(totals.levels) << "\n| duration, s "
       << spreadOf(totals.durations) << "\n| collisions " << spreadOf(totals.collisions)
       << "\n\n| split | sounds |\n|---|---|\n";
  for (const auto& [split, number] : totals.splits)
    text << "| " << split << " | " << number << " |\n";
  if (!spec.split.by.empty()) {
    text << "\nSounds that agree in";
    for (const std::string& name : spec.split.by)
      text << " `" << name << '`';
    text << " are in one split.\n";
  }
  text << "\n## Made by\n\nSeed " << spec.seed << ", plan `" << plan.hash << "`, on";
  for (const std::string& machine : totals.machines)
    text << ' ' << machine << ';';
  text << " content `" << contentHash(rows)
       << "`.\nThe same plan, version, processor features and C library give the same bytes; "
          "`carom batch verify` checks them.\n";
  return text.str();
}

}  // namespace

std::string batchPage(const BatchPlan& plan, const BatchRows& rows) {
  const BatchTotals totals = totalsOf(rows);
  ordered_json parameters = ordered_json::array();
  for (const BatchParameter& parameter : plan.spec.parameters)
    parameters.push_back({{"name", parameter.name}, {"kind", nameOf(parameter.kind)}});
  ordered_json shown = ordered_json::array();
  const std::size_t stride = (rows.rows.size() + kMostRows - 1) / kMostRows;
  std::size_t at = 0;
  for (const auto& [id, row] : rows.rows) {
    if (at++ % std::max<std::size_t>(1, stride) != 0) continue;
    ordered_json& one = shown.emplace_back();
    for (const char* const key : {"index", "branch", "split", "file", "parameters", "attempt",
                                  "duration_s", "peak_pa", "full_scale_pa", "events", "wall_s"})
      if (row.contains(key)) one[key] = row.at(key);
  }
  ordered_json failures = ordered_json::array();
  for (const auto& [id, failure] : rows.failures)
    failures.push_back(failure);
  const ordered_json data = {{"name", plan.spec.name},
                             {"description", plan.spec.description},
                             {"planned", plan.spec.count * plan.spec.branches.size()},
                             {"whole", rows.rows.size()},
                             {"hours", totals.sound / 3600.0},
                             {"factor", totals.wall > 0.0 ? totals.sound / totals.wall : 0.0},
                             {"machines", totals.machines},
                             {"parameters", parameters},
                             {"rows", shown},
                             {"failures", failures}};
  std::string page(embedded_batch_html);
  fillPage(page, "<!--carom:style-->", embedded_page_css);
  fillPage(page, "<!--carom:chart-->", embedded_chart_js);
  fillPage(
      page, "<!--carom:data-->",
      "<script type=\"application/json\" id=\"batch-data\">" + jsonInScript(data) + "</script>");
  fillPage(page, "<!--carom:script-->", embedded_batch_js);
  return page;
}

Status writeDataCard(const BatchPlan& plan, const BatchRows& rows) {
  const bool isFlac = plan.spec.outputs.form == SampleForm::flac;
  if (Status written = writeSampleFile(plan.folder / "README.md", cardOf(plan, rows)); !written)
    return written;
  return writeSampleFile(plan.folder / "read.py", isFlac ? kFlacReader : kReader);
}

}  // namespace carom::lab
