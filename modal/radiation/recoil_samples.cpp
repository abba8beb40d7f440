#include "modal/radiation/recoil_samples.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <string>
#include <utility>

#include "audio/model/spherical_harmonics.h"
#include "audio/radiation/multipole.h"
#include "audio/radiation/panel_mesh.h"
#include "modal/mesh/triangle_points.h"
#include "modal/radiation/exterior_solver.h"
#include "modal/radiation/mirror_part.h"
#include "modal/radiation/parallel_tasks.h"
#include "modal/radiation/radiating_panels.h"
#include "modal/radiation/surface_waves.h"

namespace carom::modal {

using namespace audio;

namespace {

using Complex = std::complex<double>;
using Parity = ExteriorSolver::Parity;

constexpr std::size_t kMostTriangles = 4000;  // of a surface: finer ones are clustered at once
constexpr double kMostMirrored = 2.7;         // times the panels, of a surface with three mirrors
constexpr int kOrdersBeyondRadius = 5;        // orders computed above k times the radius

/// Parity of a rigid motion's normal component across each axis: 1 or -1.
Parity parityOf(std::size_t motion) {
  const bool turns = motion > 2;
  Parity parity{};
  for (std::size_t axis = 0; axis < 3; ++axis)
    parity[axis] = (axis == motion % 3) != turns ? -1.0 : 1.0;
  return parity;
}

/// Parity of a real spherical harmonic across each axis.
Parity parityOf(int l, int m) {
  const double turn = std::abs(m) % 2 == 0 ? 1.0 : -1.0;
  const double sine = m < 0 ? -1.0 : 1.0;
  return {turn * sine, sine, (l + std::abs(m)) % 2 == 0 ? 1.0 : -1.0};
}

bool agree(const Parity& a, const Parity& b, const ExteriorSolver::Mirrors& mirrors) {
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (mirrors[axis] && a[axis] != b[axis]) return false;
  return true;
}

/// Returns the normal component of each unit motion at a point of the surface.
std::array<double, 6> normalMotions(const Vec3& at, const Vec3& normal) {
  const Vec3 turning = at.cross(normal);
  return {normal.x(), normal.y(), normal.z(), turning.x(), turning.y(), turning.z()};
}

/// Halves triangles across their longest edges until none is longer than that.
SurfaceMesh refined(SurfaceMesh mesh, double longestEdge) {
  for (std::size_t triangle = 0; triangle < mesh.triangles.size();) {
    const auto [first, second, third] = mesh.triangles[triangle];
    const auto length = [&](std::uint32_t from, std::uint32_t to) {
      return (mesh.vertices[from] - mesh.vertices[to]).norm();
    };
    const double across = length(first, second);
    const double behind = length(second, third);
    const double back = length(third, first);
    const double longest = std::max({across, behind, back});
    if (longest <= longestEdge) {
      ++triangle;
      continue;
    }
    std::array<std::uint32_t, 3> corners = {first, second, third};
    if (behind == longest) corners = {second, third, first};
    if (across < longest && behind < longest) corners = {third, first, second};
    const auto middle = static_cast<std::uint32_t>(mesh.vertices.size());
    mesh.vertices.emplace_back(0.5 * (mesh.vertices[corners[0]] + mesh.vertices[corners[1]]));
    mesh.triangles[triangle] = {corners[0], middle, corners[2]};
    mesh.triangles.push_back({middle, corners[1], corners[2]});
  }
  return mesh;
}

/// The same, with longer edges where there would be too many triangles, as on slender bodies.
SurfaceMesh refinedUpTo(std::size_t most, const SurfaceMesh& mesh, double longestEdge) {
  SurfaceMesh fine = refined(mesh, longestEdge);
  while (fine.triangles.size() > std::max(most, mesh.triangles.size())) {
    longestEdge *= 1.1;
    fine = refined(mesh, longestEdge);
  }
  return fine;
}

/// One resolution of the surface, in units of the radius.
class RecoilPanels {
 public:
  RecoilPanels(const MirrorPart& shape, double longestEdge, std::size_t most)
      : mirrors_(shape.mirrors),
        images_(static_cast<double>(1 << std::ranges::count(shape.mirrors, true))),
        solver_(refinedUpTo(most, shape.part, longestEdge), mirrors_) {}

  std::size_t panels() const { return solver_.panels().size(); }

