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
  Work subject = {};                      ///< measures ours
  std::string yardstickName = {};         ///< what it is compared with; may be empty
  Work yardstick = {};                    ///< measured in the same run, interleaved; may be empty
  std::optional<Bar> bar = std::nullopt;  ///< none: the figure is only shown
  Sense sense = Sense::higherIsBetter;
  std::string error = {};  ///< the accuracy that was bought, with its unit; may be empty
  double scale = 1.0;      ///< shown value = measured value * scale, e.g. 1e-6 for millions
};

/// The figures of one benchmark program: its own and its yardsticks' work run interleaved in random
/// order, repeatedly, by Google Benchmark; shown are medians, one row per figure, or with `--json`
/// one object {"figures": [...]}. All other arguments go to Google Benchmark.
///
/// A ratio is ours over the yardstick's, whatever the sense. A bar that is not reached is reported,
/// not an error: `run` returns 1 only where a figure could not be measured, or there is none.
/// A figure that --benchmark_filter leaves out is left out of the result too.
class Figures {
 public:
  void add(Figure figure);
  int run(int argc, char** argv);

 private:
  std::vector<Figure> figures_;
};

}  // namespace carom::bench
