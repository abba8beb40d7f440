#pragma once

#include <functional>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace carom::scenes {

/// How much of it is run.
enum class StabilityForm {
  brief,  ///< part of ./check: fewer points and events, and no case that takes long
  full
};

/// A number that a case has found, and what it has to lie between. NaN lies nowhere.
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
/// That value and no other: of what is counted.
Measurement exactly(std::string name, double value, double expected, std::string unit = "1");
/// Within a share of what is expected, which is not 0.
Measurement nearly(std::string name, double value, double expected, double share,
                   std::string unit = "1");

/// A stiff or extreme situation, and what theory says of it.
struct StabilityCase {
  std::string id;           ///< "module.what", unique
  std::string topic;        ///< which of the extremes it is about: one of stabilityTopics()
  std::string summary;      ///< what is done, in one sentence
  std::string expectation;  ///< what theory says, and whose it is
  /// What is found. A case that throws has failed.
  std::function<std::vector<Measurement>(StabilityForm)> measure;
  StabilityForm least = StabilityForm::brief;  ///< full: it takes too long for the short form

  std::string module() const { return id.substr(0, id.find('.')); }
};

/// What the cases have to cover.
const std::vector<std::string>& stabilityTopics();

/// All of them, by module.
std::vector<StabilityCase> stabilityCases();

/// Those of a form whose id holds the parts of `pattern` between its asterisks, in their order:
/// "jello", "native.day", "click*day". Empty: all.
std::vector<StabilityCase> selectCases(const std::vector<StabilityCase>& cases, StabilityForm form,
                                       std::string_view pattern);

/// What came of a case.
struct StabilityVerdict {
  StabilityCase of;
  std::vector<Measurement> measurements;
  std::string error;    ///< why there are none
  double took = 0.0;    ///< s
  bool passed() const;  ///< it measured something, all of which holds
};

struct StabilityReport {
  StabilityForm form = StabilityForm::full;
  std::vector<StabilityVerdict> verdicts;
  double took = 0.0;  ///< s

  std::size_t failed() const;
  /// Of the program that has run it: 0, or 1 if a case failed.
  int exitCode() const { return failed() > 0 ? 1 : 0; }
};

/// Told before each case, and after the last.
using StabilityProgress = std::function<void(std::string_view id, double share)>;

/// Runs them one after the other. A case that throws is a failed verdict, and the others run.
StabilityReport runStability(const std::vector<StabilityCase>& cases, StabilityForm form,
                             const StabilityProgress& progress = {});

/// A table, and what failed below it.
std::string stabilityText(const StabilityReport& report);
/// Keys: docs/cli.md.
nlohmann::ordered_json stabilityJson(const StabilityReport& report);

/// Ids and what they are about; for `carom stability --list`.
std::string stabilityListText(const std::vector<StabilityCase>& cases);
nlohmann::ordered_json stabilityListJson(const std::vector<StabilityCase>& cases);

}  // namespace carom::scenes
