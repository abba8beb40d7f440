#pragma once

#include <Eigen/Core>

#include "native/jello/jello_world.h"

namespace carom::test {

/// The whole stiffness matrix of a lattice near rest in N/m, with rows x, y and z for each point.
inline Eigen::MatrixXd stiffnessOf(const native::JelloLattice& lattice) {
  const std::vector<Vec3> points = restingPoints(lattice, Vec3::Zero());
  const auto size = static_cast<Eigen::Index>(3 * points.size());
  Eigen::MatrixXd stiffness = Eigen::MatrixXd::Zero(size, size);
  forEachSpring(lattice, [&](std::size_t a, std::size_t b, std::size_t) {
    const Vec3 along = (points[a] - points[b]).normalized();
    const Eigen::Matrix3d block = lattice.stiffness * along * along.transpose();
    const auto i = static_cast<Eigen::Index>(3 * a);
    const auto j = static_cast<Eigen::Index>(3 * b);
    stiffness.block<3, 3>(i, i) += block;
    stiffness.block<3, 3>(j, j) += block;
    stiffness.block<3, 3>(i, j) -= block;
    stiffness.block<3, 3>(j, i) -= block;
  });
  return stiffness;
}

}  // namespace carom::test
