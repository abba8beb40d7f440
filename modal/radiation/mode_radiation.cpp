#include "modal/radiation/mode_radiation.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "audio/radiation/multipole.h"
#include "modal/mesh/triangle_points.h"
#include "modal/radiation/exterior_solver.h"
#include "modal/radiation/parallel_tasks.h"
#include "modal/radiation/radiating_panels.h"
#include "modal/radiation/surface_waves.h"

namespace carom::modal {

using namespace audio;

namespace {

using Complex = std::complex<double>;

constexpr std::size_t kLeastPanels = 100;
constexpr double kPanelsPerWavelength = 6.0;
// Share of the mean square that panels keep of a wave as long as six of them: 1 - (2 pi / 6)^2 /
// 24, the second moment of an equilateral triangle being side^2 / 24.
constexpr double kResolved = 0.954;
constexpr double kNegligible = 1e-4;  // relative to the mean square pressure
constexpr int kOrdersBeyond = 8;      // orders computed above k times the enclosing radius
constexpr int kMostOrders = 64;
constexpr std::size_t kMostMemory = 1'000'000'000;  // bytes, of all solutions at a time

double powerOf(std::span<const Complex> multipoles) {
  double sum = 0.0;
  for (const Complex& multipole : multipoles)
    sum += std::norm(multipole);
  return sum;
}

// Returns the least order that leaves out no more than a negligible part at this k r.
int orderThatMatters(const std::vector<Complex>& multipoles, double kr) {
  std::vector<double> shares;
  double whole = 0.0;
  RadialFunctions radial(kr);
  for (std::size_t l = 0; l * l < multipoles.size(); ++l, radial.next()) {
    const auto ofDegree = std::span(multipoles).subspan(l * l, 2 * l + 1);
    shares.push_back(std::norm(radial.value()) * powerOf(ofDegree));
    whole += shares.back();
  }
  double left = 0.0;
  std::size_t order = shares.size() - 1;
  while (order > 0 && left + shares[order] <= kNegligible * whole)
    left += shares[order--];
  return static_cast<int>(order);
}

// Drops the orders that do not matter, and those above `maxOrder`; true if that cut orders that
// matter.
bool shorten(std::vector<Complex>& multipoles, double kr, int maxOrder) {
  const int order = orderThatMatters(multipoles, kr);
  const bool cut = order > maxOrder;
  const double whole = powerOf(multipoles);
  multipoles.resize(harmonicCount(std::min(order, maxOrder)));
  const double kept = powerOf(multipoles);
  if (cut && kept > 0.0)
    for (Complex& multipole : multipoles)
      multipole *= std::sqrt(whole / kept);
  return cut;
}

Status check(const ModalModel& model, const RadiationSettings& settings) {
  if (const Status valid = validate(model); !valid) return Error{"model: " + valid.error().message};
  if (settings.panels < kLeastPanels)
    return Error{"radiation: panels is " + std::to_string(settings.panels) +
                 "; expected at least " + std::to_string(kLeastPanels)};
  if (settings.maxOrder < 0 || settings.maxOrder > kHighestMultipole)
    return Error{"radiation: the highest order is " + std::to_string(settings.maxOrder) +
                 "; expected 0 to " + std::to_string(kHighestMultipole)};
  return std::monostate{};
}

// Returns how many modes are solved at a time: no more than there is memory for.
std::size_t threadsOf(const RadiationSettings& settings, std::size_t panels) {
  const std::size_t wanted = settings.threads == 0 ? processorCount() : settings.threads;
  return std::clamp<std::size_t>(kMostMemory / ExteriorSolver::memoryOf(panels), 1, wanted);
}

// Side (m) of an equilateral triangle as large as the panels in the mean.
double panelSize(const SurfaceMesh& surface) {
  const double mean = surfaceArea(surface) / static_cast<double>(surface.triangles.size());
  return std::sqrt(4.0 / std::numbers::sqrt3 * mean);
}

// The radiation of a mode, and whether it is all of it.
struct FoundRadiation {
  ModeRadiation radiation;
  bool isCut = false;
  bool isRough = false;
};

// Computes the radiation of one model's modes. [any thread], several at a time
class Radiation {
 public:
  Radiation(const ModalModel& model, const RadiatingPanels& panels)
      : model_(model),
        panels_(panels),
        solver_(panels.surface),
        radius_(enclosingRadius(panels.surface, model.centreOfMass)) {}

