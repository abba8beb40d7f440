#include "carom/audio/panel_radiator.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "audio/radiation/panel_equations.h"
#include "audio/radiation/panel_mesh.h"
#include "audio/radiation/source_panel.h"

namespace carom {

using namespace audio;

namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

constexpr std::size_t kCoarsest = 40;  // panels
constexpr std::size_t kLeastPanels = 160;
constexpr std::size_t kDirectPanels = 320;  // the most for which iteration would not be quicker
constexpr double kVolumeLost = 0.3;         // largest share lost or won by clustering
constexpr double kSmoothOrder = 2.0;
constexpr double kSharpOrder = 1.2;

std::vector<SourcePanel> panelsOf(const SurfaceMesh& mesh) {
  std::vector<SourcePanel> panels;
  panels.reserve(mesh.triangles.size());
  for (const auto& [first, second, third] : mesh.triangles)
    panels.emplace_back(
        std::array<Vec3, 3>{mesh.vertices[first], mesh.vertices[second], mesh.vertices[third]});
  return panels;
}

// Returns v.n for unit translations and unit turns about the origin, a row per panel.
Eigen::MatrixXd unitMotions(const std::vector<SourcePanel>& panels) {
  Eigen::MatrixXd motions(static_cast<Eigen::Index>(panels.size()), 6);
  for (Eigen::Index row = 0; row < motions.rows(); ++row) {
    const SourcePanel& panel = panels[static_cast<std::size_t>(row)];
    motions.row(row) << panel.normal().transpose(),
        panel.centroid().cross(panel.normal()).transpose();
  }
  return motions;
}

Matrix6 addedVolumeBy(const Eigen::MatrixXd& potential, const std::vector<SourcePanel>& panels,
                      const Eigen::MatrixXd& motions) {
  Matrix6 added = Matrix6::Zero();
  for (Eigen::Index row = 0; row < motions.rows(); ++row)
    added -= panels[static_cast<std::size_t>(row)].area() * motions.row(row).transpose() *
             potential.row(row);
  return added;
}

// Returns the added volume of unit translations and turns. The gradient with respect to the point
// is minus that with respect to the panel.
Matrix6 addedVolumeOn(const SurfaceMesh& mesh) {
  const std::vector<SourcePanel> panels = panelsOf(mesh);
  const Eigen::MatrixXd motions = unitMotions(panels);
  const Eigen::Index count = motions.rows();
  Eigen::MatrixXd matrix(count, count);
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(count, 6);
  for (Eigen::Index column = 0; column < count; ++column) {
    const SourcePanel& panel = panels[static_cast<std::size_t>(column)];
    for (Eigen::Index row = 0; row < count; ++row) {
      const SourceField field =
          row == column ? panel.fieldAtCentroid()
                        : panel.fieldAt(panels[static_cast<std::size_t>(row)].centroid());
      matrix(row, column) = field.gradient.dot(panel.normal()) / (4.0 * std::numbers::pi);
      right.row(row) -= field.potential / (4.0 * std::numbers::pi) * motions.row(column);
    }
    matrix(column, column) = 0.5;
  }
  return addedVolumeBy(matrix.partialPivLu().solve(right), panels, motions);
}

// Returns the same of each mesh but for 1e-3: far panels count by their moments, and large systems
// are solved by iteration from the mesh before, whose panels they split in four.
std::vector<Matrix6> quickAddedVolumesOn(const std::vector<SurfaceMesh>& meshes) {
  std::vector<Matrix6> added;
  std::optional<CoarseSolution> coarse;
  for (const SurfaceMesh& mesh : meshes) {
    const std::vector<SourcePanel> panels = panelsOf(mesh);
    const Eigen::MatrixXd motions = unitMotions(panels);
    const PanelEquations equations = momentEquations(panels, motions);
    std::optional<Eigen::MatrixXd> potential;
    if (panels.size() > kDirectPanels) potential = solvedFrom(coarse, equations);
    if (!potential) {
      coarse.emplace(CoarseSolution{
          Eigen::PartialPivLU<Eigen::MatrixXd>(equations.matrix.cast<double>()), {}});
      coarse->potential = coarse->matrix.solve(equations.right);
      potential = coarse->potential;
    }
    added.push_back(addedVolumeBy(*potential, panels, motions));
  }
  return added;
}

std::vector<Matrix6> addedVolumesOn(const std::vector<SurfaceMesh>& meshes) {
  std::vector<Matrix6> added;
  added.reserve(meshes.size());
  for (const SurfaceMesh& mesh : meshes)
    added.push_back(addedVolumeOn(mesh));
  return added;
}

Matrix6 symmetricPart(const Matrix6& matrix) {
  return 0.5 * (matrix + matrix.transpose());
}

// Returns the matrix without negative eigenvalues, as extrapolation, and rounding for a body of
// revolution, may leave slightly negative ones.
Matrix6 positivePart(const Matrix6& matrix) {
  const Eigen::SelfAdjointEigenSolver<Matrix6> eigen(matrix);
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).asDiagonal() *
         eigen.eigenvectors().transpose();
}

struct Level {
  Matrix6 added;
  std::size_t panels;
};

// Returns one to three meshes from coarse to fine, each of half the panel size of the one before.
std::vector<SurfaceMesh> levelsOf(const SurfaceMesh& base, const PanelSettings& settings) {
  std::vector<SurfaceMesh> levels = {halvedSurface(base, std::min(kCoarsest, settings.panels))};
  while (levels.size() < 3 && 4 * levels.back().triangles.size() <= settings.panels)
    levels.push_back(quarteredSurface(levels.back()));
  return levels;
}

