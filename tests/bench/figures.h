#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace benchmark {
class State;
}

namespace carom::bench {

/// A body of work for Google Benchmark: loops over the state, and ends in `reportRate` or
/// `reportTime`.
using Work = std::function<void(benchmark::State&)>;

/// Reports so many things done per iteration: the value is their number per second of CPU time.
void reportRate(benchmark::State& state, double perIteration);
/// Reports so many things done per iteration: the value is the CPU time of one, in seconds.
void reportTime(benchmark::State& state, double perIteration);
/// Reports a value that is not a time, such as an error or a size; the last iteration's counts.
void reportValue(benchmark::State& state, double value);

enum class Sense { higherIsBetter, lowerIsBetter };

/// What a figure must reach, in its own unit or as a multiple of its yardstick.
struct Bar {
  enum class Of { value, ratio };
  Of of = Of::value;
  double limit = 0.0;
};

struct Figure {
  std::string name = {};
  std::string unit = {};
  Work subject = {};                          ///< measures ours
  std::string yardstickName = {};             ///< what it is compared with
  Work yardstick = {};                        ///< measured in the same run, interleaved
  std::optional<double> fixedYardstick = {};  ///< shown unit; in its place, for what is no time
  std::optional<Bar> bar = std::nullopt;      ///< none: the figure is only shown
  Sense sense = Sense::higherIsBetter;
  std::string error = {};  ///< the accuracy that was bought, with its unit; may be empty
  double scale = 1.0;      ///< shown value = measured value * scale, e.g. 1e-6 for millions
  double noise = 0.0;      ///< shown unit: two runs that differ by less are held to be the same
};

/// A size or a count has no peer that is measured: its yardstick is its bar, or one of its unit.
Figure besideItsBar(Figure figure);

/// The figures of one benchmark program: its own and its yardsticks' work run interleaved in random
/// order, repeatedly, by Google Benchmark; shown are medians and quartiles, one row per figure, or
/// with `--json` one object {"short": ..., "figures": [...]}. With `--short` there are fewer and
/// shorter repetitions. All other arguments go to Google Benchmark.
///
/// A ratio is ours over the yardstick's, whatever the sense; its spread is that of the repetitions'
/// own ratios. A bar that is not reached is reported, not an error: `run` returns 1 only where a
/// figure could not be measured, or there is none.
/// A figure that --benchmark_filter leaves out is left out of the result too.
class Figures {
 public:
  /// Every figure has a yardstick, measured or fixed.
  void add(Figure figure);
  int run(int argc, char** argv);

 private:
  std::vector<Figure> figures_;
};

}  // namespace carom::bench
