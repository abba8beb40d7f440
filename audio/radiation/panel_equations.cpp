#include "audio/radiation/panel_equations.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace carom::audio {
namespace {

constexpr double kPerSphere = 1.0 / (4.0 * std::numbers::pi);
constexpr double kNear = 2.5;      // longest edges of a panel, within which it is no set of moments
constexpr float kSettled = 1e-4F;  // largest residual, relative to the largest right side
constexpr float kLeastSquare = 1e-30F;  // so that a step that is zero takes no share
constexpr std::size_t kMostRounds = 16;

// Panels as their moments, a panel per element: what the far field of each consists of.
class PanelMoments {
 public:
  explicit PanelMoments(const std::vector<SourcePanel>& panels)
      : centroid_(count(panels), 3),
        normal_(count(panels), 3),
        first_(count(panels), 3),
        second_(count(panels), 3),
        spread_(count(panels)),
        strength_(count(panels)),
        reach_(count(panels)) {
    for (Eigen::Index k = 0; k < spread_.size(); ++k)
      set(k, panels[static_cast<std::size_t>(k)]);
  }

  // Computes the potential and the negative solid angle of each panel at a point, over 4 pi, from
  // the moments; `near` is positive where that does not do.
  void fieldsAt(const Vec3& point) {
    const auto x = centroid_.col(0) - point.x();
    const auto y = centroid_.col(1) - point.y();
    const auto z = centroid_.col(2) - point.z();
    squared_ = x * x + y * y + z * z;
    near = reach_ - squared_;
    inverse_ = squared_.inverse();
    spreads_ = (first_.col(0) * x + first_.col(1) * y + first_.col(2) * z).square();
    spreads_ += (second_.col(0) * x + second_.col(1) * y + second_.col(2) * z).square();
    spreads_ *= inverse_ * inverse_;
    flat_ = spread_ * inverse_;
    potential = strength_ * inverse_.sqrt();
    angle = (normal_.col(0) * x + normal_.col(1) * y + normal_.col(2) * z) * inverse_ * potential *
            (1.0 + 7.5 * spreads_ - 1.5 * flat_);
    potential *= 1.0 + 1.5 * spreads_ - 0.5 * flat_;
  }

  Eigen::ArrayXd potential;
  Eigen::ArrayXd angle;
  Eigen::ArrayXd near;

 private:
  static Eigen::Index count(const std::vector<SourcePanel>& panels) {
    return static_cast<Eigen::Index>(panels.size());
  }

  // The second moments of a triangle per area, about its centroid, are those of two vectors in its
  // plane: a median over 8^(1/2) / (3/2), and the edge it halves over 24^(1/2).
  void set(Eigen::Index k, const SourcePanel& panel) {
    const auto& [a, b, c] = panel.corners();
    const Vec3 median = (c - panel.centroid()) / std::sqrt(8.0);
    const Vec3 edge = (a - b) / std::sqrt(24.0);
    centroid_.row(k) = panel.centroid().transpose();
    normal_.row(k) = panel.normal().transpose();
    first_.row(k) = median.transpose();
    second_.row(k) = edge.transpose();
    spread_[k] = median.squaredNorm() + edge.squaredNorm();
    strength_[k] = panel.area() * kPerSphere;
    const double longest =
        std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
    reach_[k] = kNear * kNear * longest;
  }