  /// Solves for all motions at a frequency: their h by harmonic, up to `order`.
  std::array<std::vector<Complex>, 6> solve(double frequency, int order) const {
    const auto count = static_cast<Eigen::Index>(solver_.partSize());
    Eigen::MatrixXd normal(count, 6);
    for (Eigen::Index row = 0; row < count; ++row) {
      const SourcePanel& panel = solver_.panels()[static_cast<std::size_t>(row)];
      const std::array<double, 6> motions = normalMotions(panel.centroid(), panel.normal());
      for (Eigen::Index motion = 0; motion < 6; ++motion)
        normal(row, motion) = motions[static_cast<std::size_t>(motion)];
    }
    const Eigen::MatrixXcd pressure = pressures(frequency, normal);
    return multipoles(frequency, order, normal, pressure);
  }

  Mat6 beam() const {
    Mat6 sum = Mat6::Zero();
    for (const SourcePanel& panel : solver_.panels()) {
      const std::array<double, 6> motions = normalMotions(panel.centroid(), panel.normal());
      const Eigen::Map<const Vec6> along(motions.data());
      sum += panel.area() * along * along.transpose();
    }
    return sum;
  }

 private:
  using Vec6 = Eigen::Matrix<double, 6, 1>;

  /// Pressure on the panels over density and acceleration. Motions of one parity are solved at
  /// once.
  Eigen::MatrixXcd pressures(double frequency, const Eigen::MatrixXd& normal) const {
    std::vector<std::vector<Eigen::Index>> groups;
    std::vector<ExteriorSolver::Slopes> slopes;
    for (std::size_t motion = 0; motion < 6; ++motion) {
      const Parity parity = parityOf(motion);
      const auto known = std::ranges::find_if(
          slopes, [&](const auto& one) { return agree(one.parity, parity, mirrors_); });
      const auto group = static_cast<std::size_t>(known - slopes.begin());
      if (known == slopes.end()) {
        slopes.push_back({.parity = parity, .values = {}});
        groups.emplace_back();
      }
      groups[group].push_back(static_cast<Eigen::Index>(motion));
    }
    for (std::size_t group = 0; group < groups.size(); ++group)
      slopes[group].values = -normal(Eigen::all, groups[group]).cast<Complex>();
    const std::vector<Eigen::MatrixXcd> solved = solver_.solve(frequency, slopes);
    Eigen::MatrixXcd pressure(normal.rows(), 6);
    for (std::size_t group = 0; group < groups.size(); ++group)
      pressure(Eigen::all, groups[group]) = solved[group];
    return pressure;
  }

  std::array<std::vector<Complex>, 6> multipoles(double frequency, int order,
                                                 const Eigen::MatrixXd& normal,
                                                 const Eigen::MatrixXcd& pressure) const {
    std::array<std::vector<Complex>, 6> sums;
    sums.fill(std::vector<Complex>(harmonicCount(order), 0.0));
    SurfaceWaves waves(frequency, order, 1e-9);
    for (Eigen::Index row = 0; row < normal.rows(); ++row) {
      const auto index = static_cast<std::size_t>(row);
      const SourcePanel& panel = solver_.panels()[index];
      const double share = images_ * panel.area() / 3.0;
      for (const Vec3& node : ExteriorSolver::nodesOf(panel.corners())) {
        const std::span<const Slope> here = waves.at(node, panel.normal());
        for (std::size_t motion = 0; motion < 6; ++motion) {
          const auto column = static_cast<Eigen::Index>(motion);
          const Complex dipoles = share * pressure(row, column);
          const double source = share * normal(row, column);
          for (std::size_t wave = 0; wave < here.size(); ++wave)
            sums[motion][wave] += dipoles * here[wave].slope + source * here[wave].value;
        }
      }
    }
    // Sound that leaves the enclosing sphere towards the listener counts as without delay.
    const Complex advance = std::polar(1.0, -frequency);
    for (std::vector<Complex>& motion : sums) {
      SurfaceWaves::turnPhases(motion);
      for (Complex& value : motion)
        value *= advance;
    }
    return sums;
  }

