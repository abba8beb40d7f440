// Compares a run of the benchmarks with an earlier one; `--help` describes the arguments.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "tests/bench/figure_comparison.h"

namespace carom::bench {
namespace {

constexpr char kHelp[] =
    R"(usage: bench_compare THEN.json NOW.json [AGAIN.json] [--fail-below FACTOR]

Compares what ./bench --json has printed, figure by figure. `change` is that of the ratio to the
yardstick, or of the value where a ratio is missing; `+-` is half of what lies between low and high,
then and now, in percent of the median.

  better, worse   the figure has changed by more than its noise, and by more than 5 % (of short runs,
                  by more than half as much again), and low to high of the two do not overlap
  same            anything else
  only then, only now   it was not measured in the other run

  --fail-below FACTOR   the exit status is 3 if some figure is worse than FACTOR times what it was.
                        With AGAIN.json only figures count that are so in both later runs. The
                        names of their benchmarks are the only lines on the standard output that
                        begin with "fails: "
)";

std::string number(const std::optional<StoredNumber>& number) {
  if (!number) return "-";
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", number->median);
  return text;
}

std::string spread(const std::optional<StoredNumber>& number) {
  if (!number || number->median == 0.0) return "-";
  char text[32];
  std::snprintf(text, sizeof text, "%.1f",
                50.0 * std::abs((number->high - number->low) / number->median));
  return text;
}

/// Returns the figure that is compared: its ratio to the yardstick where both runs have one.
std::optional<StoredNumber> shown(const ComparedFigure& figure,
                                  const std::optional<StoredFigure>& side) {
  if (!side) return std::nullopt;
  const bool byRatio = figure.then && figure.now && figure.then->ratio && figure.now->ratio;
  return byRatio ? side->ratio : side->value;
}

std::string changeOf(const ComparedFigure& figure) {
  const std::optional<StoredNumber> then = shown(figure, figure.then);
  const std::optional<StoredNumber> now = shown(figure, figure.now);
  if (!then || !now || then->median == 0.0) return "-";
  char text[32];
  std::snprintf(text, sizeof text, "%+.1f %%",
                100.0 * (now->median - then->median) / std::abs(then->median));
  return text;
}

std::vector<std::string> cells(const ComparedFigure& figure) {
  const auto value = [](const std::optional<StoredFigure>& side) {
    return number(side ? side->value : std::nullopt);
  };
  const auto ratio = [](const std::optional<StoredFigure>& side) {
    return number(side ? side->ratio : std::nullopt);
  };
  return {figure.any().benchmark,
          figure.any().name,
          figure.any().unit,
          value(figure.then),
          value(figure.now),
          ratio(figure.then),
          ratio(figure.now),
          changeOf(figure),
          spread(shown(figure, figure.then)) + ", " + spread(shown(figure, figure.now)) + " %",
          nameOf(figure.verdict)};
}

void printTable(const std::vector<ComparedFigure>& figures) {
  std::vector<std::vector<std::string>> lines = {{"benchmark", "figure", "unit", "then", "now",
                                                  "ratio then", "now", "change", "+-", "verdict"}};
  for (const ComparedFigure& figure : figures)
    lines.push_back(cells(figure));
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

void printFailing(const std::vector<ComparedFigure>& figures, double factor) {
  std::set<std::string> benchmarks;
  for (const ComparedFigure& figure : figures) {
    std::printf("below %g of what it was: %s, %s: %.3g\n", factor, figure.any().benchmark.c_str(),
                figure.any().name.c_str(), figure.gain);
    benchmarks.insert(figure.any().benchmark);
  }
  for (const std::string& benchmark : benchmarks)
    std::printf("fails: %s\n", benchmark.c_str());
}

struct Arguments {
  std::vector<std::string> files;
  std::optional<double> factor;
};

/// Returns the arguments, or none if they are not understood.
std::optional<Arguments> parse(int argc, char** argv) {
  Arguments arguments;
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    if (argument == "--fail-below" && i + 1 < argc) {
      char* end = nullptr;
      arguments.factor = std::strtod(argv[++i], &end);
      if (*end != '\0' || !(*arguments.factor > 0.0 && *arguments.factor <= 1.0)) {
        std::fprintf(stderr, "bench_compare: --fail-below %s: above 0 and at most 1 is wanted\n",
                     argv[i]);
        return std::nullopt;
      }
    } else if (argument.starts_with("--")) {
      std::fprintf(stderr, "bench_compare: what is '%s'?\n\n%s", argv[i], kHelp);
      return std::nullopt;
    } else {
      arguments.files.emplace_back(argument);
    }
  }
  if (arguments.files.size() == 2 || arguments.files.size() == 3) return arguments;
  std::fputs(kHelp, stderr);
  return std::nullopt;
}

int compare(const Arguments& arguments) {
  std::vector<StoredRun> runs;
  for (const std::string& file : arguments.files) {
    Result<StoredRun> run = readRun(file);
    if (!run) {
      std::fprintf(stderr, "bench_compare: %s\n", run.error().message.c_str());
      return 2;
    }
    runs.push_back(*std::move(run));
  }
  std::vector<std::vector<ComparedFigure>> later;
  for (std::size_t run = 1; run < runs.size(); ++run) {
    Result<std::vector<ComparedFigure>> figures = compareRuns(runs.front(), runs[run]);
    if (!figures) {
      std::fprintf(stderr, "bench_compare: %s and %s: %s\n", arguments.files.front().c_str(),
                   arguments.files[run].c_str(), figures.error().message.c_str());
      return 2;
    }
    later.push_back(*std::move(figures));
    printTable(later.back());
  }
  if (!arguments.factor) return 0;
  const std::vector<ComparedFigure> fallen = failing(later, *arguments.factor);
  printFailing(fallen, *arguments.factor);
  return fallen.empty() ? 0 : 3;
}

}  // namespace
}  // namespace carom::bench

int main(int argc, char** argv) {
  using namespace carom::bench;
  if (argc == 2 && argv[1] == std::string_view("--help")) {
    std::fputs(kHelp, stdout);
    return 0;
  }
  const std::optional<Arguments> arguments = parse(argc, argv);
  return arguments ? compare(*arguments) : 2;
}