  FoundRadiation compute(std::size_t mode, int maxOrder, double goodUpTo) const {
    FoundRadiation found;
    ModeRadiation& radiation = found.radiation;
    const double frequency = model_.modes[mode].frequency;
    const double waveNumber = 2.0 * std::numbers::pi * frequency / model_.medium.speedOfSound;
    const Eigen::VectorXd shape = shapeOf(mode);
    const Eigen::VectorXd normal = panels_.normalShape * shape;
    const Eigen::VectorXcd pressure =
        solver_.solve(waveNumber, (-model_.medium.density * normal).cast<Complex>());
    for (Eigen::Index panel = 0; panel < normal.size(); ++panel)
      radiation.volume += solver_.panels()[static_cast<std::size_t>(panel)].area() * normal[panel];
    radiation.multipoles = multipoles(waveNumber, normal, pressure);
    found.isCut = shorten(radiation.multipoles, 2.0 * waveNumber * radius_, maxOrder);
    found.isRough = frequency > goodUpTo || resolvedShare(panels_, shape) < kResolved;
    return found;
  }

 private:
  Eigen::VectorXd shapeOf(std::size_t mode) const {
    const std::size_t length = 3 * model_.surface.vertices.size();
    return Eigen::Map<const Eigen::VectorXf>(&model_.shapes[mode * length],
                                             static_cast<Eigen::Index>(length))
        .cast<double>();
  }

  std::vector<Complex> multipoles(double waveNumber, const Eigen::VectorXd& normal,
                                  const Eigen::VectorXcd& pressure) const {
    const int order =
        std::min(static_cast<int>(std::ceil(waveNumber * radius_)) + kOrdersBeyond, kMostOrders);
    SurfaceWaves waves(waveNumber, order, 1e-9 * radius_);
    std::vector<Complex> sums(harmonicCount(order), 0.0);
    for (std::size_t panel = 0; panel < solver_.panels().size(); ++panel) {
      const auto row = static_cast<Eigen::Index>(panel);
      const double third = solver_.panels()[panel].area() / 3.0;
      const Complex dipoles = third * pressure[row];
      const double source = third * model_.medium.density * normal[row];
      for (const Vec3& node : ExteriorSolver::nodesOf(cornersOf(panels_.surface, panel))) {
        const std::span<const Slope> here =
            waves.at(node - model_.centreOfMass, solver_.panels()[panel].normal());
        for (std::size_t index = 0; index < sums.size(); ++index)
          sums[index] += dipoles * here[index].slope + source * here[index].value;
      }
    }
    SurfaceWaves::turnPhases(sums);
    return sums;
  }

  const ModalModel& model_;
  const RadiatingPanels& panels_;
  ExteriorSolver solver_;
  double radius_;
};

}  // namespace

void findVolumes(ModalModel& model) {
  for (std::size_t mode = 0; mode < model.modes.size(); ++mode) {
    double volume = 0.0;
    for (const auto& [a, b, c] : model.surface.triangles) {
      const std::vector<Vec3>& at = model.surface.vertices;
      const Vec3 moved = model.shape(mode, a) + model.shape(mode, b) + model.shape(mode, c);
      volume += (at[b] - at[a]).cross(at[c] - at[a]).dot(moved) / 6.0;
    }
    model.modes[mode].radiation.volume = volume;
  }
}

Result<RadiationReport> computeRadiation(ModalModel& model, const RadiationSettings& settings,
                                         const Progress& progress) {
  if (const Status status = check(model, settings); !status) return status.error();
  const Result<RadiatingPanels> panels = radiatingPanels(model, settings.panels);
  if (!panels) return panels.error();
  RadiationReport report;
  report.panels = panels->surface.triangles.size();
  report.thickness = panels->thickness;
  report.goodUpTo = model.medium.speedOfSound / (kPanelsPerWavelength * panelSize(panels->surface));
  const Radiation radiation(model, *panels);
  std::vector<FoundRadiation> found(model.modes.size());
  const auto solve = [&](std::size_t mode) {
    found[mode] = radiation.compute(mode, settings.maxOrder, report.goodUpTo);
  };
  const auto goesOn = [&](std::size_t begun) {
    const double done = static_cast<double>(begun) / static_cast<double>(found.size());
    return !progress || progress("radiation", done);
  };
  if (!runTasks(found.size(), threadsOf(settings, report.panels), solve, goesOn))
    return Error{kCancelled};
  for (std::size_t mode = 0; mode < found.size(); ++mode) {
    model.modes[mode].decayRate -= model.modes[mode].radiation.decayRate;
    model.modes[mode].radiation = std::move(found[mode].radiation);
    report.cutModes += found[mode].isCut ? 1U : 0U;
    report.roughModes += found[mode].isRough ? 1U : 0U;
  }
  return report;
}

double radiatedDecay(const Mode& mode, const Medium& medium) {
  const double omega = 2.0 * std::numbers::pi * mode.frequency;
  return omega * omega * powerOf(mode.radiation.multipoles) /
         (2.0 * medium.density * medium.speedOfSound);
}

void addRadiationDamping(ModalModel& model) {
  for (Mode& mode : model.modes) {
    const double most = std::numbers::pi * mode.frequency;
    const double radiated = radiatedDecay(mode, model.medium);
    mode.radiation.decayRate = std::clamp(most - mode.decayRate, 0.0, radiated);
    mode.decayRate += mode.radiation.decayRate;
  }
}

}  // namespace carom::modal
