#include "tests/bench/analysis_cost.h"

#include <cstdio>
#include <fstream>
#include <limits>
#include <string>

#include <malloc.h>

#include "modal/analysis/solid_model.h"
#include "modal/mesh/mesh_detail.h"
#include "modal/radiation/mode_radiation.h"
#include "tests/audio/meshes.h"
#include "tests/bench/cpu_time.h"

namespace carom::bench {

using namespace modal;

namespace {

constexpr Eigen::Index kModes = 60;

// Resets the peak of the process's memory, in Linux's way; see proc(5).
void forgetPeak() {
  malloc_trim(0);
  std::ofstream("/proc/self/clear_refs") << 5;
}

double peakMegabytes() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with("VmHWM:")) return std::stod(line.substr(6)) / 1024.0;
  return 0.0;
}

// Cost of `work`, which returns true if it succeeded.
template <class Work>
WorkCost costOf(Work work) {
  forgetPeak();
  const double start = cpuSeconds();
  if (!work()) return {std::numeric_limits<double>::infinity(), 0.0};
  return {cpuSeconds() - start, peakMegabytes()};
}

// A plastic so soft that 60 modes of the cube are below 20 kHz.
Material plastic() {
  Material material;
  material.name = "plastic";
  material.density = 1200.0;
  material.youngsModulus = 2.5e9;
  material.poissonsRatio = 0.35;
  return material;
}

Result<SolidAnalysis> analysedCube(double accuracy) {
  const Result<SurfaceMesh> surface = subdividedTo(boxMesh({0.05, 0.05, 0.05}), 1000);
  if (!surface) return surface.error();
  SolidSettings settings;
  settings.accuracy = accuracy;
  settings.maxModes = kModes;
  return analyseSolid(*surface, plastic(), settings);
}

bool isWhole(const Result<SolidAnalysis>& analysis) {
  return analysis && analysis->counted && analysis->model.modes.size() == std::size_t{kModes};
}

}  // namespace

WorkCost cubeAnalysis(double accuracy) {
  return costOf([=] {
    const Result<SolidAnalysis> analysis = analysedCube(accuracy);
    return isWhole(analysis) && analysis->reachedAccuracy;
  });
}

WorkCost cubeRadiation(std::size_t panels) {
  Result<SolidAnalysis> analysis = analysedCube(0.05);
  if (!isWhole(analysis)) return {std::numeric_limits<double>::infinity(), 0.0};
  return costOf(
      [&] { return static_cast<bool>(computeRadiation((*analysis).model, {.panels = panels})); });
}

}  // namespace carom::bench
