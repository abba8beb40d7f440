// One strike, twice: by direct integration of the masses and springs, and by their modes. Prints
// the difference of the two sounds and the cost of each. `--help` describes the arguments.

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <vector>

#include "tests/audio/meshes.h"
#include "tests/bench/table_program.h"
#include "tests/support/struck_model.h"

namespace carom::bench {
namespace {

using namespace test;

constexpr char kHelp[] =
    R"(usage: bench_modal_waveform [--short]
       ./bench modal_waveform [--short]

Bodies of polycarbonate, hit by a steel ball of 10 mm radius at 0.1 m/s, in a contact of half a
millisecond. The same matrices are integrated in time with the force of Hertz's contact
(trapezoidal rule, sparse factorisation) and taken to modes, which Synth renders as monopoles; both
at 48 kHz through the same low-pass of 18 kHz, heard at 1 m, over 100 ms from the first touch on.

  whole      dB, rms of the difference over rms of the reference, over the 100 ms
  ring       dB, the same without the first 2 ms that are heard, the attack
  time       s, of the integration; of the modes: of their analysis, and of schedule and render

The reference is the limit of the two smallest steps, whose error goes with the step's square. The
rows of the steps show that it does: 12 dB for half a step.

  --short    20 ms, two steps each, and coarser meshes
)";

/// The extent of the computation.
struct Effort {
  std::size_t frames = 5300;    // to 100 ms after the strike is heard
  int subdivisions = 3;         // subdivisions of the shells
  std::size_t maxModes = 1000;  // most modes of a shell
  std::size_t steps = 100;      // at most so many, the largest
};
constexpr Effort kShort{.frames = 1460, .subdivisions = 2, .maxModes = 200, .steps = 2};

constexpr std::size_t kAttack = 428;  // 2 ms after the strike is heard

double seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::vector<double> behindTheAttack(const std::vector<double>& samples) {
  return {samples.begin() + kAttack, samples.end()};
}

void printRow(const char* method, const std::vector<double>& samples,
              const std::vector<double>& reference, double time) {
  std::printf("  %-34s %8.1f %8.1f %10.3g\n", method, differenceInDecibels(samples, reference),
              differenceInDecibels(behindTheAttack(samples), behindTheAttack(reference)), time);
  std::fflush(stdout);
}

void compare(const char* name, const StruckModel& body, std::vector<double> steps,
             const Effort& effort) {
  steps.resize(std::min(steps.size(), effort.steps));
  std::vector<std::vector<double>> sounds;
  std::vector<double> times;
  for (const double step : steps) {
    const double start = seconds();
    sounds.push_back(directSound(body, step, effort.frames));
    times.push_back(seconds() - start);
  }
  const std::vector<double> reference = limitOf(sounds[sounds.size() - 2], sounds.back());
  const ModesLeftOut& left = body.model->leftOut;
  std::printf(
      "\n%s: %td degrees of freedom, %zu modes sound; %u rigid, %u above 20 kHz, %u "
      "overdamped; rms %.3g Pa\n  %-34s %8s %8s %10s\n",
      name, body.direct.push.size(), body.model->modes.size(), left.rigid, left.above,
      left.overdamped, rms(reference), "", "whole", "ring", "time");
  for (std::size_t index = 0; index < steps.size(); ++index) {
    char method[64];
    std::snprintf(method, sizeof method, "integrated, steps of %g us", 1e6 * steps[index]);
    printRow(method, sounds[index], reference, times[index]);
  }
  const double start = seconds();
  const std::vector<double> modal = modalSound(body, effort.frames);
  printRow("modes", modal, reference, seconds() - start);
  std::printf("  %-34s %8s %8s %10.3g\n", "their analysis, once", "", "", body.analysisTime);
  std::fflush(stdout);
}

int run(const Scale& scale) {
  const Effort effort = scale.of(Effort(), kShort);
  const Material material = *findMaterial("polycarbonate");
  const SurfaceMesh surface = ellipsoidMesh({0.4, 0.32, 0.26}, effort.subdivisions);
  ShellSettings shell{.thickness = 4e-3};
  shell.maxModes = effort.maxModes;
  compare("shell, transverse springs", struckShell(surface, material, shell, {1, 2, 3}),
          {16e-6, 8e-6, 4e-6, 2e-6, 1e-6, 0.5e-6}, effort);
  shell.springs = ShellSprings::axial;
  compare("shell, axial springs", struckShell(surface, material, shell, {1, 2, 3}),
          {16e-6, 8e-6, 4e-6, 2e-6, 1e-6}, effort);
  compare("solid",
          struckBox({0.3, 0.15, 0.05}, material, scale.of<std::size_t>(2000, 400), {1, 2, 30}),
          {8e-6, 4e-6, 2e-6, 1e-6}, effort);
  return 0;
}

}  // namespace
}  // namespace carom::bench

int main(int argc, char** argv) {
  return carom::bench::TableProgram{"bench_modal_waveform", carom::bench::kHelp, carom::bench::run}
      .main(argc, argv);
}