  Eigen::ArrayX3d centroid_, normal_, first_, second_;
  Eigen::ArrayXd spread_, strength_, reach_;
  Eigen::ArrayXd squared_, inverse_, spreads_, flat_;
};

// Returns the mean of each four rows.
Eigen::MatrixXd coarsened(const Eigen::MatrixXf& fine) {
  Eigen::MatrixXd coarse(fine.rows() / 4, fine.cols());
  for (Eigen::Index column = 0; column < fine.cols(); ++column)
    for (Eigen::Index row = 0; row < coarse.rows(); ++row)
      coarse(row, column) = 0.25 * static_cast<double>(fine.col(column).segment<4>(4 * row).sum());
  return coarse;
}

// Returns each row four times.
Eigen::MatrixXd refined(const Eigen::MatrixXd& coarse) {
  Eigen::MatrixXd fine(4 * coarse.rows(), coarse.cols());
  for (Eigen::Index column = 0; column < fine.cols(); ++column)
    for (Eigen::Index row = 0; row < coarse.rows(); ++row)
      fine.col(column).segment<4>(4 * row).setConstant(coarse(row, column));
  return fine;
}

// Returns about what the right side would be solved by: its mean over four panels by the coarse
// equations, and what is left by the diagonal, 1/2, as neighbours hardly see it.
Eigen::MatrixXf guessed(const std::optional<CoarseSolution>& coarse, const Eigen::MatrixXf& right) {
  if (!coarse) return 2.0F * right;
  const Eigen::MatrixXd mean = coarsened(right);
  return 2.0F * right + refined(coarse->matrix.solve(mean) - 2.0 * mean).cast<float>();
}

using RowArray = Eigen::Array<float, 1, Eigen::Dynamic>;

RowArray products(const Eigen::MatrixXf& one, const Eigen::MatrixXf& other) {
  return one.cwiseProduct(other).colwise().sum();
}

struct Step {
  Eigen::MatrixXf potential;
  Eigen::MatrixXf right;  // what the potential stands for
  RowArray squared;       // of right, by column

  // Takes the part along an earlier step out of this one.
  void leaveOut(const Step& earlier) {
    const RowArray share = products(right, earlier.right) / earlier.squared;
    potential -= earlier.potential * share.matrix().asDiagonal();
    right -= earlier.right * share.matrix().asDiagonal();
  }
};

}  // namespace

PanelEquations momentEquations(const std::vector<SourcePanel>& panels,
                               const Eigen::MatrixXd& motions) {
  const Eigen::Index count = motions.rows();
  PanelEquations equations{PanelEquations::Matrix(count, count),
                           Eigen::MatrixXd(count, motions.cols())};
  PanelMoments moments(panels);
  for (Eigen::Index row = 0; row < count; ++row) {
    const Vec3& point = panels[static_cast<std::size_t>(row)].centroid();
    moments.fieldsAt(point);
    for (Eigen::Index column = 0; column < count; ++column) {
      if (moments.near[column] <= 0.0) continue;
      const PanelView view =
          panels[static_cast<std::size_t>(column)].viewFrom(point, row == column);
      moments.potential[column] = view.potential * kPerSphere;
      moments.angle[column] = -view.solidAngle * kPerSphere;
    }
    moments.angle[row] = 0.0;
    equations.matrix.row(row) = moments.angle.matrix().transpose().cast<float>();
    equations.matrix(row, row) = static_cast<float>(1.0 - moments.angle.sum());
    equations.right.row(row) = -(moments.potential.matrix().transpose() * motions);
  }
  return equations;
}

std::optional<Eigen::MatrixXd> solvedFrom(const std::optional<CoarseSolution>& coarse,
                                          const PanelEquations& equations) {
  Eigen::MatrixXd potential = coarse ? refined(coarse->potential) : 2.0 * equations.right;
  Eigen::MatrixXf rest = equations.right.cast<float>() - equations.matrix * potential.cast<float>();
  const float settled = kSettled * static_cast<float>(equations.right.colwise().norm().maxCoeff());
  std::vector<Step> steps;
  while (!(rest.colwise().norm().maxCoeff() <= settled)) {
    if (steps.size() == kMostRounds) return std::nullopt;
    Step step{guessed(coarse, rest), {}, {}};
    step.right.noalias() = equations.matrix * step.potential;
    for (const Step& earlier : steps)
      step.leaveOut(earlier);
    step.squared = products(step.right, step.right).max(kLeastSquare);
    const RowArray share = products(rest, step.right) / step.squared;
    potential += (step.potential * share.matrix().asDiagonal()).cast<double>();
    rest -= step.right * share.matrix().asDiagonal();
    steps.push_back(std::move(step));
  }
  return potential;
}

}  // namespace carom::audio
