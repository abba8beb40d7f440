#pragma once

#include <functional>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace carom::lab {

/// The extent of a run of the stability cases.
enum class StabilityForm {
  brief,  ///< part of ./check: fewer points and events, and no case that takes long
  full
};

/// A number that a case has measured, and the bounds that it must lie in. NaN never does.
struct Measurement {
  std::string name;  ///< snake_case
  double value = 0.0;
  std::string unit = "1";  ///< SI, or "1"
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();

  bool holds() const { return value >= low && value <= high; }
};

Measurement atMost(std::string name, double value, double high, std::string unit = "1");
Measurement atLeast(std::string name, double value, double low, std::string unit = "1");
/// Expects exactly this value: for counts.
Measurement exactly(std::string name, double value, double expected, std::string unit = "1");
/// Expects a value within a share of the expected one, which is not 0.
Measurement nearly(std::string name, double value, double expected, double share,
                   std::string unit = "1");

/// A stiff or extreme situation, and the outcome that theory predicts.
struct StabilityCase {
  std::string id;           ///< "module.what", unique
  std::string topic;        ///< the kind of extreme: one of stabilityTopics()
  std::string summary;      ///< the procedure, in one sentence
  std::string expectation;  ///< the prediction of theory, with its source
  /// Returns the measurements. A case that throws has failed.
  std::function<std::vector<Measurement>(StabilityForm)> measure;
  StabilityForm least = StabilityForm::brief;  ///< full: too long for the short form

  std::string module() const { return id.substr(0, id.find('.')); }
};

/// Returns the topics that the cases together have to cover.
const std::vector<std::string>& stabilityTopics();

/// Returns all cases, by module.
std::vector<StabilityCase> stabilityCases();

/// Returns the cases of a form whose id contains the parts of `pattern` between its asterisks, in
/// their order: "jello", "native.day", "click*day". An empty pattern selects all.
std::vector<StabilityCase> selectCases(const std::vector<StabilityCase>& cases, StabilityForm form,
                                       std::string_view pattern);

/// The result of a case.
struct StabilityVerdict {
  StabilityCase of;
  std::vector<Measurement> measurements;
  std::string error;    ///< why there are no measurements
  double took = 0.0;    ///< s
  bool passed() const;  ///< true if there are measurements and all hold
};

struct StabilityReport {
  StabilityForm form = StabilityForm::full;
  std::vector<StabilityVerdict> verdicts;
  double took = 0.0;  ///< s

  std::size_t failed() const;
  /// Exit code of the program that has run the cases: 0, or 1 if a case failed.
  int exitCode() const { return failed() > 0 ? 1 : 0; }
};

/// A callback before each case, and after the last one. False ends the run before that case.
using StabilityProgress = std::function<bool(std::string_view id, double share)>;

/// Runs the cases one after the other. A case that throws is
/// a failed verdict, and the others still run.
StabilityReport runStability(const std::vector<StabilityCase>& cases, StabilityForm form,
                             const StabilityProgress& progress = {});

/// Returns a table of the verdicts, with details of failed cases below it.
std::string stabilityText(const StabilityReport& report);
/// Returns the report as JSON; docs/cli.md has the keys.
nlohmann::ordered_json stabilityJson(const StabilityReport& report);

/// Lists the cases with their summaries and expectations; for `carom stability --list`.
std::string stabilityListText(const std::vector<StabilityCase>& cases);
nlohmann::ordered_json stabilityListJson(const std::vector<StabilityCase>& cases);

}  // namespace carom::lab
