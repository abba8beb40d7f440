#include "modal/analysis/eigen_solver.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Eigenvalues>

namespace carom::modal {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index kBlock = 8;
constexpr Index kGuard = 4;           // modes beyond those wanted, among which to find a gap
constexpr double kGap = 1e-4;         // least relative gap between lambdas in which to count
constexpr double kShiftAside = 1e-7;  // relative step away from a level at which factorising fails
constexpr int kLevelsTried = 3;
constexpr double kShiftShare = 1e-7;  // default -shift, relative to the median of K_ii / M_ii
constexpr int kExtensions = 4;        // most extensions of the space if modes are missing

// Multiplies a few columns at once, row by row: the matrix is read through once for all of them.
MatrixXd product(const SparseMatrix& matrix, const Eigen::Ref<const MatrixXd>& columns) {
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, kBlock, Eigen::RowMajor>;
  MatrixXd products(columns.rows(), columns.cols());
  for (Index from = 0; from < columns.cols(); from += kBlock) {
    const Index width = std::min(kBlock, columns.cols() - from);
    Rows rows = Rows::Zero(columns.rows(), kBlock);
    rows.leftCols(width) = columns.middleCols(from, width);
    Rows sums = Rows::Zero(columns.rows(), kBlock);
    for (Index column = 0; column < matrix.outerSize(); ++column)
      for (SparseMatrix::InnerIterator entry(matrix, column); entry; ++entry)
        sums.row(entry.row()) += entry.value() * rows.row(column);
    products.middleCols(from, width) = sums.leftCols(width);
  }
  return products;
}

// An orthonormal basis in the inner product of M, its first columns with known images under Op:
// Op basis[processed] = basis * projection.
class KrylovSpace {
 public:
  KrylovSpace(const SparseFactor& factor, const SparseMatrix& mass)
      : factor_(factor), mass_(mass), basis_(mass.rows(), 0) {}

  Index size() const { return size_; }
  Index processed() const { return processed_; }
  Index solves() const { return solves_; }
  bool complete() const { return size_ == mass_.rows(); }

  // Adds new directions: random ones, made smooth by Op, or as they are if no smooth ones are left.
  void extend(Index count) {
    MatrixXd block(mass_.rows(), std::min(count, mass_.rows() - size_));
    for (double& value : block.reshaped())
      value = static_cast<double>(random_() >> 11) * 0x1p-53 - 0.5;
    MatrixXd smooth = block;
    solve(smooth);
    const Index before = size_;
    append(std::move(smooth));
    if (size_ == before) append(std::move(block));
  }

  // Appends the images of the last block as the next one.
  void step() {
    if (processed_ == size_) extend(kBlock);
    const Index from = processed_;
    const Index width = size_ - from;
    MatrixXd block = product(mass_, basis_.middleCols(from, width));
    solve(block);
    processed_ = size_;
    const MatrixXd coefficients = append(std::move(block));
    projection_.conservativeResizeLike(MatrixXd::Zero(size_, processed_));
    projection_.rightCols(width).topRows(coefficients.rows()) = coefficients;
  }

  // Computes the Ritz pairs, largest theta first.
  void solveProjection() {
    const MatrixXd square = projection_.topRows(processed_);
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(0.5 * (square + square.transpose()));
    theta_ = eigen.eigenvalues().reverse();
    small_ = eigen.eigenvectors().rowwise().reverse();
  }
  const VectorXd& theta() const { return theta_; }
  double relativeResidual(Index pair) const {
    const Index rest = size_ - processed_;
    return (projection_.bottomRows(rest) * small_.col(pair)).norm() / theta_[pair];
  }
  MatrixXd vectors(Index count) const {
    return basis_.leftCols(processed_) * small_.leftCols(count);
  }

 private:
  void solve(MatrixXd& block) {
    solves_ += block.cols();
    factor_.solve(block);
  }

  // Orthonormalises the block against the basis and itself, and appends what is left of it. Returns
  // the coefficients of block = basis * coefficients. Two passes are enough (Giraud et al. 2005).
  MatrixXd append(MatrixXd block) {
    const Index width = block.cols();
    MatrixXd coefficients = MatrixXd::Zero(size_, width);
    MatrixXd within = MatrixXd::Identity(width, width);
    for (const double least : {1e-14, 0.1}) {
      const MatrixXd weighted = product(mass_, block);
      const VectorXd norms = weighted.cwiseProduct(block).colwise().sum().cwiseSqrt().transpose();
      const MatrixXd along = basis_.leftCols(size_).transpose() * weighted;
      block.noalias() -= basis_.leftCols(size_) * along;
      coefficients.noalias() += along * within;
      within = (orthonormalise(block, least * norms) * within).eval();
    }
    reserve(size_ + block.cols());
    basis_.middleCols(size_, block.cols()) = block;
    size_ += block.cols();
    coefficients.conservativeResize(size_, width);
    coefficients.bottomRows(block.cols()) = within;
    return coefficients;
  }

