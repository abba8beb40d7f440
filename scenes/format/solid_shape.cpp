#include "scenes/format/solid_shape.h"

#include <array>
#include <cstddef>
#include <numbers>

#include <Eigen/Dense>

namespace carom::scenes {
namespace {

constexpr double kPrincipal =
    1e-9;  // share of the largest inertia: smaller products of inertia are rounding

/// Returns the inertia of a body from its covariance, the integral of x x^T over its volume.
Eigen::Matrix3d inertiaFrom(const Eigen::Matrix3d& covariance) {
  return covariance.trace() * Eigen::Matrix3d::Identity() - covariance;
}

}  // namespace

const char* formName(const SolidShape& solid) {
  constexpr std::array<const char*, 3> kNames = {"box", "cylinder", "mesh"};
  return kNames.at(solid.form.index());
}

SolidMeasures measuresOf(const BoxForm& box) {
  SolidMeasures measures;
  measures.volume = 8.0 * box.halfExtents.prod();
  const Vec3 square = box.halfExtents.cwiseAbs2() / 3.0;
  measures.inertia = measures.volume * inertiaFrom(square.asDiagonal());
  return measures;
}

SolidMeasures measuresOf(const CylinderForm& cylinder) {
  const double square = cylinder.radius * cylinder.radius;
  SolidMeasures measures;
  measures.volume = std::numbers::pi * square * cylinder.height;
  const Vec3 covariance(0.25 * square, cylinder.height * cylinder.height / 12.0, 0.25 * square);
  measures.inertia = measures.volume * inertiaFrom(covariance.asDiagonal());
  return measures;
}

bool hasTextureCoordinates(const SolidShape& solid) {
  const auto* mesh = std::get_if<std::shared_ptr<const SolidMesh>>(&solid.form);
  return mesh != nullptr && !(*mesh)->coordinates.empty();
}

SolidMeasures measuresOf(const SurfaceMesh& surface) {
  SolidMeasures measures;
  measures.volume = signedVolume(surface);
  measures.centroid = volumeCentroid(surface);
  measures.inertia = inertiaFrom(secondMoment(surface, measures.centroid));
  return measures;
}

PrincipalAxes principalAxes(const Eigen::Matrix3d& inertia) {
  const Vec3 diagonal = inertia.diagonal();
  const Eigen::Matrix3d products = inertia - Eigen::Matrix3d(diagonal.asDiagonal());
  if (products.cwiseAbs().maxCoeff() <= kPrincipal * diagonal.maxCoeff())
    return {Quat::Identity(), diagonal};
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(inertia);
  Eigen::Matrix3d axes = solver.eigenvectors();
  axes.col(2) = axes.col(0).cross(axes.col(1));  // never a reflection
  return {Quat(axes).normalized(), solver.eigenvalues()};
}

}  // namespace carom::scenes
