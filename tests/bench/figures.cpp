#include "tests/bench/figures.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>

#include "tests/bench/scale.h"

namespace carom::bench {
namespace {

constexpr const char* kValue = "value";  // the counter that carries a measurement

/// Spread of the repetitions: low and high are quartiles, or the extremes of less than five.
struct Spread {
  double low = 0.0;
  double median = 0.0;
  double high = 0.0;
};

std::optional<Spread> spreadOf(std::vector<double> values) {
  if (values.empty()) return std::nullopt;
  std::ranges::sort(values);
  const std::size_t middle = values.size() / 2;
  const std::size_t quarter = (values.size() - 1) / 4;
  const double median =
      values.size() % 2 == 1 ? values[middle] : 0.5 * (values[middle - 1] + values[middle]);
  return Spread{values[quarter], median, values[values.size() - 1 - quarter]};
}

/// Keeps the values of the repetitions, by the name of the work.
class ValueReporter : public benchmark::BenchmarkReporter {
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

  std::vector<double> values(const std::string& name, double scale) const {
    std::vector<double> scaled;
    if (const auto entry = values_.find(name); entry != values_.end()) scaled = entry->second;
    for (double& value : scaled)
      value *= scale;
    return scaled;
  }

 private:
  std::map<std::string, std::vector<double>> values_;
  bool failed_ = false;
};

struct Row {
  const Figure* figure = nullptr;
  std::optional<Spread> value = std::nullopt;
  std::optional<Spread> yardstick = std::nullopt;
  std::optional<Spread> ratio = std::nullopt;
  std::optional<bool> holds = std::nullopt;

