// One struck steel bar: its click and its ring in pascals, from the mesh on, beside closed forms of
// both. `--help` describes the arguments.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <vector>

#include "tests/bench/table_program.h"
#include "tests/support/bar_strike.h"

namespace carom::bench {
namespace {

using namespace test;

constexpr char kHelp[] =
    R"(usage: bench_modal_levels [--short]
       ./bench modal_levels [--short]

A round bar of steel, 300 mm long and 8 mm thick, free, hit across its axis 3 mm from its end by a
steel ball of 4 mm radius at 1 m/s, and heard at 1 m from its middle: the ring at several angles to
the axis, in the plane in which it bends; the click at a right angle. Levels in dB re 20 uPa.

  Carom     mesh, analyseSolid, computeRadiation, panelRadiator, Synth at 48 kHz; amplitude of each
            partial at first touch, by least squares on the samples
  line      shapes and frequencies of Timoshenko's bar, Hertz's contact integrated, and a line of
            dipoles of twice the displaced mass, times what is left of an endless cylinder's
  ends      the same line, shorter by a quarter of a radius at each end, where the flow goes around
            it: an added mass that is smaller by half a radius of length for each end

  --short   coarser grid and surface: right to some decibels
)";

constexpr BarDetail kCoarse{.degreesOfFreedom = 4000, .sides = 8, .slices = 16};
constexpr double kNoLoss = 0.0;
// Loss of the dipole at each end, in radii, half of the loss of added mass. Blevins 1979, Formulas
// for Natural Frequency and Mode Shape, table 14-2: across a cylinder 5 times as long as thick the
// added mass is 0.90 of that of the same length of an endless one, and 9 times 0.96: 0.50 and 0.36
// radii are missing at each end.
constexpr double kEndLoss = 0.22;

double decibels(double pascals) {
  return 20.0 * std::log10(pascals / 20e-6);
}

void printRing(const StruckBar& bar, double degrees) {
  const double angle = degrees * std::numbers::pi / 180.0;
  const Vec3 listener(std::cos(angle), std::sin(angle), 0.0);
  const std::vector<Partial> partials = partialsOf(bar, ringOf(bar, listener, 24000));
  std::printf("\nring at %g degrees from the axis\n%4s %10s %10s %8s %8s %8s %8s %8s\n", degrees,
              "mode", "Hz", "closed Hz", "Carom", "line", "diff.", "ends", "diff.");
  for (int number = 1; number <= 5; ++number) {
    // At 90 degrees the modes that are odd along the bar are silent.
    if (degrees == 90.0 && number % 2 == 0) continue;
    const BendingMode mode(bar.bar, number);
    const Partial line = partialOf(bar, mode, listener, kNoLoss);
    const Partial ends = partialOf(bar, mode, listener, kEndLoss);
    const Partial ours = *std::ranges::min_element(partials, {}, [&](const Partial& partial) {
      return std::abs(partial.frequency - line.frequency);
    });
    std::printf("%4d %10.2f %10.2f %8.2f %8.2f %+8.2f %8.2f %+8.2f\n", number, ours.frequency,
                line.frequency, decibels(ours.amplitude), decibels(line.amplitude),
                decibels(ours.amplitude) - decibels(line.amplitude), decibels(ends.amplitude),
                decibels(ours.amplitude) - decibels(ends.amplitude));
  }
  std::fflush(stdout);
}

// Prints levels of bands, each as that of a tone with the same energy in one second.
void printClick(const StruckBar& bar) {
  const Vec3 listener(0.0, 1.0, 0.0);
  const std::vector<double> click = clickOf(bar, listener, 960);
  std::printf("\nclick at 90 degrees, octaves, exposure level\n%10s %8s %8s %8s %8s %8s\n", "Hz",
              "Carom", "line", "diff.", "ends", "diff.");
  for (double centre = 125.0; centre < 12000.0; centre *= 2.0) {
    const double low = centre / std::sqrt(2.0);
    const auto level = [&](double energy) { return decibels(std::sqrt(2.0 * energy)); };
    const double ours = level(bandEnergy(click, low, 2.0 * low));
    const double line = level(bandEnergy(bar, listener, kNoLoss, low, 2.0 * low));
    const double ends = level(bandEnergy(bar, listener, kEndLoss, low, 2.0 * low));
    std::printf("%10g %8.2f %8.2f %+8.2f %8.2f %+8.2f\n", centre, ours, line, ours - line, ends,
                ours - ends);
  }
}

int run(const Scale& scale) {
  const FreeBar bar{.material = *findMaterial("carbon_steel")};
  BallStrike ball{.ball = *findMaterial("carbon_steel")};
  ball.ballRadius = 0.004;
  ball.speed = 1.0;
  const StruckBar struck = struckBar(bar, ball, 0.147, scale.of<BarDetail>({}, kCoarse));
  for (const double degrees : {30.0, 45.0, 60.0, 90.0})
    printRing(struck, degrees);
  printClick(struck);
  return 0;
}

}  // namespace
}  // namespace carom::bench

int main(int argc, char** argv) {
  return carom::bench::TableProgram{"bench_modal_levels", carom::bench::kHelp, carom::bench::run}
      .main(argc, argv);
}
