// Cost of modal sound: of the bank of resonators, and of the analysis of a solid, once for each
// body.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>

#include "audio/dsp/resonator_kernels.h"
#include "tests/bench/analysis_cost.h"
#include "tests/bench/cpu_time.h"
#include "tests/bench/figures.h"
#include "tests/bench/fma_peak.h"
#include "tests/bench/machine_yardstick.h"
#include "tests/bench/scale.h"

namespace carom::bench {

using namespace audio;

namespace {

constexpr double kRate = 48000.0;   // Hz
constexpr std::size_t kBlock = 64;  // frames
constexpr double kSilent = 1e-9;    // Pa

/// A bank of modes from 60 Hz to 18 kHz that have been struck.
class Bank {
 public:
  Bank(std::size_t modes, double decayRate) {
    for (std::vector<double>* array : {&a1_, &a2_, &y1_, &y2_, &b0_, &b1_})
      array->resize((modes + kWidth - 1) / kWidth * kWidth);
    for (std::size_t i = 0; i < modes; ++i) {
      const double share = static_cast<double>(i) / static_cast<double>(modes);
      const TwoPole pole =
          TwoPole::of(6.283185307179586 * (60.0 + 17940.0 * share), decayRate, kRate);
      a1_[i] = pole.a1;
      a2_[i] = pole.a2;
      y1_[i] = 1e-3;
      b0_[i] = b1_[i] = 1e-6;
    }
    for (std::size_t n = 0; n < x_.size(); ++n)
      x_[n] = std::sin(0.3 * static_cast<double>(n));
  }

  void ring(const ResonatorKernels& kernels) { kernels.ring(view(), out_); }
  void drive(const ResonatorKernels& kernels) {
    kernels.drive(view(), {b0_.data(), b1_.data(), &x_[1]}, out_);
  }
  void flush(const ResonatorKernels& kernels) { kernels.flush(view(), kSilent); }

  /// The obvious loop, mode by mode, free and driven.
  void ringPlainly() {
    for (std::size_t i = 0; i < a1_.size(); ++i)
      advancePlainly(i, [](double known, std::size_t /*n*/) { return known; });
  }
  void drivePlainly() {
    for (std::size_t i = 0; i < a1_.size(); ++i)
      advancePlainly(i, [&](double known, std::size_t n) {
        return known + (b0_[i] * x_[n + 1] + b1_[i] * x_[n]);
      });
  }

 private:
  static constexpr std::size_t kWidth = ResonatorKernels::kWidth;

  Resonators view() { return {a1_.data(), a2_.data(), y1_.data(), y2_.data(), a1_.size()}; }
  template <class Input>
  void advancePlainly(std::size_t i, Input input) {
    const double a1 = a1_[i];
    const double a2 = a2_[i];
    double y1 = y1_[i];
    double y2 = y2_[i];
    for (std::size_t n = 0; n < out_.size(); ++n) {
      const double y = a1 * y1 + input(a2 * y2, n);
      y2 = y1;
      y1 = y;
      out_[n] += y;
    }
    y1_[i] = y1;
    y2_[i] = y2;
  }

  std::vector<double> a1_, a2_, y1_, y2_, b0_, b1_;
  std::vector<double> x_ = std::vector<double>(kBlock + 1);
  std::vector<double> out_ = std::vector<double>(kBlock);
};

/// A loop in both its forms, the project's and the obvious one.
struct Loop {
  std::string name;
  void (Bank::*ours)(const ResonatorKernels&);
  void (Bank::*plain)();
  double mostSlots;
};

const Loop kRing = {"ring", &Bank::ring, &Bank::ringPlainly, 4.0};
const Loop kDrive = {"drive", &Bank::drive, &Bank::drivePlainly, 5.3};

constexpr double kForever = 1e-6;  // 1/s, so slow that nothing decays

/// The rate of a work that is measured in several parts.
class Rate {
 public:
  template <class Work>
  void measure(double atLeast, Work work) {
    const double start = cpuSeconds();
    double end = start;
    for (; end - start < atLeast; end = cpuSeconds())
      done_ += work();
    seconds_ += end - start;
  }
  double perSecond() const { return done_ / seconds_; }

