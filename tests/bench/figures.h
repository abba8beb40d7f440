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
/// Reports so many things done per iteration: the value is the CPU time per thing, in seconds.
void reportTime(benchmark::State& state, double perIteration);
/// Reports a value that is not a time, such as an error or a size; the last iteration's is shown.
void reportValue(benchmark::State& state, double value);

enum class Sense { higherIsBetter, lowerIsBetter };

/// The limit that a figure must reach, in its own unit or as a multiple of its yardstick.
struct Bar {
  enum class Of { value, ratio };
  Of of = Of::value;
  double limit = 0.0;
};

struct Figure {
  std::string name = {};
  std::string unit = {};
  Work subject = {};                          ///< measures the project's own code
  std::string yardstickName = {};             ///< the peer that it is compared with
  Work yardstick = {};                        ///< measured in the same run, interleaved
  std::optional<double> fixedYardstick = {};  ///< replaces `yardstick`; in the shown unit
  std::optional<Bar> bar = std::nullopt;      ///< none: the figure is only shown
  Sense sense = Sense::higherIsBetter;
  std::string error = {};  ///< accuracy that was bought, with its unit; may be empty
  double scale = 1.0;      ///< shown value = measured value * scale, e.g. 1e-6 for millions
  double noise = 0.0;      ///< in the shown unit: two runs that differ by less count as the same
};

/// Returns the figure with a fixed yardstick: its bar, or one of its unit, since a size or a count
/// has no peer that can be measured.
Figure besideItsBar(Figure figure);

/// The figures of one benchmark program: their work and their yardsticks' run interleaved in random
/// order, repeatedly, by Google Benchmark; shown are medians and quartiles, one row per figure, or
/// with `--json` one object {"short": ..., "figures": [...]}. With `--short` there are fewer and
/// shorter repetitions. All other arguments go to Google Benchmark.
///
/// A ratio is the project's value over the yardstick's, whatever the sense; its spread is that of
/// the repetitions' own ratios. A bar that is not reached is reported, not an error: `run` returns
/// 1 only if a figure could not be measured, or if there is none. A figure that --benchmark_filter
/// leaves out is left out of the result too.
class Figures {
 public:
  /// Adds a figure, which must have a yardstick, measured or fixed.
  void add(Figure figure);
  int run(int argc, char** argv);

 private:
  std::vector<Figure> figures_;
};

}  // namespace carom::bench
