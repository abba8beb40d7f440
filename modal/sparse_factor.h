#pragma once

#include <memory>

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include "carom/audio/result.h"

namespace carom::modal {

/// Square, symmetric, both halves stored.
using SparseMatrix = Eigen::SparseMatrix<double>;

/// What is known of a symmetric matrix before it is factorised.
enum class Definiteness {
  kPositive,    ///< no pivoting: the fastest
  kIndefinite,  ///< pivoted where the library can (MUMPS); its inertia is what is asked of it
};

/// L D L^T of a sparse symmetric matrix, by MUMPS (multifrontal; Amestoy, Duff, L'Excellent, Koster
/// 2001) or, in a build without it, by Eigen's SimplicialLDLT, which does not pivot and is slower
/// by more than ten times at 20 000 rows. One thread, and the same bits from the same matrix each
/// time. [one thread at a time]; several factors may be at work in different threads, in turns.
class SparseFactor {
 public:
  /// Error: a singular matrix, or one that memory does not suffice for.
  static Result<SparseFactor> of(const SparseMatrix& matrix, Definiteness definiteness);

  SparseFactor(SparseFactor&&) noexcept;
  SparseFactor& operator=(SparseFactor&&) noexcept;
  ~SparseFactor();

  /// Puts matrix^-1 block in the place of block. All columns at once cost far less than one by one.
  void solve(Eigen::MatrixXd& block) const;

  /// How many eigenvalues of the matrix are negative, by Sylvester's law of inertia.
  Eigen::Index negative() const;

 private:
  struct Implementation;
  explicit SparseFactor(std::unique_ptr<Implementation> implementation);

  std::unique_ptr<Implementation> implementation_;
};

}  // namespace carom::modal
