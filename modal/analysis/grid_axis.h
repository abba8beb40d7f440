#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <Eigen/Core>

namespace carom::modal {

/// A cell along one axis, and the four cubic B-splines that are not zero in it.
struct AxisCell {
  double begin = 0.0;  ///< m
  double size = 0.0;   ///< m
  int first = 0;       ///< number of the first of its four functions
  /// A row for each function: its coefficients in powers of the place along the cell, 0 to 1.
  Eigen::Matrix4d pieces = Eigen::Matrix4d::Zero();
  int kind = 0;  ///< the first cell with the same size and pieces

  /// Returns the four functions at a place along the cell, 0 to 1 or a little beyond, or their
  /// first or second derivatives by the place.
  Eigen::Vector4d at(double place, int derivative = 0) const;
};

/// A line between two cells, or at the end of an axis.
struct AxisLine {
  double at = 0.0;  ///< m
  /// True if functions may have a kink here; elsewhere they have two continuous derivatives.
  bool kinks = false;
};

/// The cells along one axis of a grid and the cubic B-splines on them (de Boor 1978), which go on
/// beyond both ends, so that all of their sum is 1. [any thread]
class GridAxis {
 public:
  GridAxis() = default;
  /// Takes ascending lines, at least two; kinks at the ends have no effect.
  explicit GridAxis(const std::vector<AxisLine>& lines);
  /// Equal cells from 0 to a length in m.
  static GridAxis equal(double length, int cells);

  int cells() const { return static_cast<int>(cells_.size()); }
  int functions() const { return static_cast<int>(middles_.size()); }
  const AxisCell& operator[](int cell) const { return cells_[static_cast<std::size_t>(cell)]; }
  /// Returns the cell that holds a place in m, or the one at the nearer end.
  int cellAt(double place) const;
  /// The place of a function in m: as their coefficients, these make a field that is the place.
  double middle(int function) const { return middles_[static_cast<std::size_t>(function)]; }
  double length() const { return cells_.back().begin + cells_.back().size; }

 private:
  std::vector<AxisCell> cells_;
  std::vector<double> middles_;
};

}  // namespace carom::modal
