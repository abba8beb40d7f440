#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "lab/report/report.h"
#include <nlohmann/json_fwd.hpp>

#include "carom/audio/result.h"

namespace carom::lab {

using namespace scenes;

/// The files that `carom report` writes; docs/report.md describes them.

nlohmann::ordered_json reportJson(std::span<const SceneReport> scenes);

/// Returns the CSV: a row for each variant of each scene, RFC 4180.
std::string reportCsv(std::span<const SceneReport> scenes);

/// Returns the page: all of it in one file, which needs no network.
std::string reportHtml(std::span<const SceneReport> scenes);

/// The names of the files in a folder.
struct ReportFiles {
  std::filesystem::path json;
  std::filesystem::path csv;
  std::filesystem::path html;
};

ReportFiles reportFilesIn(const std::filesystem::path& folder);

/// Returns the name of the page in which a scene of the report is seen and heard, the `index`th:
/// view_NAME.html, or view-NUMBER.html where no file could have the scene's name.
std::string viewName(const std::string& scene, std::size_t index);

/// Refuses a folder in which the files cannot be written, before anything is run. A folder that
/// does not exist needs an existing one above it.
Status checkReportFolder(const std::filesystem::path& folder);

/// Creates the folder if it does not exist.
Status makeReportFolder(const std::filesystem::path& folder);

/// Writes all three files or none; creates the folder if it does not exist.
Status writeReport(std::span<const SceneReport> scenes, const std::filesystem::path& folder);

}  // namespace carom::lab
