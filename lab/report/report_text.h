#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "lab/compare/compare.h"
#include "lab/estimate/run_estimate.h"
#include <nlohmann/json_fwd.hpp>

#include "carom/native/recording.h"
#include "scenes/format/scene.h"
#include "scenes/limits/run_guard.h"
#include "scenes/recording/recorded_run.h"
#include "scenes/run/plan.h"
#include "scenes/run/render.h"

namespace carom::lab {

using namespace scenes;

/// The output of the commands: text for people, JSON with stable keys for programs (docs/cli.md).

/// Returns the level in dB over 20 uPa of a pressure in Pa; minus infinity for 0.
double soundPressureLevel(double pressure);

/// Returns a number, or null for infinity and NaN, which JSON has no number for.
nlohmann::ordered_json numberJson(double value);

/// Returns why a run has ended before its scene, or null if it has not.
nlohmann::ordered_json endedJson(const std::optional<EndedEarly>& ended);

nlohmann::ordered_json planJson(const Plan& plan);

/// How much a text says: what matters to most, or all, down to what was left out and why.
enum class Detail { brief, whole };

std::string infoText(const Scene& scene, Detail detail);
nlohmann::ordered_json infoJson(const Scene& scene);

std::string estimateText(const RunEstimate& estimate);
nlohmann::ordered_json estimateJson(const RunEstimate& estimate);

std::string renderText(const RenderReport& report, Detail detail);
nlohmann::ordered_json renderJson(const RenderReport& report);

/// A recording's file, as it was written or read.
struct RecordReport {
  std::filesystem::path file;
  std::uintmax_t bytes = 0;
  double wallTime = 0.0;  ///< s, mechanics and writing; 0 if it was only read
};

std::string recordText(const Recording& recording, const RecordReport& report);
nlohmann::ordered_json recordJson(const Recording& recording, const RecordReport& report);

/// The file of a run on any stepper, as it was written.
struct RunFileReport {
  std::filesystem::path file;
  double duration = 0.0;  ///< s
  double wallTime = 0.0;  ///< s, mechanics and writing
  RunReport run;
};

std::string runText(const RunFileReport& report);
nlohmann::ordered_json runJson(const RunFileReport& report);

std::string compareText(const Scene& scene, const CompareReport& report);
nlohmann::ordered_json compareJson(const Scene& scene, const CompareReport& report);

}  // namespace carom::lab