 private:
  double done_ = 0.0;
  double seconds_ = 0.0;
};

/// Multiply-adds that the machine could do in the time of one mode and sample; the two are measured
/// in turns.
double laneSlots(const Loop& loop, const ResonatorKernels& kernels, const FmaPeak& peak,
                 std::size_t modes) {
  Bank bank(modes, kForever);
  const auto render = [&] {
    const std::size_t blocks = std::max<std::size_t>(1, 10000 / modes);
    for (std::size_t block = 0; block < blocks; ++block)
      (bank.*loop.ours)(kernels);
    return static_cast<double>(blocks * modes * kBlock);
  };
  render();
  Rate possible;
  Rate reached;
  for (int turn = 0; turn < 10; ++turn) {
    possible.measure(1e-3, peak.work);
    reached.measure(2e-3, render);
  }
  return possible.perSecond() / reached.perSecond();
}

std::string modesText(std::size_t modes) {
  return (modes < 1000 ? "" : std::to_string(modes / 1000) + ",") +
         (modes < 1000 ? std::to_string(modes) : std::to_string(1000 + modes % 1000).substr(1)) +
         " modes";
}

void addRate(Figures& figures, const Loop& loop, std::size_t modes) {
  const auto perBlock = static_cast<double>(modes * kBlock);
  figures.add({.name = loop.name + ", " + modesText(modes),
               .unit = "G mode-samples/s",
               .subject =
                   [=](benchmark::State& state) {
                     Bank bank(modes, kForever);
                     for ([[maybe_unused]] const auto iteration : state)
                       (bank.*loop.ours)(fastestResonators());
                     reportRate(state, perBlock);
                   },
               .yardstickName = "scalar loop",
               .yardstick =
                   [=](benchmark::State& state) {
                     Bank bank(modes, kForever);
                     for ([[maybe_unused]] const auto iteration : state)
                       (bank.*loop.plain)();
                     reportRate(state, perBlock);
                   },
               .bar = Bar{Bar::Of::ratio, 10.0},
               .scale = 1e-9});
}

void addSlots(Figures& figures, const Loop& loop, const ResonatorKernels& kernels,
              const FmaPeak& peak, std::size_t modes) {
  // The machine's peak is measured along with it, so that the bar suffices as a yardstick.
  figures.add(
      besideItsBar({.name = loop.name + ", " + modesText(modes) + ", " + std::string(kernels.name),
                    .unit = "FMA lane-slots per mode-sample",
                    .subject =
                        [=](benchmark::State& state) {
                          double slots = 0.0;
                          for ([[maybe_unused]] const auto iteration : state)
                            slots = laneSlots(loop, kernels, peak, modes);
                          reportValue(state, slots);
                        },
                    .bar = Bar{Bar::Of::value, loop.mostSlots},
                    .sense = Sense::lowerIsBetter}));
}

void addPeak(Figures& figures, const FmaPeak& peak) {
  figures.add({.name = "FMA peak, " + std::string(peak.name),
               .unit = "G lanes/s",
               .subject =
                   [=](benchmark::State& state) {
                     double done = 0.0;
                     for ([[maybe_unused]] const auto iteration : state)
                       done = peak.work();
                     reportRate(state, done);
                   },
               .yardstickName = kMachine,
               .yardstick = machineRate(1e9),
               .scale = 1e-9});
}

constexpr std::size_t kSizes[] = {64, 256, 1024, 10000, 100000};

/// Adds the fastest kernels in all sizes, the others in one.
void addKernels(Figures& figures) {
  for (const Loop& loop : {kRing, kDrive})
    for (const std::size_t modes : kSizes)
      addRate(figures, loop, modes);
  for (const FmaPeak& peak : fmaPeaks())
    addPeak(figures, peak);
  for (const Loop& loop : {kRing, kDrive}) {
    for (const ResonatorKernels& kernels : allResonators()) {
      const auto peak = std::ranges::find(fmaPeaks(), kernels.name, &FmaPeak::name);
      if (peak == fmaPeaks().end()) continue;
      const bool fastest = kernels.name == fastestResonators().name;
      for (const std::size_t modes : kSizes)
        if (fastest || modes == 1024) addSlots(figures, loop, kernels, *peak, modes);
    }
  }
}

/// Renders block after block and flushes the modes that have died away.
Work ringing(std::size_t modes, double decayRate, double warmUp, double perBlock) {
  return [=](benchmark::State& state) {
    Bank bank(modes, decayRate);
    const ResonatorKernels& kernels = fastestResonators();
    const auto render = [&] {
      bank.ring(kernels);
      bank.flush(kernels);
    };
    for (double time = 0.0; time < warmUp; time += static_cast<double>(kBlock) / kRate)
      render();
    for ([[maybe_unused]] const auto iteration : state)
      render();
    perBlock > 0.0 ? reportRate(state, perBlock)
                   : reportTime(state, static_cast<double>(kBlock) / kRate);
  };
}

void addRinging(Figures& figures) {
  figures.add({.name = "10,000 modes at 48 kHz, flushed",
               .unit = "% of one core",
               .subject = ringing(10000, kForever, 0.0, 0.0),
               .yardstickName = "scalar loop",
               .yardstick =
                   [](benchmark::State& state) {
                     Bank bank(10000, kForever);
                     for ([[maybe_unused]] const auto iteration : state)
                       bank.ringPlainly();
                     reportTime(state, static_cast<double>(kBlock) / kRate);
                   },
               .bar = Bar{Bar::Of::value, 20.0},
               .sense = Sense::lowerIsBetter,
               .scale = 100.0});
  const double perBlock = 1024.0 * static_cast<double>(kBlock);
  // Without flushing, the values would be denormal numbers after 1 s.
  figures.add({.name = "tail of 1,024 modes, flushed",
               .unit = "G mode-samples/s",
               .subject = ringing(1024, 1000.0, 1.0, perBlock),
               .yardstickName = "in full swing",
               .yardstick = ringing(1024, kForever, 0.0, perBlock),
               .bar = Bar{Bar::Of::ratio, 0.9},
               .scale = 1e-9});
}

/// A measurement that runs once, however often the figures are repeated.
class OnceMeasured {
 public:
  explicit OnceMeasured(std::function<WorkCost()> work) : work_(std::move(work)) {}

