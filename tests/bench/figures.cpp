#include "tests/bench/figures.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <string_view>
#include <utility>

#include <benchmark/benchmark.h>

namespace carom::bench {
namespace {

constexpr const char* kValue = "value";  // the counter that carries a measurement

/// Median of the repetitions, by the name of the work.
class MedianReporter : public benchmark::BenchmarkReporter {
 public:
  bool ReportContext(const Context& /*context*/) override { return true; }

  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      if (run.run_type != Run::RT_Iteration) continue;
      // Work that gave up (SkipWithError) is reported without its counters.
      if (const auto value = run.counters.find(kValue); value != run.counters.end())
        values_[run.run_name.function_name].push_back(value->second.value);
      else
        failed_ = true;
    }
  }

  bool failed() const { return failed_; }

  std::optional<double> median(const std::string& name) const {
    const auto entry = values_.find(name);
    if (entry == values_.end()) return std::nullopt;
    std::vector<double> sorted = entry->second;
    std::ranges::sort(sorted);
    const std::size_t middle = sorted.size() / 2;
    return sorted.size() % 2 == 1 ? sorted[middle] : 0.5 * (sorted[middle - 1] + sorted[middle]);
  }

 private:
  std::map<std::string, std::vector<double>> values_;
  bool failed_ = false;
};

struct Row {
  const Figure* figure = nullptr;
  std::optional<double> value = std::nullopt;
  std::optional<double> yardstick = std::nullopt;
  std::optional<double> ratio = std::nullopt;
  std::optional<bool> holds = std::nullopt;

  bool measured() const { return value && (yardstick || !figure->yardstick); }
};

std::string subjectName(const Figure& figure) {
  return figure.name;
}
std::string yardstickName(const Figure& figure) {
  return figure.name + " | yardstick: " + figure.yardstickName;
}

std::optional<double> scaled(std::optional<double> value, double scale) {
  if (value) *value *= scale;
  return value;
}

std::optional<bool> judge(const Row& row) {
  const std::optional<Bar>& bar = row.figure->bar;
  if (!bar) return std::nullopt;
  const std::optional<double> reached = bar->of == Bar::Of::value ? row.value : row.ratio;
  if (!reached) return std::nullopt;
  return row.figure->sense == Sense::higherIsBetter ? *reached >= bar->limit
                                                    : *reached <= bar->limit;
}

Row makeRow(const Figure& figure, const MedianReporter& reporter) {
  Row row{.figure = &figure};
  row.value = scaled(reporter.median(subjectName(figure)), figure.scale);
  if (figure.yardstick)
    row.yardstick = scaled(reporter.median(yardstickName(figure)), figure.scale);
  if (row.value && row.yardstick && *row.yardstick != 0.0) row.ratio = *row.value / *row.yardstick;
  row.holds = judge(row);
  return row;
}

std::string number(std::optional<double> value) {
  if (!value) return "-";
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", *value);
  return text;
}

std::string barText(const Figure& figure) {
  if (!figure.bar) return "-";
  const char* relation = figure.sense == Sense::higherIsBetter ? ">= " : "<= ";
  const bool ratio = figure.bar->of == Bar::Of::ratio;
  return relation + number(figure.bar->limit) + (ratio ? " x" : "");
}

std::string verdict(const Row& row) {
  if (!row.measured()) return "not measured";
  if (!row.holds) return "-";
  return *row.holds ? "holds" : "falls short";
}

std::vector<std::string> cells(const Row& row) {
  const Figure& figure = *row.figure;
  std::string yardstick = "-";
  if (figure.yardstick) yardstick = figure.yardstickName + " " + number(row.yardstick);
  return {figure.name,       number(row.value),
          figure.unit,       yardstick,
          number(row.ratio), barText(figure),
          verdict(row),      figure.error.empty() ? "-" : figure.error};
}

void printTable(const std::vector<Row>& rows) {
  std::vector<std::vector<std::string>> lines = {
      {"figure", "value", "unit", "yardstick (same run)", "ratio", "bar", "verdict", "error"}};
  for (const Row& row : rows)
    lines.push_back(cells(row));
  std::vector<std::size_t> widths(lines.front().size(), 0);
  for (const std::vector<std::string>& line : lines) {
    for (std::size_t column = 0; column < line.size(); ++column)
      widths[column] = std::max(widths[column], line[column].size());
  }
  for (const std::vector<std::string>& line : lines) {
    for (std::size_t column = 0; column < line.size(); ++column)
      std::printf("%-*s  ", static_cast<int>(widths[column]), line[column].c_str());
    std::printf("\n");
  }
}

