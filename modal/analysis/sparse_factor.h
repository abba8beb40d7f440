#pragma once

#include <memory>
#include <span>

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include "carom/audio/result.h"

namespace carom::modal {

/// A square, symmetric matrix with both halves stored.
using SparseMatrix = Eigen::SparseMatrix<double>;

/// The definiteness of a symmetric matrix, known before it is factorised.
enum class Definiteness {
  kPositive,    ///< no pivoting: the fastest
  kIndefinite,  ///< pivoted if the library can (MUMPS); used for its inertia
};

/// The factors L D L^T of a sparse symmetric matrix, by MUMPS (multifrontal; Amestoy, Duff,
/// L'Excellent, Koster 2001) or, in a build without it, by Eigen's SimplicialLDLT, which does not
/// pivot and is slower by more than ten times at 20 000 rows. One thread, and the same bits from
/// the same matrix each time. [one thread at a time]; several factors may be at work in different
/// threads, in turns.
class SparseFactor {
 public:
  /// Factorises a matrix, its rows eliminated by approximate minimum degree, or in `order` (each
  /// row once; empty: none is known) if that takes fewer operations; Eigen's knows the former only.
  /// Error: it is singular, or memory does not suffice for it.
  static Result<SparseFactor> of(const SparseMatrix& matrix, Definiteness definiteness,
                                 std::span<const int> order = {});

  SparseFactor(SparseFactor&&) noexcept;
  SparseFactor& operator=(SparseFactor&&) noexcept;
  ~SparseFactor();

  /// Replaces `block` by matrix^-1 block. All columns at once cost far less than one by one.
  void solve(Eigen::MatrixXd& block) const;

  /// Number of negative eigenvalues of the matrix, by Sylvester's law of inertia.
  Eigen::Index negative() const;

 private:
  struct Implementation;
  explicit SparseFactor(std::unique_ptr<Implementation> implementation);

  std::unique_ptr<Implementation> implementation_;
};

}  // namespace carom::modal
