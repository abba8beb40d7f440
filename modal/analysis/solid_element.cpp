#include "modal/analysis/solid_element.h"

#include <array>
#include <cmath>

#include <Eigen/Cholesky>

namespace carom::modal {
namespace {

constexpr int kNodes = 8;
constexpr int kFunctions = kNodes + 3;  // the incompatible modes come last

using Shapes = Eigen::Matrix<double, kNodes, 1>;
using Gradients = Eigen::Matrix<double, 3, kFunctions>;
// Integrals of (d_a N_i) (d_b N_j), at 3 i + a, 3 j + b.
using Products = Eigen::Matrix<double, 3 * kFunctions, 3 * kFunctions>;

// Shape functions at a point of the cell, each coordinate from 0 to 1.
Shapes shapesAt(const Vec3& at) {
  Shapes shapes;
  for (int node = 0; node < kNodes; ++node) {
    shapes[node] = 1.0;
    for (int axis = 0; axis < 3; ++axis)
      shapes[node] *= (node >> axis & 1) != 0 ? at[axis] : 1.0 - at[axis];
  }
  return shapes;
}

Gradients gradientsAt(const Vec3& at, const Vec3& cellSize) {
  Gradients gradients = Gradients::Zero();
  for (int node = 0; node < kNodes; ++node) {
    for (int axis = 0; axis < 3; ++axis) {
      double product = ((node >> axis & 1) != 0 ? 1.0 : -1.0) / cellSize[axis];
      for (int other = 0; other < 3; ++other) {
        if (other == axis) continue;
        product *= (node >> other & 1) != 0 ? at[other] : 1.0 - at[other];
      }
      gradients(axis, node) = product;
    }
  }
  for (int axis = 0; axis < 3; ++axis)
    gradients(axis, kNodes + axis) = (1.0 - 2.0 * at[axis]) * 4.0 / cellSize[axis];
  return gradients;
}

// Calls add(point, weight) for two points of Gauss each way in each box: exact, since no product
// is of a higher degree than two in any one coordinate.
template <class Add>
void forEachPoint(const Vec3& cellSize, std::span<const CellBox> inside, const Add& add) {
  const double offset = 0.5 / std::sqrt(3.0);
  for (const CellBox& box : inside) {
    const Vec3 size = box.high - box.low;
    const double weight = size.cwiseProduct(cellSize).prod() / 8.0;
    for (int point = 0; point < 8; ++point) {
      Vec3 at;
      for (int axis = 0; axis < 3; ++axis)
        at[axis] =
            box.low[axis] + size[axis] * (0.5 + ((point >> axis & 1) != 0 ? offset : -offset));
      add(at, weight);
    }
  }
}

Products gradientProducts(const Vec3& cellSize, std::span<const CellBox> inside) {
  Gradients mean = Gradients::Zero();
  double volume = 0.0;
  forEachPoint(cellSize, inside, [&](const Vec3& at, double weight) {
    mean += weight * gradientsAt(at, cellSize);
    volume += weight;
  });
  mean /= volume;
  Products products = Products::Zero();
  forEachPoint(cellSize, inside, [&](const Vec3& at, double weight) {
    Gradients gradients = gradientsAt(at, cellSize);
    gradients.rightCols<3>() -= mean.rightCols<3>();
    const Eigen::Map<const Eigen::Matrix<double, 3 * kFunctions, 1>> flat(gradients.data());
    products += weight * flat * flat.transpose();
  });
  return products;
}

// Stiffness from the strain energy lambda / 2 (tr e)^2 + mu e:e, with Lame's constants.
Products stiffnessOf(const Products& products, const Material& material) {
  const double nu = material.poissonsRatio;
  const double mu = material.youngsModulus / (2.0 * (1.0 + nu));
  const double lambda = 2.0 * mu * nu / (1.0 - 2.0 * nu);
  Products stiffness;
  for (Eigen::Index row = 0; row < kFunctions; ++row) {
    for (Eigen::Index column = 0; column < kFunctions; ++column) {
      const Eigen::Matrix3d product = products.block<3, 3>(3 * row, 3 * column);
      stiffness.block<3, 3>(3 * row, 3 * column) =
          lambda * product + mu * product.transpose() +
          mu * product.trace() * Eigen::Matrix3d::Identity();
    }
  }
  return stiffness;
}

}  // namespace

ElementMatrices solidElement(const Vec3& cellSize, std::span<const CellBox> inside,
                             const Material& material) {
  static constexpr int kOuter = 3 * kNodes;
  const std::array<CellBox, 1> whole;
  if (inside.empty()) inside = whole;
  const Products full = stiffnessOf(gradientProducts(cellSize, inside), material);
  const Eigen::Matrix<double, 9, kOuter> coupling = full.bottomLeftCorner<9, kOuter>();
  const Eigen::Matrix<double, 9, 9> inner = full.bottomRightCorner<9, 9>();
  ElementMatrices matrices;
  matrices.stiffness =
      full.topLeftCorner<kOuter, kOuter>() - coupling.transpose() * inner.llt().solve(coupling);
  matrices.mass.setZero();
  forEachPoint(cellSize, inside, [&](const Vec3& at, double weight) {
    const Shapes shapes = shapesAt(at);
    matrices.mass += material.density * weight * shapes * shapes.transpose();
  });
  return matrices;
}

}  // namespace carom::modal
