#pragma once

#include <filesystem>
#include <span>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "carom/audio/result.h"
#include "scenes/report.h"

namespace carom::scenes {

/// What `carom report` writes, and docs/report.md describes.

nlohmann::ordered_json reportJson(std::span<const SceneReport> scenes);

/// A row for each variant of each scene, RFC 4180.
std::string reportCsv(std::span<const SceneReport> scenes);

/// The page: all of it in one file, that needs no network.
std::string reportHtml(std::span<const SceneReport> scenes);

/// The names of the files in a folder.
struct ReportFiles {
  std::filesystem::path json;
  std::filesystem::path csv;
  std::filesystem::path html;
};

ReportFiles reportFilesIn(const std::filesystem::path& folder);

/// Why they cannot be written there, before anything is run; empty where they can. A folder that is
/// not there yet needs one above it that is.
std::string whyNoReportIn(const std::filesystem::path& folder);

/// Writes all three, or none: makes the folder where it is missing.
Status writeReport(std::span<const SceneReport> scenes, const std::filesystem::path& folder);

}  // namespace carom::scenes
