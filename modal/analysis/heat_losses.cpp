#include "modal/analysis/heat_losses.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "modal/analysis/solid_element.h"

namespace carom::modal {
namespace {

/// Least part of a cell that counts; the fill of what is outside is less.
constexpr double kLeastPart = 1e-6;

/// The inside of a cell, and how its dilatation is taken from the coefficients of its functions.
struct CellDilatation {
  double volume = 0.0;                               ///< m^3
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();  ///< m^2, covariance of the inside, grid frame
  /// Dilatation in the inside's centre and its gradient (grid frame), from the coefficients along
  /// the body's axes: three columns for each function.
  Eigen::Matrix<double, 4, 3 * kCellFunctions> from;
};

double momentOf(const CellMoments& inside, const std::array<std::size_t, 3>& powers) {
  return inside[powers[0] + kMomentPowers * (powers[1] + kMomentPowers * powers[2])];
}

CellDilatation dilatationOf(const SplineMesh& grid, const CellAxes& sides,
                            const CellMoments& inside) {
  CellDilatation cell;
  const Vec3 size(sides[0]->size, sides[1]->size, sides[2]->size);
  const double part = momentOf(inside, {0, 0, 0});
  if (!(part > 8.0 * kLeastPart)) return cell;
  cell.volume = part * size.prod() / 8.0;
  Vec3 centre = Vec3::Zero();  // from -1 to 1
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::array<std::size_t, 3> powers{};
    powers[axis] = 1;
    centre[static_cast<Eigen::Index>(axis)] = momentOf(inside, powers) / part;
  }
  const Vec3 half = 0.5 * size;
  for (std::size_t one = 0; one < 3; ++one) {
    for (std::size_t other = 0; other < 3; ++other) {
      std::array<std::size_t, 3> powers{};
      ++powers[one];
      ++powers[other];
      const auto row = static_cast<Eigen::Index>(one);
      const auto column = static_cast<Eigen::Index>(other);
      cell.spread(row, column) = (momentOf(inside, powers) / part - centre[row] * centre[column]) *
                                 half[row] * half[column];
    }
  }
  // By axis, the functions along it and their derivatives.
  std::array<std::array<Eigen::Vector4d, 3>, 3> along;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto index = static_cast<Eigen::Index>(axis);
    for (int derivative = 0; derivative < 3; ++derivative)
      along[axis][static_cast<std::size_t>(derivative)] =
          sides[axis]->at(0.5 * (centre[index] + 1.0), derivative) /
          std::pow(size[index], derivative);
  }
  for (Eigen::Index function = 0; function < kCellFunctions; ++function) {
    const std::array<Eigen::Index, 3> place = {function % 4, function / 4 % 4, function / 16};
    const auto derived = [&](std::array<std::size_t, 3> times) {
      double product = 1.0;
      for (std::size_t axis = 0; axis < 3; ++axis)
        product *= along[axis][times[axis]][place[axis]];
      return product;
    };
    Eigen::Matrix<double, 4, 3> slopes;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      std::array<std::size_t, 3> times{};
      times[axis] = 1;
      slopes(0, static_cast<Eigen::Index>(axis)) = derived(times);
      for (std::size_t other = 0; other < 3; ++other) {
        std::array<std::size_t, 3> twice = times;
        ++twice[other];
        slopes(1 + static_cast<Eigen::Index>(other), static_cast<Eigen::Index>(axis)) =
            derived(twice);
      }
    }
    cell.from.middleCols<3>(3 * function) = slopes * grid.axes.transpose();
  }
  return cell;
}

}  // namespace

Eigen::VectorXd heatLosses(const SplineMesh& grid, const EigenSolution& solution,
                           Eigen::Index rigid, const Material& material) {
  const auto& [expansion, conductivity, heatCapacity] = material.thermal;
  if (expansion == 0.0 || conductivity == 0.0 || heatCapacity == 0.0) return {};
  const Eigen::Index modes = solution.lambda.size();
  // A node's coefficients of all modes lie side by side.
  const Eigen::MatrixXd coefficients = solution.vectors.transpose();
  Eigen::ArrayXd squares = Eigen::ArrayXd::Zero(modes);    // m^3, integral of e^2
  Eigen::ArrayXd gradients = Eigen::ArrayXd::Zero(modes);  // m, that of its gradient's square
  const CellMoments whole = momentsOf(-Vec3::Ones(), Vec3::Ones());
  Eigen::Matrix<double, Eigen::Dynamic, 4> sums(modes, 4);
  for (const SplineCell& cell : grid.cells) {
    const CellDilatation inside = dilatationOf(
        grid, sidesOf(grid, cell),
        cell.moments >= 0 ? grid.moments[static_cast<std::size_t>(cell.moments)] : whole);
    if (inside.volume == 0.0) continue;
    sums.setZero();
    for (std::size_t function = 0; function < cell.nodes.size(); ++function)
      sums.noalias() +=
          coefficients.middleCols<3>(3 * static_cast<Eigen::Index>(cell.nodes[function])) *
          inside.from.middleCols<3>(3 * static_cast<Eigen::Index>(function)).transpose();
    const auto gradient = sums.rightCols<3>();
    squares +=
        inside.volume * (sums.col(0).array().square() +
                         (gradient * inside.spread).cwiseProduct(gradient).rowwise().sum().array());
    gradients += inside.volume * gradient.rowwise().squaredNorm().array();
  }
  const double stiff = material.youngsModulus / std::pow(1.0 - 2.0 * material.poissonsRatio, 2);
  Eigen::VectorXd losses = Eigen::VectorXd::Zero(modes);
  for (Eigen::Index mode = rigid; mode < modes; ++mode) {
    const double lambda = solution.lambda[mode];
    if (!(lambda > 0.0 && gradients[mode] > 0.0)) continue;
    const double thickness = std::sqrt(12.0 * squares[mode] / gradients[mode]);
    const double frequency = std::sqrt(lambda) / (2.0 * std::numbers::pi);
    losses[mode] =
        stiff * squares[mode] / lambda * thermoelasticLossFactor(material, thickness, frequency);
  }
  return losses;
}

}  // namespace carom::modal