  ExteriorSolver::Mirrors mirrors_;
  double images_;
  ExteriorSolver solver_;
};

std::vector<double> frequenciesUpTo(const RecoilSettings& settings) {
  std::vector<double> frequencies = {0.1, 0.2, 0.4};
  while (frequencies.back() < settings.highest)
    frequencies.push_back(frequencies.back() + settings.spacing);
  return frequencies;
}

/// Returns the surface in units of the radius, by as many of its triangles as can be solved with.
/// Where it has to be clustered, mirror planes are kept if a part between them is small enough.
Result<MirrorPart> shapeOf(const SurfaceMesh& surface, double radius, std::size_t panels) {
  Result<SurfaceMesh> clean = cleanSurface(surface);
  if (!clean) return clean.error();
  for (Vec3& vertex : clean->vertices)
    vertex /= radius;
  const double volume = signedVolume(*clean);
  const auto mirrored = static_cast<std::size_t>(kMostMirrored * static_cast<double>(panels));
  for (const std::size_t most : {kMostTriangles, mirrored, panels}) {
    const SurfaceMesh coarse = clusteredSurface(*clean, most);
    if (std::abs(signedVolume(coarse) - volume) > kMostVolumeLost * volume) break;
    MirrorPart shape = mirrorPart(coarse);
    if (shape.part.triangles.size() <= panels) return shape;
  }
  return Error{"surface: simplified to " + std::to_string(panels) +
               " panels it loses its volume; expected a simpler mesh"};
}

}  // namespace

Result<RecoilSamples> sampleRecoil(const SurfaceMesh& surface, const RecoilSettings& settings,
                                   const Progress& progress) {
  RecoilSamples samples;
  samples.radius = enclosingRadius(surface, Vec3::Zero());
  samples.frequencies = frequenciesUpTo(settings);
  const Result<MirrorPart> shape = shapeOf(surface, samples.radius, settings.panels);
  if (!shape) return shape.error();
  const double side = std::sqrt(shape->area / static_cast<double>(settings.panels));
  const double mirrors = std::pow(1.4, std::ranges::count(shape->mirrors, true));
  std::array<std::vector<std::vector<Complex>>, 6> found;
  std::size_t next = 0;
  for (const double upTo : {0.35, 0.65, 1.0}) {
    const RecoilPanels panels(*shape, 2.0 * side / std::sqrt(mirrors) * std::min(1.4, 0.9 / upTo),
                              settings.panels);
    const std::size_t first = next;
    while (next < samples.frequencies.size() &&
           (upTo >= 1.0 || samples.frequencies[next] <= upTo * settings.highest))
      ++next;
    std::vector<std::array<std::vector<Complex>, 6>> solved(next - first);
    const auto solve = [&](std::size_t index) {
      const double frequency = samples.frequencies[first + index];
      const int order = std::min(static_cast<int>(std::ceil(frequency)) + kOrdersBeyondRadius,
                                 RigidRecoil::kHighestOrder);
      solved[index] = panels.solve(frequency, order);
    };
    const auto goesOn = [&](std::size_t begun) {
      const double frequency = samples.frequencies[first + begun];
      const double done = frequency * frequency / (settings.highest * settings.highest);
      return !progress || progress("recoil", std::min(done, 1.0));
    };
    const std::size_t threads = settings.threads == 0 ? processorCount() : settings.threads;
    if (!runTasks(solved.size(), threads, solve, goesOn)) return Error{kCancelled};
    for (std::array<std::vector<Complex>, 6>& motions : solved)
      for (std::size_t motion = 0; motion < 6; ++motion)
        found[motion].push_back(std::move(motions[motion]));
    samples.panels = panels.panels();
    samples.beam = panels.beam();
  }
  const std::size_t most_harmonics = found[0].back().size();
  for (std::size_t motion = 0; motion < 6; ++motion) {
    RecoilSamples::Motion& to = samples.motions[motion];
    for (int l = 0; harmonicCount(l) <= most_harmonics; ++l)
      for (int m = -l; m <= l; ++m)
        if (agree(parityOf(motion), parityOf(l, m), shape->mirrors))
          to.harmonics.push_back(static_cast<std::size_t>(l * l + l + m));
    for (const std::vector<Complex>& all : found[motion]) {
      to.values.emplace_back();
      for (const std::size_t harmonic : to.harmonics)
        to.values.back().push_back(harmonic < all.size() ? all[harmonic] : Complex(0.0));
    }
  }
  return samples;
}

}  // namespace carom::modal
