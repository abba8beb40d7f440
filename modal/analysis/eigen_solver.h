#pragma once

#include <limits>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "carom/audio/result.h"
#include "carom/modal/analysis_settings.h"
#include "modal/analysis/sparse_factor.h"

namespace carom::modal {

/// The modes of K phi = lambda M phi that are sought, and their accuracy.
struct EigenSettings {
  Eigen::Index modes = 66;  ///< number of lowest modes, rigid ones (lambda = 0) included
  /// Largest lambda that is sought, rad^2/s^2. If it is finite, one factorisation more counts all
  /// modes below it.
  double highest = std::numeric_limits<double>::infinity();
  /// Largest residual of each mode: |Op v - theta v| / theta, Op = (K - shift M)^-1 M. The relative
  /// error of lambda is its square over the relative distance to the next lambda.
  double tolerance = 1e-6;
  /// Shift in rad^2/s^2, negative; best about as large as the lowest lambda that is not 0. If
  /// absent: -1e-7 times the median of K_ii / M_ii.
  std::optional<double> shift;
  /// Forces (N), of which EigenSolution::displacement is to be found; empty: none.
  Eigen::VectorXd load = {};
  /// An order of the rows, each once, in which little may fill when they are eliminated
  /// (SparseFactor::of); empty: none is known.
  std::vector<int> order = {};
  /// If true, Sylvester's law of inertia proves that no mode is missing: one factorisation more.
  bool count = true;
};

struct EigenSolution {
  Eigen::VectorXd lambda;   ///< rad^2/s^2, ascending; those of rigid modes are rounding
  Eigen::MatrixXd vectors;  ///< 1/sqrt(kg), a column for each: phi^T M phi = 1
  /// Number of lambdas up to `highest`, by inertia; more than found if `modes` was less. Empty if
  /// they were not counted.
  std::optional<Eigen::Index> below;
  /// True if the inertia says that no lower mode than the last was missed; false, too, if not asked
  /// for.
  bool counted = false;
  /// m: (K - shift M)^-1 load, and that shift (rad^2/s^2).
  Eigen::VectorXd displacement;
  double shift = 0.0;
  double residual = 0.0;    ///< worst |K v - lambda M v| / (max(lambda, -shift) |M v|)
  Eigen::Index solves = 0;  ///< number of right-hand sides
  Eigen::Index factorisations = 0;
};

/// Finds the lowest modes of K phi = lambda M phi, K symmetric and positive semidefinite, M
/// symmetric and positive definite (it may be diagonal).
///
/// Block Lanczos (Golub and Underwood 1977) on (K - shift M)^-1 M, which is symmetric in the inner
/// product of M (Ericsson and Ruhe 1980), with full reorthogonalisation, no restart, and the whole
/// projection kept, so that the space may be extended by new random vectors at any time. Blocks are
/// used because a factor is read from memory once for all columns. Memory: about three vectors for
/// each mode sought. A multiplicity beyond the size of the block shows in the count, upon which the
/// space is extended.
///
/// Deterministic: start vectors are of a fixed seed. Errors: sizes that do not match, no mode asked
/// for, a shift that is not negative, a matrix that cannot be factorised, no convergence,
/// cancelled. [any thread], allocates; the factorisation cannot be cancelled half-way.
Result<EigenSolution> lowestModes(const SparseMatrix& stiffness, const SparseMatrix& mass,
                                  const EigenSettings& settings = {},
                                  const Progress& progress = {});

}  // namespace carom::modal
