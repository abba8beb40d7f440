#pragma once

#include <cstddef>
#include <span>

namespace carom::native {

/// Solves A x = b in place by Gaussian elimination with pivoting: `matrix` (row by row,
/// overwritten) and `values` (b, then x) of n^2 and n numbers. Where a column has no pivot above
/// `rounding` times the largest entry, the equations are dependent, and the x of this column is 0.
/// The order of operations is fixed, so the bits are the same everywhere. [any thread]
void solveInPlace(std::span<double> matrix, std::span<double> values, double rounding = 1e-13);

}  // namespace carom::native