  // Gram-Schmidt within the block. Columns of which no more than `least` is left lie in the space
  // already and are dropped. Returns R of block = Q R.
  MatrixXd orthonormalise(MatrixXd& block, const VectorXd& least) const {
    MatrixXd weighted = product(mass_, block);
    MatrixXd triangle = MatrixXd::Zero(block.cols(), block.cols());
    Index kept = 0;
    for (Index column = 0; column < block.cols(); ++column) {
      VectorXd vector = block.col(column);
      VectorXd image = weighted.col(column);
      for (Index other = 0; other < kept; ++other) {
        const double share = weighted.col(other).dot(vector);
        triangle(other, column) = share;
        vector -= share * block.col(other);
        image -= share * weighted.col(other);
      }
      const double norm = std::sqrt(std::max(0.0, vector.dot(image)));
      if (!(norm > least[column])) continue;
      block.col(kept) = vector / norm;
      weighted.col(kept) = image / norm;
      triangle(kept++, column) = norm;
    }
    block.conservativeResize(Eigen::NoChange, kept);
    return triangle.topRows(kept);
  }

  void reserve(Index columns) {
    if (columns > basis_.cols())
      basis_.conservativeResize(mass_.rows(), std::max(columns, basis_.cols() * 3 / 2));
  }

  const SparseFactor& factor_;
  const SparseMatrix& mass_;
  std::mt19937_64 random_{20240607};
  MatrixXd basis_;
  MatrixXd projection_;
  VectorXd theta_;
  MatrixXd small_;
  Index size_ = 0;
  Index processed_ = 0;
  Index solves_ = 0;
};

// One search for the lowest modes: its input, its state and its result.
class Search {
 public:
  Search(const SparseMatrix& stiffness, const SparseMatrix& mass, const EigenSettings& settings,
         const Progress& progress)
      : stiffness_(stiffness), mass_(mass), settings_(settings), progress_(progress) {
    shift_ = settings.shift.value_or(usualShift());
    wanted_ = std::min(settings.modes, mass.rows());
  }

  Result<EigenSolution> run() {
    if (const Status counted = countBelowHighest(); !counted) return counted.error();
    if (wanted_ == 0) return solution_;
    if (!report("factorisation", 0.1)) return Error{kCancelled};
    const Result<SparseFactor> factor = factorOf(shift_, Definiteness::kPositive);
    if (!factor) return factor.error();
    if (settings_.load.size() > 0) {
      MatrixXd moved = settings_.load;
      factor->solve(moved);
      solution_.displacement = moved.col(0);
      solution_.shift = shift_;
    }
    KrylovSpace space(*factor, mass_);
    space.extend(kBlock);
    Index least = 2 * sought();
    for (int extension = 0; extension <= kExtensions; ++extension) {
      if (const Status status = converge(space, least); !status) return status.error();
      if (const Status status = check(space); !status) return status.error();
      if (solution_.counted || !settings_.count || space.complete()) break;
      space.extend(2 * kBlock);
      least = space.size() + 2 * kBlock;
    }
    finish(space);
    return std::move(solution_);
  }

 private:
  double usualShift() const {
    VectorXd ratios = stiffness_.diagonal().cwiseQuotient(mass_.diagonal());
    double* const middle = ratios.data() + ratios.size() / 2;
    std::nth_element(ratios.data(), middle, ratios.data() + ratios.size());
    return *middle > 0.0 ? -kShiftShare * *middle : -1.0;
  }

  bool report(const char* stage, double fraction) const {
    return !progress_ || progress_(stage, fraction);
  }

  Result<SparseFactor> factorOf(double shift, Definiteness definiteness) {
    ++solution_.factorisations;
    return SparseFactor::of(stiffness_ - shift * mass_, definiteness, settings_.order);
  }

  // Counts the lambdas below a level, or below one a little above it, if a pivot vanishes just
  // there.
  Result<Index> countBelow(double level) {
    Result<SparseFactor> factor = factorOf(level, Definiteness::kIndefinite);
    for (int attempt = 1; !factor && attempt < kLevelsTried; ++attempt)
      factor =
          factorOf(level + attempt * kShiftAside * (level - shift_), Definiteness::kIndefinite);
    if (!factor) return factor.error();
    return factor->negative();
  }

  Status countBelowHighest() {
    if (!std::isfinite(settings_.highest)) return Status(std::monostate{});
    if (!report("count of modes", 0.0)) return Error{kCancelled};
    const Result<Index> counted = countBelow(settings_.highest);
    if (!counted) return counted.error();
    solution_.below = *counted;
    wanted_ = std::min(wanted_, *solution_.below);
    return Status(std::monostate{});
  }

  double lambda(double theta) const { return shift_ + 1.0 / theta; }

  // Number of modes that are sought: with the guard, unless there are no more below the highest.
  Index sought() const {
    const Index most = solution_.below == wanted_ ? wanted_ : wanted_ + kGuard;
    return std::min(most, mass_.rows());
  }

