#include "modal/radiation/mode_radiation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "audio/radiation/multipole.h"
#include "modal/mesh/triangle_points.h"
#include "modal/radiation/exterior_solver.h"
#include "modal/radiation/radiating_panels.h"

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

// A number and its derivative in one direction.
struct Slope {
  double value = 0.0;
  double slope = 0.0;
  Slope() = default;
  explicit Slope(double number) : value(number) {}
  Slope(double number, double change) : value(number), slope(change) {}
};
Slope operator+(const Slope& a, const Slope& b) {
  return {a.value + b.value, a.slope + b.slope};
}
Slope operator-(const Slope& a, const Slope& b) {
  return {a.value - b.value, a.slope - b.slope};
}
Slope operator*(const Slope& a, const Slope& b) {
  return {a.value * b.value, a.slope * b.value + a.value * b.slope};
}
Slope operator*(double a, const Slope& b) {
  return {a * b.value, a * b.slope};
}

// Returns j_0 to j_order at z >= 0, by the recurrence downwards from where they vanish (Miller).
std::vector<double> sphericalBessels(int order, double z) {
  std::vector<double> values(static_cast<std::size_t>(order) + 1, 0.0);
  values[0] = 1.0;
  if (z < 1e-12) return values;
  const int start =
      std::max(order, static_cast<int>(z)) + 20 + static_cast<int>(std::sqrt(40.0 * (order + z)));
  double above = 0.0;
  double here = 1e-280;
  double first = 0.0;
  for (int l = start; l >= 0; --l) {
    if (l <= order) values[static_cast<std::size_t>(l)] = here;
    first = l == 1 ? here : first;
    if (l > 0) above = std::exchange(here, (2.0 * l + 1.0) / z * here - above);
    if (std::abs(here) > 1e200) {
      for (double& value : values)
        value *= 1e-300;
      above *= 1e-300;
      here *= 1e-300;
      first *= 1e-300;
    }
  }
  const double j0 = std::sin(z) / z;
  const double j1 = (j0 - std::cos(z)) / z;
  const double scale = std::abs(j0) > std::abs(j1) ? j0 / here : j1 / first;
  for (double& value : values)
    value *= scale;
  return values;
}

// Sums the contributions of points of the surface: each a share times j_l Y_lm and its derivative
// along `normal`.
class Expansion {
 public:
  Expansion(double waveNumber, int order, double smallest)
      : waveNumber_(waveNumber),
        order_(order),
        smallest_(smallest),
        harmonics_(harmonicCount(order)),
        sums_(harmonicCount(order), 0.0) {}

  // Adds a point `at` (m, from the centre); `pressure` multiplies the derivative, `source` the
  // function.
  void add(const Vec3& at, const Vec3& normal, const Complex& pressure, double source) {
    const double distance = std::max(at.norm(), smallest_);
    const Vec3 unit = at / distance;
    const double outward = unit.dot(normal);
    const Vec3 turn = (normal - outward * unit) / distance;
    sphericalHarmonics<Slope>({unit.x(), turn.x()}, {unit.y(), turn.y()}, {unit.z(), turn.z()},
                              order_, harmonics_);
    const double z = waveNumber_ * distance;
    const std::vector<double> bessel = sphericalBessels(order_ + 1, z);
    std::size_t index = 0;
    for (int l = 0; l <= order_; ++l) {
      const auto degree = static_cast<std::size_t>(l);
      const Slope radial(bessel[degree],
                         waveNumber_ * outward * (l / z * bessel[degree] - bessel[degree + 1]));
      for (int m = -l; m <= l; ++m, ++index) {
        const Slope wave = radial * harmonics_[index];
        sums_[index] += pressure * wave.slope + source * wave.value;
      }
    }
  }

  std::vector<Complex> multipoles() const {
    std::vector<Complex> result = sums_;
    const std::array<Complex, 4> powers = {Complex(1, 0), {0, 1}, {-1, 0}, {0, -1}};
    std::size_t index = 0;
    for (std::size_t l = 0; index < result.size(); ++l)
      for (std::size_t m = 0; m <= 2 * l; ++m)
        result[index++] *= powers[l % 4];
    return result;
  }

 private:
  double waveNumber_;
  int order_;
  double smallest_;
  std::vector<Slope> harmonics_;
  std::vector<Complex> sums_;
};

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

// Side (m) of an equilateral triangle as large as the panels in the mean.
double panelSize(const SurfaceMesh& surface) {
  const double mean = surfaceArea(surface) / static_cast<double>(surface.triangles.size());
  return std::sqrt(4.0 / std::numbers::sqrt3 * mean);
}

// Computes the radiation of one model's modes, one after the other.
class Radiation {
 public:
  Radiation(const ModalModel& model, const RadiatingPanels& panels)
      : model_(model),
        panels_(panels),
        solver_(panels.surface),
        radius_(enclosingRadius(panels.surface, model.centreOfMass)) {}

  // Fills in the radiation of a mode, and counts it in the report if it is cut or rough.
  void compute(std::size_t mode, int maxOrder, ModeRadiation& radiation,
               RadiationReport& report) const {
    const double frequency = model_.modes[mode].frequency;
    const double waveNumber = 2.0 * std::numbers::pi * frequency / model_.medium.speedOfSound;
    const Eigen::VectorXd shape = shapeOf(mode);
    const Eigen::VectorXd normal = panels_.normalShape * shape;
    const Eigen::VectorXcd pressure =
        solver_.solve(waveNumber, (-model_.medium.density * normal).cast<Complex>());
    for (Eigen::Index panel = 0; panel < normal.size(); ++panel)
      radiation.volume += solver_.panels()[static_cast<std::size_t>(panel)].area() * normal[panel];
    radiation.multipoles = multipoles(waveNumber, normal, pressure);
    if (shorten(radiation.multipoles, 2.0 * waveNumber * radius_, maxOrder)) ++report.cutModes;
    if (frequency > report.goodUpTo || resolvedShare(panels_, shape) < kResolved)
      ++report.roughModes;
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
    Expansion expansion(waveNumber, order, 1e-9 * radius_);
    for (std::size_t panel = 0; panel < solver_.panels().size(); ++panel) {
      const auto row = static_cast<Eigen::Index>(panel);
      const double third = solver_.panels()[panel].area() / 3.0;
      for (const Vec3& node : ExteriorSolver::nodesOf(cornersOf(panels_.surface, panel)))
        expansion.add(node - model_.centreOfMass, solver_.panels()[panel].normal(),
                      third * pressure[row], third * model_.medium.density * normal[row]);
    }
    return expansion.multipoles();
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
  std::vector<ModeRadiation> found(model.modes.size());
  for (std::size_t mode = 0; mode < found.size(); ++mode) {
    const double done = static_cast<double>(mode) / static_cast<double>(found.size());
    if (progress && !progress("radiation", done)) return Error{kCancelled};
    radiation.compute(mode, settings.maxOrder, found[mode], report);
  }
  for (std::size_t mode = 0; mode < found.size(); ++mode) {
    model.modes[mode].decayRate -= model.modes[mode].radiation.decayRate;
    model.modes[mode].radiation = std::move(found[mode]);
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