  void report(benchmark::State& state, double WorkCost::*what) {
    if (!cost_) cost_ = work_();
    for ([[maybe_unused]] const auto iteration : state) {
    }
    if (std::isfinite(cost_->seconds))
      reportValue(state, (*cost_).*what);
    else
      state.SkipWithError("the analysis failed");
  }

 private:
  std::function<WorkCost()> work_;
  std::optional<WorkCost> cost_;
};

void addAnalysis(Figures& figures, const std::string& name, std::function<WorkCost()> work,
                 double mostSeconds) {
  const auto measured = std::make_shared<OnceMeasured>(std::move(work));
  figures.add({.name = name,
               .unit = "s",
               .subject = [=](benchmark::State& s) { measured->report(s, &WorkCost::seconds); },
               .yardstickName = kMachine,
               .yardstick = machineTime(),
               .bar = Bar{Bar::Of::value, mostSeconds},
               .sense = Sense::lowerIsBetter});
  figures.add(besideItsBar(
      {.name = name + ", memory of the process",
       .unit = "MB",
       .subject = [=](benchmark::State& s) { measured->report(s, &WorkCost::megabytes); },
       .sense = Sense::lowerIsBetter}));
}

/// Adds the analyses; the figures keep their names when --short makes the solids smaller.
void addAnalyses(Figures& figures, const Scale& scale) {
  const auto analysis = [](double accuracy) {
    return [accuracy] { return cubeAnalysis(accuracy); };
  };
  addAnalysis(figures, "60 modes of a cube within 1 %", analysis(scale.of<double>(0.01, 0.1)), 8.0);
  addAnalysis(figures, "60 modes of a cube within 0.1 %", analysis(scale.of<double>(0.001, 0.05)),
              40.0);
  addAnalysis(
      figures, "radiation of these 60 modes",
      [panels = scale.of<std::size_t>(800, 120)] { return cubeRadiation(panels); }, 60.0);
}

}  // namespace
}  // namespace carom::bench

int main(int argc, char** argv) {
  using namespace carom::bench;
  Figures figures;
  addKernels(figures);
  addRinging(figures);
  addAnalyses(figures, scaleOf(argc, argv));
  return figures.run(argc, argv);
}
