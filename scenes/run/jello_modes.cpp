#include "scenes/run/jello_modes.h"

#include <algorithm>
#include <vector>

#include <Eigen/SparseCore>

#include "modal/analysis/audible_modes.h"
#include "modal/analysis/eigen_solver.h"
#include "native/jello/jello_skin.h"
#include "scenes/format/jello_reader.h"

namespace carom::scenes {

using namespace modal;
using namespace native;

namespace {

constexpr Eigen::Index kRigid = 6;
/// Modes are rigid whose lambda is below this share of the largest that a single point swings at
/// while all others are fixed.
constexpr double kRigidBelow = 1e-8;

SparseMatrix stiffnessOf(const JelloLattice& lattice, const std::vector<Vec3>& points) {
  const auto size = static_cast<Eigen::Index>(3 * points.size());
  std::vector<Eigen::Triplet<double>> entries;
  forEachSpring(lattice, [&](std::size_t a, std::size_t b, std::size_t) {
    const Vec3 along = (points[a] - points[b]).normalized();
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) {
        const double value = lattice.stiffness * along[row] * along[column];
        const int i = static_cast<int>(3 * a) + row;
        const int j = static_cast<int>(3 * b) + row;
        const int k = static_cast<int>(3 * a) + column;
        const int l = static_cast<int>(3 * b) + column;
        entries.insert(entries.end(),
                       {{i, k, value}, {j, l, value}, {i, l, -value}, {j, k, -value}});
      }
    }
  });
  SparseMatrix stiffness(size, size);
  stiffness.setFromTriplets(entries.begin(), entries.end());
  return stiffness;
}

/// Returns the indices of the points on the surface, in ascending order.
std::vector<std::size_t> surfacePoints(const JelloSkin& skin) {
  std::vector<std::size_t> points;
  for (const JelloSkin::Square& square : skin.squares())
    points.insert(points.end(), square.begin(), square.end());
  std::ranges::sort(points);
  points.erase(std::unique(points.begin(), points.end()), points.end());
  return points;
}

SurfaceMesh surfaceOf(const JelloSkin& skin, const std::vector<std::size_t>& used,
                      const std::vector<Vec3>& points) {
  SurfaceMesh surface;
  for (const std::size_t point : used)
    surface.vertices.push_back(points[point]);
  const auto indexOf = [&](std::size_t point) {
    return static_cast<std::uint32_t>(std::ranges::lower_bound(used, point) - used.begin());
  };
  for (const auto& [a, b, c, d] : skin.squares()) {
    surface.triangles.push_back({indexOf(a), indexOf(b), indexOf(c)});
    surface.triangles.push_back({indexOf(a), indexOf(c), indexOf(d)});
  }
  return surface;
}

}  // namespace

Result<ModalModel> jelloModalModel(const JelloLattice& lattice, const JelloModesSettings& settings,
                                   const Progress& progress) {
  JelloWorld world;
  world.lattice = lattice;
  world.positions = restingPoints(lattice, Vec3::Zero());
  world.velocities.assign(world.positions.size(), Vec3::Zero());
  if (const Status valid = validate(world); !valid) return Error{"jello: " + valid.error().message};
  if (!(lattice.stiffness > 0.0) || settings.modes == 0)
    return Error{"jello: stiffness (N/m) and the number of modes must be positive"};
  const std::vector<Vec3>& points = world.positions;
  const SparseMatrix stiffness = stiffnessOf(lattice, points);
  SparseMatrix mass(stiffness.rows(), stiffness.cols());
  mass.setIdentity();
  mass *= lattice.pointMass;
  EigenSettings eigen;
  eigen.modes = std::min(static_cast<Eigen::Index>(settings.modes) + kRigid, stiffness.rows());
  const Result<EigenSolution> found = lowestModes(stiffness, mass, eigen, progress);
  if (!found) return Error{"jello: " + found.error().message};

  const JelloSkin skin(lattice.count);
  const std::vector<std::size_t> used = surfacePoints(skin);
  ModalModel model;
  model.name = "jello";
  model.material = jelloMaterial(lattice);
  model.material.dampingBeta = lattice.damping / lattice.stiffness;
  model.mass = lattice.pointMass * static_cast<double>(points.size());
  for (const Vec3& point : points)
    model.inertia += lattice.pointMass * (point.squaredNorm() * Eigen::Matrix3d::Identity() -
                                          point * point.transpose());
  model.surface = surfaceOf(skin, used, points);
  model.medium = settings.medium;
  EigenModes modes;
  modes.lambda = found->lambda;
  modes.shapes.resize(static_cast<Eigen::Index>(3 * used.size()), found->vectors.cols());
  for (std::size_t vertex = 0; vertex < used.size(); ++vertex)
    modes.shapes.middleRows(static_cast<Eigen::Index>(3 * vertex), 3) =
        found->vectors.middleRows(static_cast<Eigen::Index>(3 * used[vertex]), 3);
  keepAudibleModes(model, modes, kRigidBelow * stiffness.diagonal().maxCoeff() / lattice.pointMass);
  if (!settings.radiation || model.modes.empty()) {
    findVolumes(model);
    return model;
  }
  const Result<RadiationReport> radiation = computeRadiation(model, *settings.radiation, progress);
  if (!radiation) return radiation.error();
  return model;
}

}  // namespace carom::scenes