std::string quoted(std::string_view text) {
  std::string result = "\"";
  for (const char letter : text) {
    if (letter == '"' || letter == '\\') result += '\\';
    if (static_cast<unsigned char>(letter) >= 0x20U) result += letter;
  }
  return result + '"';
}

std::string jsonNumber(std::optional<double> value) {
  if (!value || !std::isfinite(*value)) return "null";
  char text[32];
  std::snprintf(text, sizeof text, "%.9g", *value);
  return text;
}

std::string jsonHolds(std::optional<bool> holds) {
  if (!holds) return "null";
  return *holds ? "true" : "false";
}

std::string jsonBar(const Figure& figure) {
  if (!figure.bar) return R"("bar": null, "bar_of": null)";
  const bool ratio = figure.bar->of == Bar::Of::ratio;
  return "\"bar\": " + jsonNumber(figure.bar->limit) +
         ", \"bar_of\": " + quoted(ratio ? "ratio" : "value");
}

std::string json(const Row& row) {
  const Figure& figure = *row.figure;
  const bool higher = figure.sense == Sense::higherIsBetter;
  std::string text = "{\"name\": " + quoted(figure.name);
  text += ", \"value\": " + jsonNumber(row.value);
  text += ", \"unit\": " + quoted(figure.unit);
  text += ", \"yardstick\": " + (figure.yardstick ? quoted(figure.yardstickName) : "null");
  text += ", \"yardstick_value\": " + jsonNumber(row.yardstick);
  text += ", \"ratio\": " + jsonNumber(row.ratio);
  text += ", " + jsonBar(figure);
  text += ", \"better\": " + quoted(higher ? "higher" : "lower");
  text += ", \"holds\": " + jsonHolds(row.holds);
  text += ", \"error\": " + (figure.error.empty() ? "null" : quoted(figure.error));
  return text + "}";
}

void printJson(const std::vector<Row>& rows) {
  std::printf("{\"figures\": [");
  for (std::size_t row = 0; row < rows.size(); ++row)
    std::printf("%s\n  %s", row == 0 ? "" : ",", json(rows[row]).c_str());
  std::printf("\n]}\n");
}

/// Ours first, so that what the caller passes comes later and wins.
std::vector<std::string> benchmarkArguments(int argc, char** argv, bool& asJson) {
  std::vector<std::string> arguments = {argc > 0 ? argv[0] : "bench",
                                        "--benchmark_enable_random_interleaving=true",
                                        "--benchmark_repetitions=9", "--benchmark_min_time=0.05"};
  for (int index = 1; index < argc; ++index) {
    const std::string_view argument = argv[index];
    if (argument == "--json")
      asJson = true;
    else
      arguments.emplace_back(argument);
  }
  return arguments;
}

bool initialize(std::vector<std::string>& arguments) {
  std::vector<char*> pointers;
  for (std::string& argument : arguments)
    pointers.push_back(argument.data());
  pointers.push_back(nullptr);
  int count = static_cast<int>(arguments.size());
  benchmark::Initialize(&count, pointers.data());
  return !benchmark::ReportUnrecognizedArguments(count, pointers.data());
}

void registerWork(const std::string& name, const Work& work) {
  benchmark::RegisterBenchmark(name.c_str(), work);
}

}  // namespace

void reportRate(benchmark::State& state, double perIteration) {
  state.counters[kValue] =
      benchmark::Counter(perIteration, benchmark::Counter::kIsIterationInvariantRate);
}

void reportTime(benchmark::State& state, double perIteration) {
  state.counters[kValue] = benchmark::Counter(
      perIteration, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

void reportValue(benchmark::State& state, double value) {
  state.counters[kValue] = value;
}

void Figures::add(Figure figure) {
  figures_.push_back(std::move(figure));
}

int Figures::run(int argc, char** argv) {
  bool asJson = false;
  std::vector<std::string> arguments = benchmarkArguments(argc, argv, asJson);
  if (!initialize(arguments)) return 1;
  for (const Figure& figure : figures_) {
    registerWork(subjectName(figure), figure.subject);
    if (figure.yardstick) registerWork(yardstickName(figure), figure.yardstick);
  }
  MedianReporter reporter;
  benchmark::RunSpecifiedBenchmarks(&reporter);
  benchmark::Shutdown();

  std::vector<Row> rows;
  for (const Figure& figure : figures_) {
    // What --benchmark_filter left out has no row; what failed has one without a value.
    if (Row row = makeRow(figure, reporter); row.value || reporter.failed()) rows.push_back(row);
  }
  asJson ? printJson(rows) : printTable(rows);
  return reporter.failed() || rows.empty() ? 1 : 0;
}

}  // namespace carom::bench
