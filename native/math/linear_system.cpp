#include "native/math/linear_system.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace carom::native {

void solveInPlace(std::span<double> matrix, std::span<double> values, double rounding) {
  const std::size_t n = values.size();
  const auto at = [&](std::size_t row, std::size_t column) -> double& {
    return matrix[row * n + column];
  };
  double largest = 0.0;
  for (const double entry : matrix)
    largest = std::max(largest, std::abs(entry));
  std::vector<std::size_t> pivotRow(n, n);  // by column; n if it has none
  std::size_t rank = 0;
  for (std::size_t column = 0; column < n; ++column) {
    std::size_t best = rank;
    for (std::size_t row = rank; row < n; ++row) {
      if (std::abs(at(row, column)) > std::abs(at(best, column))) best = row;
    }
    if (rank == n || std::abs(at(best, column)) <= rounding * largest) continue;
    for (std::size_t k = 0; k < n; ++k)
      std::swap(at(best, k), at(rank, k));
    std::swap(values[best], values[rank]);
    for (std::size_t row = 0; row < n; ++row) {
      if (row == rank) continue;
      const double factor = at(row, column) / at(rank, column);
      if (factor == 0.0) continue;
      for (std::size_t k = column; k < n; ++k)
        at(row, k) -= factor * at(rank, k);
      values[row] -= factor * values[rank];
    }
    pivotRow[column] = rank++;
  }
  std::vector<double> solution(n, 0.0);
  for (std::size_t column = 0; column < n; ++column) {
    if (pivotRow[column] < n)
      solution[column] = values[pivotRow[column]] / at(pivotRow[column], column);
  }
  std::ranges::copy(solution, values.begin());
}

}  // namespace carom::native
