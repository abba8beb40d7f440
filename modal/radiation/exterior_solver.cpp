#include "modal/radiation/exterior_solver.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

#include <Eigen/LU>
#include <Eigen/QR>

#include "modal/mesh/triangle_points.h"

namespace carom::modal {

using namespace audio;

namespace {

using Complex = std::complex<double>;

constexpr std::size_t kInteriorPoints = 32;
constexpr unsigned kCandidates = 600;
// Distance up to which panels are near, in root mean square radii of the larger panel. It is not a
// round number: on a regular mesh of a thin plate both sides of a panel have to be far, or both
// near, as their difference is what counts.
constexpr double kNear = 8.37;
constexpr double kPointsSpread = 0.75;  // spread of an equation's points, over that of their panel
constexpr double kFirstResonance = std::numbers::pi / 2.0;  // k times the radius of a ball inside

// Returns a number of Halton's sequence, which is even in any number, and the same each time.
double radicalInverse(unsigned number, unsigned base) {
  double result = 0.0;
  double digit = 1.0;
  for (; number > 0; number /= base) {
    digit /= base;
    result += digit * (number % base);
  }
  return result;
}

struct Deep {
  Vec3 point;
  double depth;
};

bool isInside(const std::vector<SourcePanel>& panels, const Vec3& point) {
  double solidAngle = 0.0;
  for (const SourcePanel& panel : panels)
    solidAngle += panel.fieldAt(point).gradient.dot(panel.normal());
  return solidAngle > 2.0 * std::numbers::pi;
}

double distanceTo(const SurfaceMesh& surface, const Vec3& point) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t triangle = 0; triangle < surface.triangles.size(); ++triangle) {
    const std::array<Vec3, 3> corners = cornersOf(surface, triangle);
    least = std::min(least, (pointOf(corners, closestOnTriangle(corners, point)) - point).norm());
  }
  return least;
}

// The rest of exp(-i k r) / r without 1 / r - k^2 r / 2, and of its derivative by r.
struct Remainder {
  Complex value;
  Complex slope;
};

Remainder remainderAt(double waveNumber, double distance) {
  const double z = std::max(waveNumber * distance, 1e-5);  // below it, nothing changes any more
  const double cosine = std::cos(z);
  const double sine = std::sin(z);
  const double less = (cosine - 1.0) / z;
  return {waveNumber * Complex(less + 0.5 * z, -sine / z),
          waveNumber * waveNumber * Complex(0.5 - (sine + less) / z, (sine / z - cosine) / z)};
}

}  // namespace

std::array<Vec3, 3> ExteriorSolver::nodesOf(const std::array<Vec3, 3>& corners) {
  const Vec3 sixth = (corners[0] + corners[1] + corners[2]) / 6.0;
  return {sixth + 0.5 * corners[0], sixth + 0.5 * corners[1], sixth + 0.5 * corners[2]};
}

ExteriorSolver::ExteriorSolver(const SurfaceMesh& surface) {
  for (std::size_t triangle = 0; triangle < surface.triangles.size(); ++triangle) {
    const std::array<Vec3, 3> corners = cornersOf(surface, triangle);
    panels_.emplace_back(corners);
    nodes_.push_back(nodesOf(corners));
    equations_.push_back({nodes_.back().begin(), nodes_.back().end()});
    equations_.back().push_back(panels_.back().centroid());
    spread_.emplace_back(Eigen::Matrix3d::Zero());
    for (const Vec3& node : nodes_.back()) {
      const Vec3 out = node - panels_.back().centroid();
      spread_.back() += out * out.transpose() / 3.0;
    }
  }
  findInteriorPoints(surface);
  integrateClosedForms();
}

// Takes the first points of a fixed sequence that lie at least a third as deep as the deepest.
void ExteriorSolver::findInteriorPoints(const SurfaceMesh& surface) {
  Vec3 low = panels_.front().centroid();
  Vec3 high = low;
  for (const SourcePanel& panel : panels_) {
    low = low.cwiseMin(panel.centroid());
    high = high.cwiseMax(panel.centroid());
  }
  std::vector<Deep> inside;
  for (unsigned number = 1; number <= kCandidates; ++number) {
    const Vec3 share(radicalInverse(number, 2), radicalInverse(number, 3),
                     radicalInverse(number, 5));
    const Vec3 point = low + share.cwiseProduct(high - low);
    if (!isInside(panels_, point)) continue;
    inside.push_back({point, distanceTo(surface, point)});
    depth_ = std::max(depth_, inside.back().depth);
  }
  std::erase_if(inside, [this](const Deep& deep) { return deep.depth < depth_ / 3.0; });
  for (std::size_t point = 0; point < std::min(inside.size(), kInteriorPoints); ++point) {
    equations_.push_back({inside[point].point});
    spread_.emplace_back(Eigen::Matrix3d::Zero());
  }
}

