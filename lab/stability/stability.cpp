#include "lab/stability/stability.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <iomanip>
#include <sstream>
#include <utility>

#include "lab/stability/stability_cases.h"
#include <nlohmann/json.hpp>

#include "scenes/run/stopwatch.h"

namespace carom::lab {

using namespace scenes;
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::string numberText(double number) {
  std::ostringstream text;
  text << std::setprecision(4) << number;
  return text.str();
}

std::string unitText(const Measurement& measurement) {
  return measurement.unit == "1" ? std::string() : ' ' + measurement.unit;
}

std::string boundText(const Measurement& measurement) {
  const auto& [name, value, unit, low, high] = measurement;
  std::string text;
  if (low == high) {
    std::ostringstream exact;
    exact << std::setprecision(10) << low;
    text = exact.str();
  } else if (low == -kInfinity) {
    text = "<= " + numberText(high);
  } else if (high == kInfinity) {
    text = ">= " + numberText(low);
  } else {
    text = numberText(0.5 * (low + high)) + " +- " + numberText(0.5 * (high - low));
  }
  return text + unitText(measurement);
}

std::string valueText(const Measurement& measurement) {
  std::ostringstream text;
  text << std::setprecision(measurement.low == measurement.high ? 10 : 4) << measurement.value
       << unitText(measurement);
  return text.str();
}

std::string secondsText(double seconds) {
  std::ostringstream text;
  text << std::fixed << std::setprecision(2) << seconds << " s";
  return text.str();
}

/// Writes a row of the table: the measurement, its expected
/// value, its measured value, and the verdict.
void writeRow(std::ostream& text, const std::string& what, const std::string& expected,
              const std::string& measured, const std::string& verdict) {
  text << std::left << std::setw(34) << what << ' ' << std::setw(22) << expected << ' '
       << std::setw(18) << measured << ' ' << verdict << '\n';
}

void writeVerdict(std::ostream& text, const StabilityVerdict& verdict) {
  writeRow(text, verdict.of.id, "", secondsText(verdict.took),
           verdict.passed() ? "passed" : "FAILED");
  for (const Measurement& measurement : verdict.measurements)
    writeRow(text, "  " + measurement.name, boundText(measurement), valueText(measurement),
             measurement.holds() ? "" : "FAILED");
}

void writeFailure(std::ostream& text, const StabilityVerdict& verdict) {
  text << '\n' << verdict.of.id << " failed: " << verdict.of.summary << '\n';
  text << "  expected: " << verdict.of.expectation << '\n';
  if (!verdict.error.empty()) text << "  error: " << verdict.error << '\n';
}

/// Returns the number, or null for infinity and NaN, which JSON does not have.
nlohmann::ordered_json finiteOrNull(double value) {
  if (std::isfinite(value)) return value;
  return nullptr;
}

nlohmann::ordered_json jsonOf(const Measurement& measurement) {
  nlohmann::ordered_json object;
  object["name"] = measurement.name;
  object["value"] = finiteOrNull(measurement.value);
  object["unit"] = measurement.unit;
  object["low"] = finiteOrNull(measurement.low);
  object["high"] = finiteOrNull(measurement.high);
  object["passed"] = measurement.holds();
  return object;
}

nlohmann::ordered_json jsonOf(const StabilityCase& item) {
  nlohmann::ordered_json object;
  object["case"] = item.id;
  object["module"] = item.module();
  object["topic"] = item.topic;
  object["summary"] = item.summary;
  object["expected"] = item.expectation;
  object["short"] = item.least == StabilityForm::brief;
  return object;
}

nlohmann::ordered_json jsonOf(const StabilityVerdict& verdict) {
  nlohmann::ordered_json object = jsonOf(verdict.of);
  object["passed"] = verdict.passed();
  object["took_s"] = verdict.took;
  if (!verdict.error.empty()) object["error"] = verdict.error;
  object["measurements"] = nlohmann::ordered_json::array();
  for (const Measurement& measurement : verdict.measurements)
    object["measurements"].push_back(jsonOf(measurement));
  return object;
}

StabilityVerdict verdictOf(const StabilityCase& item, StabilityForm form) {
  StabilityVerdict verdict;
  verdict.of = item;
  const Stopwatch stopwatch;
  try {
    verdict.measurements = item.measure(form);
    if (verdict.measurements.empty()) verdict.error = "it measured nothing";
  } catch (const std::exception& error) {
    verdict.error = error.what();
  } catch (...) {
    verdict.error = "it threw something unknown";
  }
  verdict.took = stopwatch.seconds();
  return verdict;
}

bool matches(std::string_view id, std::string_view pattern) {
  std::size_t at = 0;
  while (!pattern.empty()) {
    const std::size_t end = std::min(pattern.find('*'), pattern.size());
    const std::size_t found = id.find(pattern.substr(0, end), at);
    if (found == std::string_view::npos) return false;
    at = found + end;
    pattern.remove_prefix(std::min(end + 1, pattern.size()));
  }
  return true;
}

}  // namespace

