#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "carom/audio/result.h"

namespace carom::bench {

/// One of the two numbers that a figure consists of: the value, or its ratio to the yardstick.
struct StoredNumber {
  double median = 0.0;
  double low = 0.0;
  double high = 0.0;
};

/// A figure as printed by `./bench --json`.
struct StoredFigure {
  std::string benchmark;
  std::string name;
  std::string unit;
  std::optional<StoredNumber> value;  ///< none: the figure was not measured
  std::optional<StoredNumber> ratio;
  bool higherIsBetter = true;
  double noise = 0.0;  ///< the value counts as the same if it differs by less
};

struct StoredRun {
  std::optional<bool> isShort;          ///< none: no benchmark gave a result
  std::vector<std::string> benchmarks;  ///< the benchmarks that were run, with a result or without
  std::vector<StoredFigure> figures;
};

/// Reads the output of `./bench --json`; `name` is the file's, for the error.
/// Errors: no JSON, another document, short and full runs in one.
Result<StoredRun> parseRun(const std::string& text, const std::string& name);
/// Errors: those of parseRun, and a file that cannot be read.
Result<StoredRun> readRun(const std::string& path);

enum class FigureVerdict { better, same, worse, onlyThen, onlyNow };
const char* nameOf(FigureVerdict verdict);

/// A figure then and now. `gain` is the factor by which it is better now, by the ratio to the
/// yardstick where both have one: below 1 is worse, whichever way the figure counts. It is 0 if the
/// old value was the ideal one, zero, and the new one is not, and infinite in the opposite case.
struct ComparedFigure {
  std::optional<StoredFigure> then;
  std::optional<StoredFigure> now;
  FigureVerdict verdict = FigureVerdict::same;
  double gain = 1.0;

  const StoredFigure& any() const { return now ? *now : *then; }
  /// True if the figure is worse, and by more than this factor.
  bool isBelow(double factor) const { return verdict == FigureVerdict::worse && gain < factor; }
};

/// The figures of `now` in their order, then those that only `then` has. Benchmarks that were not
/// run now are left out. A figure is the same if low to high of both runs overlap, if it differs by
/// less than its noise, or if it differs by less than 5 % (in short runs by less than 50 %).
///
/// Errors: one of the runs is short and the other is not.
Result<std::vector<ComparedFigure>> compareRuns(const StoredRun& then, const StoredRun& now);

/// Returns the figures that are below the factor in every run that has them.
std::vector<ComparedFigure> failing(const std::vector<std::vector<ComparedFigure>>& runs,
                                    double factor);

}  // namespace carom::bench