void ExteriorSolver::integrateClosedForms() {
  const auto rows = std::ssize(equations_);
  const auto columns = std::ssize(panels_);
  for (Eigen::MatrixXd* matrix : {&potential_, &solidAngle_, &distance_, &climb_})
    matrix->setZero(rows, columns);
  for (Eigen::Index column = 0; column < columns; ++column) {
    const SourcePanel& panel = panels_[static_cast<std::size_t>(column)];
    for (Eigen::Index row = 0; row < rows; ++row) {
      const std::vector<Vec3>& points = equations_[static_cast<std::size_t>(row)];
      const double share = 1.0 / static_cast<double>(points.size());
      for (const Vec3& point : points) {
        const SourceField field = panel.fieldAt(point);
        potential_(row, column) += share * field.potential;
        distance_(row, column) += share * field.distance;
        if (row == column) continue;  // the others vanish in a panel's own plane
        solidAngle_(row, column) += share * field.gradient.dot(panel.normal());
        climb_(row, column) +=
            share * (panel.centroid() - point).dot(panel.normal()) * field.potential;
      }
    }
  }
}

bool ExteriorSolver::usesInteriorPoints(double waveNumber) const {
  return equations_.size() > panels_.size() && waveNumber * depth_ > 0.75 * kFirstResonance;
}

// The influence of a panel on an equation: the integrals of exp(-i k r) / r and of its derivative
// along n'.
struct ExteriorSolver::Influence {
  Complex layer;
  Complex dipoles;
};

ExteriorSolver::Influence ExteriorSolver::influenceNear(double waveNumber, std::size_t equation,
                                                        std::size_t panel) const {
  const auto row = static_cast<Eigen::Index>(equation);
  const auto column = static_cast<Eigen::Index>(panel);
  const double half = 0.5 * waveNumber * waveNumber;
  Influence result{potential_(row, column) - half * distance_(row, column),
                   -solidAngle_(row, column) - half * climb_(row, column)};
  const std::vector<Vec3>& points = equations_[equation];
  const double share = panels_[panel].area() / (3.0 * static_cast<double>(points.size()));
  for (const Vec3& point : points) {
    const double height = (panels_[panel].centroid() - point).dot(panels_[panel].normal());
    for (const Vec3& node : nodes_[panel]) {
      const double distance = (node - point).norm();
      const Remainder rest = remainderAt(waveNumber, distance);
      result.layer += share * rest.value;
      if (equation != panel) result.dipoles += share * height / distance * rest.slope;
    }
  }
  return result;
}

// Computes the same integrals from the centroids alone: the mean of exp(-i k r) over points that
// scatter with the second moments M differs from its value in the middle by half of the sum of M
// times its second derivatives, of which those of 1 / r alone are in the closed forms.
ExteriorSolver::Influence ExteriorSolver::influenceFar(double waveNumber, std::size_t equation,
                                                       std::size_t panel) const {
  const SourcePanel& source = panels_[panel];
  const Vec3 to = source.centroid() - equations_[equation].back();
  const double reciprocal = 1.0 / to.norm();
  const Vec3 direction = to * reciprocal;
  const Eigen::Matrix3d scatter = spread_[panel] + kPointsSpread * spread_[equation];
  const double along = direction.dot(scatter * direction);
  const Complex mean(1.0 - 0.5 * waveNumber * waveNumber * along,
                     0.5 * waveNumber * reciprocal * (3.0 * along - scatter.trace()));
  const double z = waveNumber * to.norm();
  const Complex wave = mean * Complex(std::cos(z), -std::sin(z));
  const double share = source.area() * reciprocal;
  const double climb = direction.dot(source.normal());
  const auto row = static_cast<Eigen::Index>(equation);
  const auto column = static_cast<Eigen::Index>(panel);
  return {potential_(row, column) + share * (wave - 1.0),
          -solidAngle_(row, column) +
              share * climb * (reciprocal - Complex(reciprocal, waveNumber) * wave)};
}

Eigen::VectorXcd ExteriorSolver::solve(double waveNumber, const Eigen::VectorXcd& slope) const {
  const auto count = std::ssize(panels_);
  assert(waveNumber >= 0.0 && slope.size() == count);
  const bool least = usesInteriorPoints(waveNumber);
  const auto rows = least ? std::ssize(equations_) : count;
  Eigen::MatrixXcd matrix(rows, count);
  Eigen::VectorXcd right = Eigen::VectorXcd::Zero(rows);
  for (Eigen::Index column = 0; column < count; ++column) {
    for (Eigen::Index row = 0; row < rows; ++row) {
      const auto equation = static_cast<std::size_t>(row);
      const auto panel = static_cast<std::size_t>(column);
      const Vec3 apart = panels_[panel].centroid() - equations_[equation].back();
      const double reach =
          kNear * std::sqrt(std::max(spread_[panel].trace(), spread_[equation].trace()));
      const Influence here = apart.squaredNorm() < reach * reach
                                 ? influenceNear(waveNumber, equation, panel)
                                 : influenceFar(waveNumber, equation, panel);
      matrix(row, column) = -here.dipoles / (4.0 * std::numbers::pi);
      right[row] -= here.layer / (4.0 * std::numbers::pi) * slope[column];
    }
    matrix(column, column) += 0.5;
  }
  if (!least) return matrix.partialPivLu().solve(right);
  // All points inside together get as much weight as all panels.
  const double weight = std::sqrt(static_cast<double>(count) / static_cast<double>(rows - count));
  matrix.bottomRows(rows - count) *= weight;
  right.tail(rows - count) *= weight;
  return matrix.householderQr().solve(right);
}

}  // namespace carom::modal