Measurement atMost(std::string name, double value, double high, std::string unit) {
  return {.name = std::move(name), .value = value, .unit = std::move(unit), .high = high};
}

Measurement atLeast(std::string name, double value, double low, std::string unit) {
  return {.name = std::move(name), .value = value, .unit = std::move(unit), .low = low};
}

Measurement exactly(std::string name, double value, double expected, std::string unit) {
  return {.name = std::move(name),
          .value = value,
          .unit = std::move(unit),
          .low = expected,
          .high = expected};
}

Measurement nearly(std::string name, double value, double expected, double share,
                   std::string unit) {
  const double tolerance = std::abs(expected) * share;
  return {.name = std::move(name),
          .value = value,
          .unit = std::move(unit),
          .low = expected - tolerance,
          .high = expected + tolerance};
}

bool StabilityVerdict::passed() const {
  return error.empty() && !measurements.empty() &&
         std::ranges::all_of(measurements, &Measurement::holds);
}

std::size_t StabilityReport::failed() const {
  return static_cast<std::size_t>(std::ranges::count(verdicts, false, &StabilityVerdict::passed));
}

const std::vector<std::string>& stabilityTopics() {
  static const std::vector<std::string> topics = {"stiffness",
                                                  "mass ratio",
                                                  "radius",
                                                  "speed",
                                                  "restitution",
                                                  "grazing",
                                                  "simultaneous contacts",
                                                  "stacks and piles",
                                                  "sample rate",
                                                  "distance",
                                                  "jello steps",
                                                  "modes",
                                                  "rooms",
                                                  "heads",
                                                  "moving listeners",
                                                  "limits of runs",
                                                  "24 hours",
                                                  "nonsense"};
  return topics;
}

std::vector<StabilityCase> stabilityCases() {
  std::vector<StabilityCase> cases;
  addNativeCases(cases);
  addBulletCases(cases);
  addSoundCases(cases);
  addModalCases(cases);
  addContactCases(cases);
  addJelloCases(cases);
  addCrossedCases(cases);
  addRunCases(cases);
  return cases;
}

std::vector<StabilityCase> selectCases(const std::vector<StabilityCase>& cases, StabilityForm form,
                                       std::string_view pattern) {
  std::vector<StabilityCase> selected;
  std::ranges::copy_if(cases, std::back_inserter(selected), [&](const StabilityCase& item) {
    const bool runs = form == StabilityForm::full || item.least == StabilityForm::brief;
    return runs && matches(item.id, pattern);
  });
  return selected;
}

StabilityReport runStability(const std::vector<StabilityCase>& cases, StabilityForm form,
                             const StabilityProgress& progress) {
  StabilityReport report;
  report.form = form;
  report.verdicts.reserve(cases.size());
  const Stopwatch stopwatch;
  for (const StabilityCase& item : cases) {
    const auto done = static_cast<double>(report.verdicts.size());
    if (progress && !progress(item.id, done / static_cast<double>(cases.size()))) return report;
    report.verdicts.push_back(verdictOf(item, form));
  }
  if (progress) progress("", 1.0);
  report.took = stopwatch.seconds();
  return report;
}

std::string stabilityText(const StabilityReport& report) {
  std::ostringstream text;
  writeRow(text, "case", "expected", "measured", "verdict");
  for (const StabilityVerdict& verdict : report.verdicts)
    writeVerdict(text, verdict);
  for (const StabilityVerdict& verdict : report.verdicts)
    if (!verdict.passed()) writeFailure(text, verdict);
  text << '\n'
       << report.verdicts.size() - report.failed() << " passed, " << report.failed()
       << " failed, in " << secondsText(report.took) << '\n';
  return text.str();
}

nlohmann::ordered_json stabilityJson(const StabilityReport& report) {
  nlohmann::ordered_json object;
  object["form"] = report.form == StabilityForm::brief ? "short" : "full";
  object["passed"] = report.verdicts.size() - report.failed();
  object["failed"] = report.failed();
  object["took_s"] = report.took;
  object["cases"] = nlohmann::ordered_json::array();
  for (const StabilityVerdict& verdict : report.verdicts)
    object["cases"].push_back(jsonOf(verdict));
  return object;
}

std::string stabilityListText(const std::vector<StabilityCase>& cases) {
  std::ostringstream text;
  for (const StabilityCase& item : cases) {
    text << item.id << (item.least == StabilityForm::full ? " (full form only)" : "") << '\n';
    text << "  " << item.summary << '\n';
    text << "  expected: " << item.expectation << '\n';
  }
  return text.str();
}

nlohmann::ordered_json stabilityListJson(const std::vector<StabilityCase>& cases) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const StabilityCase& item : cases)
    list.push_back(jsonOf(item));
  nlohmann::ordered_json object;
  object["cases"] = std::move(list);
  return object;
}

}  // namespace carom::lab