  Index converged(const KrylovSpace& space) const {
    Index count = 0;
    while (count < space.processed() && space.relativeResidual(count) <= settings_.tolerance)
      ++count;
    return count;
  }

  // Extends the space to `least` vectors, and then until the modes that are sought have converged.
  Status converge(KrylovSpace& space, Index least) {
    const auto done = [&] { return space.processed() == mass_.rows(); };
    for (Index next = least;; next = space.processed() + space.processed() / 12 + kBlock) {
      while (space.processed() < next && !done()) {
        if (!reportModes(space)) return Error{kCancelled};
        space.step();
      }
      space.solveProjection();
      if (converged(space) >= sought() || done()) return Status(std::monostate{});
    }
  }

  // Reports progress. The number of vectors that it will take is not known; usually four for each
  // mode do.
  bool reportModes(const KrylovSpace& space) const {
    const double most = 4.0 * static_cast<double>(sought());
    return report("modes", 0.2 + 0.7 * std::min(1.0, static_cast<double>(space.size()) / most));
  }

  // Counts in the first gap at or after the last wanted mode, or else in the last before it; the
  // guard may lie within one multiple lambda, which is then left uncounted.
  Status check(const KrylovSpace& space) {
    if (solution_.below == wanted_) {
      solution_.counted = lambda(space.theta()[wanted_ - 1]) <= settings_.highest;
      return Status(std::monostate{});
    }
    if (!settings_.count) return Status(std::monostate{});
    if (!report("count of modes", 0.9)) return Error{kCancelled};
    const auto [count, at] = gap(space);
    const Result<Index> counted = countBelow(at);
    if (!counted) return counted.error();
    solution_.counted = *counted == count;
    return Status(std::monostate{});
  }

  std::pair<Index, double> gap(const KrylovSpace& space) const {
    const auto level = [&](Index mode) { return lambda(space.theta()[mode]); };
    const Index last = sought();
    if (last == mass_.rows()) return {last, 2.0 * level(last - 1) - shift_};
    for (Index count = wanted_; count < last; ++count)
      if (level(count) - level(count - 1) > kGap * (level(count) - shift_))
        return {count, 0.5 * (level(count) + level(count - 1))};
    Index count = wanted_ - 1;
    while (count > 0 && level(count) - level(count - 1) <= kGap * (level(count) - shift_))
      --count;
    return {count, count > 0 ? 0.5 * (level(count) + level(count - 1)) : shift_};
  }

  void finish(const KrylovSpace& space) {
    solution_.solves = space.solves();
    solution_.vectors = space.vectors(wanted_);
    solution_.lambda = shift_ + space.theta().head(wanted_).array().inverse();
    const MatrixXd weighted = product(mass_, solution_.vectors);
    const MatrixXd forces = product(stiffness_, solution_.vectors);
    for (Index mode = 0; mode < wanted_; ++mode) {
      const double lambda = solution_.lambda[mode];
      const double rest = (forces.col(mode) - lambda * weighted.col(mode)).norm();
      solution_.residual = std::max(solution_.residual,
                                    rest / (std::max(lambda, -shift_) * weighted.col(mode).norm()));
    }
  }

  const SparseMatrix& stiffness_;
  const SparseMatrix& mass_;
  const EigenSettings& settings_;
  const Progress& progress_;
  double shift_ = 0.0;
  Index wanted_ = 0;
  EigenSolution solution_;
};

Status validate(const SparseMatrix& stiffness, const SparseMatrix& mass,
                const EigenSettings& settings) {
  const auto size = [](const SparseMatrix& matrix) {
    return std::to_string(matrix.rows()) + " by " + std::to_string(matrix.cols());
  };
  if (stiffness.rows() == 0 || stiffness.rows() != stiffness.cols() ||
      mass.rows() != stiffness.rows() || mass.cols() != mass.rows())
    return Error{"the stiffness is " + size(stiffness) + " and the mass " + size(mass) +
                 "; both must be square, of one size, and not empty"};
  if (!(mass.diagonal().minCoeff() > 0.0))
    return Error{
        "the mass has a diagonal entry that is not positive; it must be positive definite"};
  if (settings.modes < 1)
    return Error{std::to_string(settings.modes) + " modes are asked for; at least 1 must be"};
  if (settings.shift && !(*settings.shift < 0.0)) return Error{"the shift must be negative"};
  if (!(settings.tolerance > 0.0)) return Error{"the tolerance must be positive"};
  return std::monostate{};
}

}  // namespace

Result<EigenSolution> lowestModes(const SparseMatrix& stiffness, const SparseMatrix& mass,
                                  const EigenSettings& settings, const Progress& progress) {
  if (const Status valid = validate(stiffness, mass, settings); !valid)
    return Error{valid.error().message};
  return Search(stiffness, mass, settings, progress).run();
}

}  // namespace carom::modal
