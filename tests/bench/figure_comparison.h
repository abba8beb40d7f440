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

/// A figure as `./bench --json` has printed it.
struct StoredFigure {
  std::string benchmark;
  std::string name;
  std::string unit;
  std::optional<StoredNumber> value;  ///< none: it was not measured
  std::optional<StoredNumber> ratio;
  bool higherIsBetter = true;
  double noise = 0.0;  ///< of the value: it is the same if it differs by less
};

struct StoredRun {
  std::optional<bool> isShort;          ///< none: no benchmark gave a result
  std::vector<std::string> benchmarks;  ///< that were asked for, with a result or without
  std::vector<StoredFigure> figures;
};

/// Reads what `./bench --json` has printed; `name` is the file's, for the error.
/// Errors: no JSON, another document, short and full runs in one.
Result<StoredRun> parseRun(const std::string& text, const std::string& name);
/// Errors: those of parseRun, and a file that cannot be read.
Result<StoredRun> readRun(const std::string& path);

enum class FigureVerdict { better, same, worse, onlyThen, onlyNow };
const char* nameOf(FigureVerdict verdict);

/// A figure then and now. `gain` is how many times as good it is now, by the ratio to the yardstick
/// where both have one: below 1 is worse, whichever way the figure counts. It is 0 where nothing
/// has become something that should not be, and infinite where it was so.
struct ComparedFigure {
  std::optional<StoredFigure> then;
  std::optional<StoredFigure> now;
  FigureVerdict verdict = FigureVerdict::same;
  double gain = 1.0;

  const StoredFigure& any() const { return now ? *now : *then; }
  /// Worse, and by more than this factor.
  bool isBelow(double factor) const { return verdict == FigureVerdict::worse && gain < factor; }
};

/// The figures of `now` in their order, then those that only `then` has. Benchmarks that nobody
/// asked for now are left out. A figure is the same if low to high of both runs overlap, or if it
/// differs by less than its noise, or by less than 5 % (in short runs: than half as much again).
///
/// Errors: one of the runs is short and the other is not.
Result<std::vector<ComparedFigure>> compareRuns(const StoredRun& then, const StoredRun& now);

/// Those that are below the factor in every one of the runs that have them.
std::vector<ComparedFigure> failing(const std::vector<std::vector<ComparedFigure>>& runs,
                                    double factor);

}  // namespace carom::bench
