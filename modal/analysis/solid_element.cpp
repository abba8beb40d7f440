#include "modal/analysis/solid_element.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace carom::modal {
namespace {

constexpr std::size_t kOrder = 4;  // functions along an axis, each of four powers
constexpr std::size_t kPairs = kOrder * kOrder;
constexpr std::size_t kPowers = kMomentPowers;
constexpr Eigen::Index kFreedom = 3 * Eigen::Index{kCellFunctions};  // of a cell

using Powers = std::array<double, kPowers>;
/// Products of two functions or their derivatives along an axis, by powers of the coordinate from
/// -1 to 1, at first + 4 second.
using PairPowers = std::array<Powers, kPairs>;

/// Which of the two factors of a product are derivatives.
enum Derivatives : std::size_t { kNone, kSecond, kFirst, kBoth };

// Turns powers of the place from 0 to 1 into those of the coordinate from -1 to 1.
std::array<double, kOrder> centred(const std::array<double, kOrder>& piece) {
  std::array<double, kOrder> result{};
  for (std::size_t power = 0; power < kOrder; ++power) {
    double share = piece[power] * std::pow(0.5, static_cast<double>(power));  // times a binomial
    for (std::size_t index = 0; index <= power; ++index) {
      result[index] += share;
      share *= static_cast<double>(power - index) / static_cast<double>(index + 1);
    }
  }
  return result;
}

std::array<double, kOrder> slopeOf(const std::array<double, kOrder>& powers) {
  std::array<double, kOrder> slope{};
  for (std::size_t power = 1; power < kOrder; ++power)
    slope[power - 1] = static_cast<double>(power) * powers[power];
  return slope;
}

std::array<PairPowers, 4> productsOn(const AxisCell& cell) {
  std::array<PairPowers, 4> products{};
  std::array<std::array<double, kOrder>, kOrder> pieces{};
  for (std::size_t function = 0; function < kOrder; ++function) {
    for (std::size_t power = 0; power < kOrder; ++power)
      pieces[function][power] =
          cell.pieces(static_cast<Eigen::Index>(function), static_cast<Eigen::Index>(power));
    pieces[function] = centred(pieces[function]);
  }
  for (std::size_t slope = 0; slope < 4; ++slope) {
    for (std::size_t pair = 0; pair < kPairs; ++pair) {
      std::array<double, kOrder> first = pieces[pair % kOrder];
      std::array<double, kOrder> second = pieces[pair / kOrder];
      if (slope == kFirst || slope == kBoth) first = slopeOf(first);
      if (slope == kSecond || slope == kBoth) second = slopeOf(second);
      for (std::size_t one = 0; one < kOrder; ++one)
        for (std::size_t other = 0; other < kOrder; ++other)
          products[slope][pair][one + other] += first[one] * second[other];
    }
  }
  return products;
}

// Integrals over a cell of products of functions and their derivatives, axis after axis.
class PairIntegrals {
 public:
  PairIntegrals(const CellAxes& cell, const CellMoments& inside)
      : products_{productsOn(*cell[0]), productsOn(*cell[1]), productsOn(*cell[2])} {
    for (std::size_t slope = 0; slope < 4; ++slope)
      for (std::size_t pair = 0; pair < kPairs; ++pair)
        for (std::size_t index = 0; index < kPowers * kPowers; ++index)
          alongX_[slope][pair][index] = dot(products_[0][slope][pair], &inside[index * kPowers]);
  }

  /// Calls add(first, second, integral) for all pairs of functions of the cell, where the slopes
  /// say along which axis each is differentiated.
  template <class Add>
  void forEachPair(const std::array<Derivatives, 3>& slopes, const Add& add) const {
    for (std::size_t x = 0; x < kPairs; ++x) {
      for (std::size_t y = 0; y < kPairs; ++y) {
        Powers left;
        for (std::size_t power = 0; power < kPowers; ++power)
          left[power] = dot(products_[1][slopes[1]][y], &alongX_[slopes[0]][x][power * kPowers]);
        for (std::size_t z = 0; z < kPairs; ++z) {
          const std::size_t first = x % kOrder + kOrder * (y % kOrder + kOrder * (z % kOrder));
          const std::size_t second = x / kOrder + kOrder * (y / kOrder + kOrder * (z / kOrder));
          add(static_cast<Eigen::Index>(first), static_cast<Eigen::Index>(second),
              dot(products_[2][slopes[2]][z], left.data()));
        }
      }
    }
  }

 private:
  static double dot(const Powers& powers, const double* moments) {
    double sum = 0.0;
    for (std::size_t power = 0; power < kPowers; ++power)
      sum += powers[power] * moments[power];
    return sum;
  }

  std::array<std::array<PairPowers, 4>, 3> products_;  // by axis and slopes
  std::array<std::array<std::array<double, kPowers * kPowers>, kPairs>, 4> alongX_;
};

// Which slopes the product of the first's derivative along one axis and the second's along another
// takes.
std::array<Derivatives, 3> slopesOf(std::size_t first, std::size_t second) {
  std::array<Derivatives, 3> slopes{};
  if (first == second) {
    slopes[first] = kBoth;
  } else {
    slopes[first] = kFirst;
    slopes[second] = kSecond;
  }
  return slopes;
}

}  // namespace

ElementMatrices solidElement(const CellAxes& cell, const CellMoments& inside,
                             const Material& material) {
  const Vec3 cellSize(cell[0]->size, cell[1]->size, cell[2]->size);
  const double nu = material.poissonsRatio;
  const double mu = material.youngsModulus / (2.0 * (1.0 + nu));
  const double lambda = 2.0 * mu * nu / (1.0 - 2.0 * nu);
  const double part = cellSize.prod() / 8.0;
  const PairIntegrals integrals(cell, inside);
  ElementMatrices matrices;
  matrices.mass.resize(kCellFunctions, kCellFunctions);
  matrices.stiffness.setZero(kFreedom, kFreedom);
  integrals.forEachPair({kNone, kNone, kNone},
                        [&](Eigen::Index first, Eigen::Index second, double integral) {
                          matrices.mass(first, second) = material.density * part * integral;
                        });
  matrices.pull.setZero(kFreedom);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::array<Derivatives, 3> slopes{};
    slopes[axis] = kFirst;
    const auto along = static_cast<Eigen::Index>(axis);
    const double scale = 2.0 / cellSize[along] * part;
    // The second functions of the pairs have the sum 1.
    integrals.forEachPair(slopes, [&](Eigen::Index first, Eigen::Index, double integral) {
      matrices.pull[3 * first + along] += scale * integral;
    });
  }
  // The strain energy is lambda / 2 (tr e)^2 + mu e:e, with Lame's constants.
  for (std::size_t one = 0; one < 3; ++one) {
    for (std::size_t other = 0; other < 3; ++other) {
      const auto row = static_cast<Eigen::Index>(one);
      const auto column = static_cast<Eigen::Index>(other);
      const double scale = 4.0 / (cellSize[row] * cellSize[column]) * part;
      integrals.forEachPair(
          slopesOf(one, other), [&](Eigen::Index first, Eigen::Index second, double integral) {
            const double product = scale * integral;
            matrices.stiffness(3 * first + row, 3 * second + column) += lambda * product;
            matrices.stiffness(3 * first + column, 3 * second + row) += mu * product;
            if (one != other) return;
            for (Eigen::Index axis = 0; axis < 3; ++axis)
              matrices.stiffness(3 * first + axis, 3 * second + axis) += mu * product;
          });
    }
  }
  return matrices;
}

}  // namespace carom::modal