// Returns the limit of a sequence whose error falls with the order-th power of the panel size.
Matrix6 limitOf(const std::vector<Matrix6>& levels, double order) {
  const Matrix6& fine = levels.back();
  return fine + (fine - levels[levels.size() - 2]) / (std::exp2(order) - 1.0);
}

double orderOf(const std::vector<Matrix6>& levels, bool sharp) {
  if (levels.size() < 3) return sharp ? kSharpOrder : kSmoothOrder;
  const double before = (levels[1] - levels[0]).norm();
  const double after = (levels[2] - levels[1]).norm();
  return std::clamp(std::log2(before / after), 1.0, kSmoothOrder);
}

bool hasSharpEdges(const SurfaceMesh& mesh) {
  return sharpEdgeLength(mesh) > 0.5 * std::sqrt(surfaceArea(mesh));
}

// Solves a mesh about its centroid and of unit size.
PanelSolution solveUnit(const SurfaceMesh& base, const PanelSettings& settings, bool sharp) {
  PanelSolution solution;
  std::vector<SurfaceMesh> meshes = levelsOf(base, settings);
  if (!settings.extrapolate) meshes.erase(meshes.begin(), meshes.end() - 1);
  const std::vector<Matrix6> levels =
      settings.quick ? quickAddedVolumesOn(meshes) : addedVolumesOn(meshes);
  const Matrix6& fine = levels.back();
  solution.panels = meshes.back().triangles.size();
  solution.asymmetry = (fine - fine.transpose()).norm() / fine.norm();
  Matrix6 added = fine;
  if (levels.size() > 1) {
    solution.order = orderOf(levels, sharp);
    added = limitOf(levels, solution.order);
    solution.correction = (added - fine).norm() / added.norm();
  }
  solution.radiator.addedVolume = positivePart(symmetricPart(added));
  return solution;
}

double reachOf(const SurfaceMesh& mesh, const Vec3& centre) {
  double reach = 0.0;
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t corner : triangle)
      reach = std::max(reach, (mesh.vertices[corner] - centre).norm());
  }
  return reach;
}

bool keepsVolume(const SurfaceMesh& simplified, const SurfaceMesh& mesh) {
  const double kept = signedVolume(simplified) / signedVolume(mesh);
  return kept > 1.0 - kVolumeLost && kept < 1.0 + kVolumeLost;
}

bool hasSurvived(const SurfaceMesh& simplified, const SurfaceMesh& mesh) {
  return keepsVolume(simplified, mesh) && !isFolded(simplified);
}

}  // namespace

Result<PanelSolution> solvePanels(const SurfaceMesh& surface, const PanelSettings& settings) {
  if (settings.panels < kLeastPanels) {
    return Error{"panelRadiator: panels is " + std::to_string(settings.panels) +
                 "; expected at least " + std::to_string(kLeastPanels)};
  }
  Result<SurfaceMesh> clean = cleanSurface(surface);
  if (!clean) return clean.error();
  const double volume = signedVolume(*clean);
  const Vec3 centroid = volumeCentroid(*clean);
  const double scale = reachOf(*clean, centroid);
  for (Vec3& vertex : clean->vertices)
    vertex = (vertex - centroid) / scale;
  const bool sharp = hasSharpEdges(*clean);
  const std::size_t most = sharp && settings.extrapolate ? settings.panels / 4 : settings.panels;
  SurfaceMesh base = clusteredSurface(*clean, most);
  // A body that does not survive on so few triangles is solved once, on as many as may be.
  if (most < settings.panels && !hasSurvived(base, *clean))
    base = clusteredSurface(*clean, settings.panels);
  if (!keepsVolume(base, *clean)) {
    return Error{"surface: simplified from " + std::to_string(clean->triangles.size()) + " to " +
                 std::to_string(base.triangles.size()) + " triangles it has " +
                 std::to_string(signedVolume(base) / signedVolume(*clean)) +
                 " of its volume; expected a simpler mesh, or more panels"};
  }
  PanelSolution solution = solveUnit(base, settings, sharp);
  Mat6& added = solution.radiator.addedVolume;
  added *= scale * scale * scale;
  added.bottomRows<3>() *= scale;
  added.rightCols<3>() *= scale;
  solution.radiator.volume = volume;
  solution.radiator = solution.radiator.about(-centroid);
  added = symmetricPart(added);
  if (!(solution.radiator.radius() > 0.0) || !added.allFinite())
    return Error{
        "surface: the flow of air around it has no solution on its triangles; expected a simpler "
        "mesh, or one whose parts are thicker beside their triangles"};
  return solution;
}

Result<RigidRadiator> panelRadiator(const SurfaceMesh& surface, const PanelSettings& settings) {
  const Result<PanelSolution> solution = solvePanels(surface, settings);
  if (!solution) return solution.error();
  return solution->radiator;
}

std::size_t RadiatorCache::Hash::operator()(const SurfaceMesh& mesh) const {
  std::size_t hash = mesh.triangles.size();
  const auto mix = [&hash](std::size_t value) {
    hash ^= value + 0x9e3779b97f4a7c15ULL + (hash << 6U) + (hash >> 2U);
  };
  for (const Vec3& vertex : mesh.vertices) {
    for (const double coordinate : vertex)
      mix(std::hash<double>{}(coordinate));
  }
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t corner : triangle)
      mix(corner);
  }
  return hash;
}

const Result<RigidRadiator>& RadiatorCache::radiatorOf(const SurfaceMesh& surface) {
  const auto found = radiators_.find(surface);
  if (found != radiators_.end()) return found->second;
  return radiators_.emplace(surface, panelRadiator(surface, settings_)).first->second;
}

}  // namespace carom
