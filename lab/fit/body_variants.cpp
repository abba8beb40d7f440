#include "lab/fit/body_variants.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <tuple>
#include <utility>

#include "lab/fit/damping_law.h"
#include "lab/fit/wall_thickness.h"
#include <Eigen/Dense>

#include "carom/modal/mesh_analysis.h"

namespace carom::lab {

namespace {

constexpr double kUnknownError = 0.01;  // of frequencies that come without one
constexpr double kLeastError = 2e-3;
constexpr std::size_t kComparedPoints = 250;
constexpr std::size_t kReach = 6;   // places by which a mode may move
constexpr double kSameShape = 0.5;  // assurance criterion

/// Returns for each of a choice of points of one surface the nearest vertex of another.
std::vector<std::pair<std::size_t, std::size_t>> commonPoints(const SurfaceMesh& one,
                                                              const SurfaceMesh& other) {
  std::vector<std::pair<std::size_t, std::size_t>> points;
  const std::size_t step = std::max<std::size_t>(1, one.vertices.size() / kComparedPoints);
  for (std::size_t vertex = 0; vertex < one.vertices.size(); vertex += step) {
    const auto nearest = std::ranges::min_element(other.vertices, {}, [&](const Vec3& place) {
      return (place - one.vertices[vertex]).squaredNorm();
    });
    points.emplace_back(vertex, static_cast<std::size_t>(nearest - other.vertices.begin()));
  }
  return points;
}

/// Returns the shapes at those points, a column for each mode, each of length 1.
template <class Vertex>
Eigen::MatrixXd shapesAt(const ModalModel& model,
                         const std::vector<std::pair<std::size_t, std::size_t>>& points,
                         const Vertex& vertex) {
  Eigen::MatrixXd shapes(static_cast<Eigen::Index>(3 * points.size()),
                         static_cast<Eigen::Index>(model.modes.size()));
  for (std::size_t mode = 0; mode < model.modes.size(); ++mode) {
    for (std::size_t point = 0; point < points.size(); ++point)
      shapes.block<3, 1>(static_cast<Eigen::Index>(3 * point), static_cast<Eigen::Index>(mode)) =
          model.shape(mode, vertex(points[point]));
    auto column = shapes.col(static_cast<Eigen::Index>(mode));
    column /= std::max(column.norm(), 1e-300);
  }
  return shapes;
}

}  // namespace

BodyVariants::BodyVariants(SurfaceMesh mesh, Material material, std::size_t maxModes,
                           ModelCache* cache, Progress progress)
    : mesh_(std::move(mesh)),
      material_(std::move(material)),
      maxModes_(maxModes),
      cache_(cache),
      progress_(std::move(progress)) {
  material_.dampingAlpha = 0.0;
  material_.dampingBeta = 0.0;
  setDamping(material_, {});
}

Result<ModalModel> BodyVariants::analysed(const BodyVariant& variant) const {
  Material material = material_;
  material.poissonsRatio = variant.poissonsRatio;
  MeshAnalysisSettings settings;
  settings.radiation.reset();
  settings.solid.maxModes = static_cast<std::ptrdiff_t>(maxModes_);
  const SurfaceMesh& mesh = mesh_;
  Result<MeshAnalysis> analysis =
      analyseMesh(variant.wall == 0.0 ? mesh : thickened(mesh, variant.wall), material, settings,
                  cache_, progress_);
  if (!analysis) return analysis.error();
  return std::move(analysis->model);
}

std::vector<ComputedLine> linesOfModel(const ModalModel& model) {
  std::vector<ComputedLine> lines;
  for (const Mode& mode : model.modes) {
    const double error = mode.frequencyError > 0.0 ? mode.frequencyError : kUnknownError;
    lines.push_back({mode.frequency, std::max(error, kLeastError)});
  }
  return lines;
}

std::vector<double> frequencyShifts(const ModalModel& model, const ModalModel& other) {
  const auto points = commonPoints(model.surface, other.surface);
  const Eigen::MatrixXd shapes =
      shapesAt(model, points, [](const auto& point) { return point.first; });
  const Eigen::MatrixXd others =
      shapesAt(other, points, [](const auto& point) { return point.second; });
  std::vector<std::tuple<double, std::size_t, std::size_t>> pairs;  // criterion, mode, other mode
  for (std::size_t mode = 0; mode < model.modes.size(); ++mode) {
    const std::size_t from = mode > kReach ? mode - kReach : 0;
    for (std::size_t near = from; near < std::min(other.modes.size(), mode + kReach + 1); ++near) {
      const double product = shapes.col(static_cast<Eigen::Index>(mode))
                                 .dot(others.col(static_cast<Eigen::Index>(near)));
      pairs.emplace_back(product * product, mode, near);
    }
  }
  std::ranges::sort(pairs, std::greater<>());
  std::vector<double> shifts(model.modes.size(), 0.0);
  std::vector<bool> isSet(model.modes.size(), false);
  std::vector<bool> isTaken(other.modes.size(), false);
  for (const auto& pair : pairs) {
    const std::size_t mode = std::get<1>(pair);
    const std::size_t near = std::get<2>(pair);
    if (std::get<0>(pair) < kSameShape || isSet[mode] || isTaken[near]) continue;
    shifts[mode] = std::log(other.modes[near].frequency / model.modes[mode].frequency);
    isSet[mode] = true;
    isTaken[near] = true;
  }
  for (std::size_t mode = 0; mode < shifts.size(); ++mode) {  // pairs turn within their plane
    if (isSet[mode] || mode >= other.modes.size()) continue;
    shifts[mode] = std::log(other.modes[mode].frequency / model.modes[mode].frequency);
  }
  return shifts;
}

}  // namespace carom::lab
