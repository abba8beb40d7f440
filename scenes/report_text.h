#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "carom/native/recording.h"
#include "scenes/compare.h"
#include "scenes/plan.h"
#include "scenes/render.h"
#include "scenes/scene.h"

namespace carom::scenes {

/// What the commands print: text for people, JSON with stable keys for programs (docs/cli.md).

/// A number, or null for what JSON has no number for: infinity, NaN.
nlohmann::ordered_json numberJson(double value);

nlohmann::ordered_json planJson(const Plan& plan);

std::string infoText(const Scene& scene);
nlohmann::ordered_json infoJson(const Scene& scene);

std::string renderText(const RenderReport& report);
nlohmann::ordered_json renderJson(const RenderReport& report);

/// What became of a recording's file.
struct RecordReport {
  std::filesystem::path file;
  std::uintmax_t bytes = 0;
  double wallTime = 0.0;  ///< s, mechanics and writing; 0: it was only read
};

std::string recordText(const Recording& recording, const RecordReport& report);
nlohmann::ordered_json recordJson(const Recording& recording, const RecordReport& report);

std::string compareText(const Scene& scene, const CompareReport& report);
nlohmann::ordered_json compareJson(const Scene& scene, const CompareReport& report);

}  // namespace carom::scenes
