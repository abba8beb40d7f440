// Accuracy of the modes of thin, curved solids that stand at an angle to the grid. `--help`
// describes the columns.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "modal/analysis/solid_model.h"
#include "tests/bench/cpu_time.h"
#include "tests/support/revolution_modes.h"

namespace carom::bench {

using namespace modal;

namespace {

constexpr char kHelp[] =
    R"(usage: bench_curved_accuracy [--modes] [--short]
       ./bench curved_accuracy [--short] [-- --modes]

The first 20 elastic modes of free ceramic bodies of revolution with thin walls, as analyseSolid
finds them at its defaults, turned at random against the grid, beside spectral elements on the
section with Fourier's series about the axis (tests/support/revolution_modes.h):

  dof        degrees of freedom of the last grid, three for each function
  time       s of CPU, one thread: all grids
  worst      % from the reference, of the 20
  split      %, largest distance of two frequencies that are one pair
  told       %, largest error that the analysis tells
  within     modes whose error is at most what is told, and the mesh's own share of 0.02 %: its
             circles are of 320 sides, its curved outlines of 40 edges, so all is smaller

  --modes    prints every mode
  --short    one body, to 5 %
)";

constexpr std::size_t kModes = 20;
constexpr int kSides = 320;
constexpr double kMeshError = 2e-4;

SurfaceMesh turned(SurfaceMesh mesh, const Eigen::Matrix3d& turn) {
  for (Vec3& vertex : mesh.vertices)
    vertex = (turn * vertex).eval();
  return mesh;
}

// Largest distance between two that the reference has as one.
double splitOf(const std::vector<Mode>& modes, const std::vector<double>& reference) {
  double split = 0.0;
  for (std::size_t mode = 0; mode + 1 < reference.size(); ++mode)
    if (reference[mode + 1] == reference[mode])
      split = std::max(split, modes[mode + 1].frequency / modes[mode].frequency - 1.0);
  return split;
}

bool measure(const test::RevolvedBody& body, bool isShort, bool withModes) {
  const Material& ceramic = *findMaterial("ceramic");
  const std::vector<double> reference = test::revolutionFrequencies(body, ceramic, kModes);
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.7, Vec3(1.0, 2.0, 3.0).normalized()).toRotationMatrix();
  SolidSettings settings;
  if (isShort) settings.accuracy = 0.05;
  const double start = cpuSeconds();
  const Result<SolidAnalysis> analysis = analyseSolid(
      turned(test::revolvedMesh(body, isShort ? kSides / 4 : kSides), turn), ceramic, settings);
  const double seconds = cpuSeconds() - start;
  if (!analysis) {
    std::fprintf(stderr, "%s: %s\n", body.name, analysis.error().message.c_str());
    return false;
  }
  const std::vector<Mode>& modes = analysis->model.modes;
  if (modes.size() < reference.size()) {
    std::fprintf(stderr, "%s: modes are missing\n", body.name);
    return false;
  }
  double worst = 0.0;
  double told = 0.0;
  std::size_t within = 0;
  for (std::size_t mode = 0; mode < reference.size(); ++mode) {
    const double error = std::abs(modes[mode].frequency / reference[mode] - 1.0);
    worst = std::max(worst, error);
    told = std::max(told, modes[mode].frequencyError);
    if (error <= modes[mode].frequencyError + kMeshError) ++within;
    if (withModes)
      std::printf("      %10.2f Hz, reference %10.2f, %+.3f %%, told %.3f %%\n",
                  modes[mode].frequency, reference[mode],
                  100.0 * (modes[mode].frequency / reference[mode] - 1.0),
                  100.0 * modes[mode].frequencyError);
  }
  std::printf("%-6s %8zu %9.2f %8.3f %8.3f %8.3f %4zu of %zu\n", body.name,
              analysis->degreesOfFreedom, seconds, 100.0 * worst, 100.0 * splitOf(modes, reference),
              100.0 * told, within, reference.size());
  std::fflush(stdout);
  return true;
}

int run(bool isShort, bool withModes) {
  std::printf("%-6s %8s %9s %8s %8s %8s %10s\n", "body", "dof", "time, s", "worst, %", "split, %",
              "told, %", "within");
  std::vector<test::RevolvedBody> bodies = test::revolvedBodies();
  if (isShort)
    bodies.assign(1, bodies.back());
  else
    for (test::RevolvedBody& body : test::otherCups())
      bodies.push_back(std::move(body));
  bool isWhole = true;
  for (const test::RevolvedBody& body : bodies)
    isWhole = measure(body, isShort, withModes) && isWhole;
  return isWhole ? 0 : 1;
}

}  // namespace
}  // namespace carom::bench

int main(int argc, char** argv) {
  bool isShort = false;
  bool withModes = false;
  for (int index = 1; index < argc; ++index) {
    const std::string_view argument = argv[index];
    if (argument == "--help") {
      std::fputs(carom::bench::kHelp, stdout);
      return 0;
    }
    isShort = isShort || argument == "--short";
    withModes = withModes || argument == "--modes";
    if (argument != "--short" && argument != "--modes") {
      std::fprintf(stderr, "bench_curved_accuracy: unknown argument %s\n", argv[index]);
      return 2;
    }
  }
  return carom::bench::run(isShort, withModes);
}