  bool measured() const { return value && yardstick; }
};

std::string subjectName(const Figure& figure) {
  return figure.name;
}
std::string yardstickName(const Figure& figure) {
  return figure.name + " | yardstick: " + figure.yardstickName;
}

std::optional<bool> judge(const Row& row) {
  const std::optional<Bar>& bar = row.figure->bar;
  if (!bar) return std::nullopt;
  const std::optional<Spread> reached = bar->of == Bar::Of::value ? row.value : row.ratio;
  if (!reached) return std::nullopt;
  return row.figure->sense == Sense::higherIsBetter ? reached->median >= bar->limit
                                                    : reached->median <= bar->limit;
}

/// The ratio is the median over the yardstick's, as shown; its spread is that of the repetitions'
/// own ratios.
std::optional<Spread> ratioOf(const std::vector<double>& values,
                              const std::vector<double>& yardsticks) {
  const std::optional<Spread> value = spreadOf(values);
  const std::optional<Spread> yardstick = spreadOf(yardsticks);
  if (!value || !yardstick || yardstick->median == 0.0) return std::nullopt;
  std::vector<double> ratios;
  for (std::size_t i = 0; i < std::min(values.size(), yardsticks.size()); ++i)
    if (yardsticks[i] != 0.0) ratios.push_back(values[i] / yardsticks[i]);
  const double ratio = value->median / yardstick->median;
  const Spread spread = spreadOf(std::move(ratios)).value_or(Spread{ratio, ratio, ratio});
  return Spread{std::min(spread.low, ratio), ratio, std::max(spread.high, ratio)};
}

Row makeRow(const Figure& figure, const ValueReporter& reporter) {
  const std::vector<double> values = reporter.values(subjectName(figure), figure.scale);
  std::vector<double> yardsticks(values.size(), figure.fixedYardstick.value_or(0.0));
  if (figure.yardstick) yardsticks = reporter.values(yardstickName(figure), figure.scale);
  Row row{.figure = &figure,
          .value = spreadOf(values),
          .yardstick = spreadOf(yardsticks),
          .ratio = ratioOf(values, yardsticks)};
  row.holds = judge(row);
  return row;
}

std::optional<double> medianOf(const std::optional<Spread>& spread) {
  return spread ? std::optional(spread->median) : std::nullopt;
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

/// Half of the range from low to high, in percent of the median.
std::string spreadText(const std::optional<Spread>& spread) {
  if (!spread || spread->median == 0.0) return "-";
  char text[32];
  std::snprintf(text, sizeof text, "%.1f %%",
                50.0 * std::abs((spread->high - spread->low) / spread->median));
  return text;
}

std::vector<std::string> cells(const Row& row) {
  const Figure& figure = *row.figure;
  return {figure.name,
          number(medianOf(row.value)),
          spreadText(row.value),
          figure.unit,
          figure.yardstickName + " " + number(medianOf(row.yardstick)),
          number(medianOf(row.ratio)),
          spreadText(row.ratio),
          barText(figure),
          verdict(row),
          figure.error.empty() ? "-" : figure.error};
}

void printTable(const std::vector<Row>& rows) {
  std::vector<std::vector<std::string>> lines = {{"figure", "value", "+-", "unit",
                                                  "yardstick (same run)", "ratio", "+-", "bar",
                                                  "verdict", "error"}};
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

std::string jsonSpread(const std::string& key, const std::optional<Spread>& spread) {
  const std::optional<double> low = spread ? std::optional(spread->low) : std::nullopt;
  const std::optional<double> high = spread ? std::optional(spread->high) : std::nullopt;
  return "\"" + key + "\": " + jsonNumber(medianOf(spread)) + ", \"" + key +
         "_low\": " + jsonNumber(low) + ", \"" + key + "_high\": " + jsonNumber(high);
}

std::string json(const Row& row) {
  const Figure& figure = *row.figure;
  const bool higher = figure.sense == Sense::higherIsBetter;
  std::string text = "{\"name\": " + quoted(figure.name);
  text += ", " + jsonSpread("value", row.value);
  text += ", \"unit\": " + quoted(figure.unit);
  text += ", \"yardstick\": " + quoted(figure.yardstickName);
  text += ", " + jsonSpread("yardstick_value", row.yardstick);
  text += ", " + jsonSpread("ratio", row.ratio);
  text += ", \"noise\": " + jsonNumber(figure.noise);
  text += ", " + jsonBar(figure);
  text += ", \"better\": " + quoted(higher ? "higher" : "lower");
  text += ", \"holds\": " + jsonHolds(row.holds);
  text += ", \"error\": " + (figure.error.empty() ? "null" : quoted(figure.error));
  return text + "}";
}

void printJson(const std::vector<Row>& rows, bool isShort) {
  std::printf("{\"short\": %s, \"figures\": [", isShort ? "true" : "false");
  for (std::size_t row = 0; row < rows.size(); ++row)
    std::printf("%s\n  %s", row == 0 ? "" : ",", json(rows[row]).c_str());
  std::printf("\n]}\n");
}

struct Options {
  bool asJson = false;
  bool isShort = false;
  std::vector<std::string> arguments;  // for Google Benchmark; the first is the program's name
};

/// The program's own arguments come first, so that the caller's, which come later, win.
Options parse(int argc, char** argv) {
  Options options{
      .isShort = scaleOf(argc, argv).isShort,
      .arguments = {argc > 0 ? argv[0] : "bench", "--benchmark_enable_random_interleaving=true"}};
  options.arguments.emplace_back(options.isShort ? "--benchmark_repetitions=2"
                                                 : "--benchmark_repetitions=9");
  options.arguments.emplace_back(options.isShort ? "--benchmark_min_time=0.02"
                                                 : "--benchmark_min_time=0.05");
  for (int index = 1; index < argc; ++index) {
    const std::string_view argument = argv[index];
    if (argument == "--json") options.asJson = true;
    if (argument != "--json" && argument != "--short") options.arguments.emplace_back(argument);
  }
  return options;
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

Figure besideItsBar(Figure figure) {
  const bool hasBar = figure.bar && figure.bar->of == Bar::Of::value && figure.bar->limit != 0.0;
  figure.fixedYardstick = hasBar ? figure.bar->limit : 1.0;
  figure.yardstickName = hasBar ? "its bar" : "one";
  return figure;
}

void Figures::add(Figure figure) {
  if (!figure.yardstick && !figure.fixedYardstick) {
    std::fprintf(stderr, "the figure '%s' has no yardstick\n", figure.name.c_str());
    std::abort();
  }
  figures_.push_back(std::move(figure));
}

int Figures::run(int argc, char** argv) {
  Options options = parse(argc, argv);
  if (!initialize(options.arguments)) return 1;
  for (const Figure& figure : figures_) {
    registerWork(subjectName(figure), figure.subject);
    if (figure.yardstick) registerWork(yardstickName(figure), figure.yardstick);
  }
  ValueReporter reporter;
  benchmark::RunSpecifiedBenchmarks(&reporter);
  benchmark::Shutdown();

  std::vector<Row> rows;
  for (const Figure& figure : figures_) {
    // A figure that --benchmark_filter left out has no row; one that failed has a row without a
    // value.
    if (Row row = makeRow(figure, reporter); row.value || reporter.failed()) rows.push_back(row);
  }
  options.asJson ? printJson(rows, options.isShort) : printTable(rows);
  return reporter.failed() || rows.empty() ? 1 : 0;
}

}  // namespace carom::bench
