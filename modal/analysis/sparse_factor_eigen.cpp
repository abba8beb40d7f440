#include <utility>

#include <Eigen/SparseCholesky>

#include "modal/analysis/sparse_factor.h"

namespace carom::modal {

struct SparseFactor::Implementation {
  Eigen::SimplicialLDLT<SparseMatrix> decomposition;
};

SparseFactor::SparseFactor(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}
SparseFactor::SparseFactor(SparseFactor&&) noexcept = default;
SparseFactor& SparseFactor::operator=(SparseFactor&&) noexcept = default;
SparseFactor::~SparseFactor() = default;

Result<SparseFactor> SparseFactor::of(const SparseMatrix& matrix, Definiteness,
                                      std::span<const int>) {
  auto implementation = std::make_unique<Implementation>();
  implementation->decomposition.compute(matrix);
  if (implementation->decomposition.info() != Eigen::Success)
    return Error{"the matrix is singular"};
  return SparseFactor(std::move(implementation));
}

void SparseFactor::solve(Eigen::MatrixXd& block) const {
  block = implementation_->decomposition.solve(block).eval();
}

Eigen::Index SparseFactor::negative() const {
  return (implementation_->decomposition.vectorD().array() < 0.0).count();
}

}  // namespace carom::modal
