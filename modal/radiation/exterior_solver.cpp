#include "modal/radiation/exterior_solver.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <utility>

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
constexpr int kMostRounds = 8;          // of refining a solution
constexpr double kLeastGain = 0.25;     // of a round: the next change over the last
constexpr double kNoChange = 1e-10;     // of a solution
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

double distanceTo(const std::vector<SourcePanel>& panels, const Vec3& point) {
  double least = std::numeric_limits<double>::infinity();
  for (const SourcePanel& panel : panels)
    least = std::min(
        least,
        (pointOf(panel.corners(), closestOnTriangle(panel.corners(), point)) - point).norm());
  return least;
}

/// Returns the images of a part, itself first: the axes that each turns round.
std::vector<ExteriorSolver::Mirrors> imagesOf(const ExteriorSolver::Mirrors& mirrors) {
  std::vector<ExteriorSolver::Mirrors> images = {{}};
  for (std::size_t axis = 0; axis < mirrors.size(); ++axis) {
    if (!mirrors[axis]) continue;
    const std::size_t known = images.size();
    for (std::size_t image = 0; image < known; ++image) {
      images.push_back(images[image]);
      images.back()[axis] = true;
    }
  }
  return images;
}

/// Returns a triangle in mirrors, its normal outwards again.
std::array<Vec3, 3> mirrored(std::array<Vec3, 3> corners, const ExteriorSolver::Mirrors& image) {
  for (std::size_t axis = 0; axis < image.size(); ++axis) {
    if (!image[axis]) continue;
    for (Vec3& corner : corners)
      corner[static_cast<Eigen::Index>(axis)] *= -1.0;
    std::swap(corners[1], corners[2]);
  }
  return corners;
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

const Eigen::Matrix3d ExteriorSolver::kPoint = Eigen::Matrix3d::Zero();

std::array<Vec3, 3> ExteriorSolver::nodesOf(const std::array<Vec3, 3>& corners) {
  const Vec3 sixth = (corners[0] + corners[1] + corners[2]) / 6.0;
  return {sixth + 0.5 * corners[0], sixth + 0.5 * corners[1], sixth + 0.5 * corners[2]};
}

ExteriorSolver::ExteriorSolver(const SurfaceMesh& surface, const Mirrors& mirrors)
    : part_(surface.triangles.size()), images_(imagesOf(mirrors)) {
  for (const Mirrors& image : images_)
    for (std::size_t triangle = 0; triangle < surface.triangles.size(); ++triangle)
      addPanel(mirrored(cornersOf(surface, triangle), image), &image == &images_.front());
  findInteriorPoints();
  integrateClosedForms();
}

void ExteriorSolver::addPanel(const std::array<Vec3, 3>& corners, bool hasEquation) {
  panels_.emplace_back(corners);
  nodes_.push_back(nodesOf(corners));
  spread_.emplace_back(Eigen::Matrix3d::Zero());
  for (const Vec3& node : nodes_.back()) {
    const Vec3 out = node - panels_.back().centroid();
    spread_.back() += out * out.transpose() / 3.0;
  }
  if (!hasEquation) return;
  equations_.push_back({nodes_.back().begin(), nodes_.back().end()});
  equations_.back().push_back(panels_.back().centroid());
}

std::vector<double> ExteriorSolver::signsOf(const Parity& parity) const {
  std::vector<double> signs;
  for (const Mirrors& image : images_) {
    double sign = 1.0;
    for (std::size_t axis = 0; axis < image.size(); ++axis)
      if (image[axis]) sign *= parity[axis];
    signs.insert(signs.end(), partSize(), sign);
  }
  return signs;
}

// Takes the first points of a fixed sequence that lie at least a third as deep as the deepest.
void ExteriorSolver::findInteriorPoints() {
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
    inside.push_back({point, distanceTo(panels_, point)});
    depth_ = std::max(depth_, inside.back().depth);
  }
  std::erase_if(inside, [this](const Deep& deep) { return deep.depth < depth_ / 3.0; });
  for (std::size_t point = 0; point < std::min(inside.size(), kInteriorPoints); ++point)
    equations_.push_back({inside[point].point});
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
        if (isOwn(static_cast<std::size_t>(row), static_cast<std::size_t>(column)))
          continue;  // the others vanish in a panel's own plane
        solidAngle_(row, column) += share * field.gradient.dot(panel.normal());
        climb_(row, column) +=
            share * (panel.centroid() - point).dot(panel.normal()) * field.potential;
      }
    }
  }
}

bool ExteriorSolver::usesInteriorPoints(double waveNumber) const {
  return equations_.size() > partSize() && waveNumber * depth_ > 0.75 * kFirstResonance;
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
      if (!isOwn(equation, panel) && distance > 0.0)
        result.dipoles += share * height / distance * rest.slope;
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
  const Eigen::Matrix3d scatter = spread_[panel] + kPointsSpread * spreadOf(equation);
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

// The equations of one parity.
struct ExteriorSolver::Equations {
  const Slopes& slopes;
  std::vector<double> signs;  // of each panel
  Eigen::MatrixXcd matrix;
  Eigen::MatrixXcd right;

  Equations(const Slopes& given, std::vector<double> signsOfPanels, Eigen::Index rows)
      : slopes(given), signs(std::move(signsOfPanels)) {
    matrix.setZero(rows, given.values.rows());
    right.setZero(rows, given.values.cols());
  }

  void add(Eigen::Index row, std::size_t panel, const Influence& here) {
    const double share = signs[panel] / (4.0 * std::numbers::pi);
    const auto column = static_cast<Eigen::Index>(panel) % matrix.cols();
    matrix(row, column) -= share * here.dipoles;
    const Complex layer = share * here.layer;
    for (Eigen::Index field = 0; field < right.cols(); ++field)
      right(row, field) -= layer * slopes.values(column, field);
  }

  Eigen::MatrixXcd solved() {
    const Eigen::Index count = matrix.cols();
    const Eigen::Index inside = matrix.rows() - count;
    matrix.diagonal().array() += 0.5;
    if (inside == 0) return solution([](const auto& whole) { return whole.partialPivLu(); });
    // All points inside together get as much weight as all panels.
    const double weight = std::sqrt(static_cast<double>(count) / static_cast<double>(inside));
    matrix.bottomRows(inside) *= weight;
    right.bottomRows(inside) *= weight;
    return solution([](const auto& whole) { return whole.householderQr(); });
  }

 private:
  // Solves with a factorisation in single precision, which takes half of the time, and improves the
  // solution by its residual: each round gains as many digits as the factorisation has, less those
  // of the matrix's condition. Where it has none left, one in double precision is made after all.
  template <class Factorise>
  Eigen::MatrixXcd solution(const Factorise& factorise) const {
    const double scale = right.cwiseAbs().maxCoeff();
    if (!(scale > 0.0 && std::isfinite(scale)))
      return right.topRows(matrix.cols());  // nothing sounds, or it is no number
    const Eigen::MatrixXcf single = matrix.cast<std::complex<float>>();
    const auto factor = factorise(single);
    Eigen::MatrixXcd left = right / scale;
    Eigen::MatrixXcd found = Eigen::MatrixXcd::Zero(matrix.cols(), right.cols());
    double last = std::numeric_limits<double>::infinity();
    for (int round = 0; round < kMostRounds; ++round) {
      const Eigen::MatrixXcf step = factor.solve(left.cast<std::complex<float>>());
      const Eigen::MatrixXcd more = step.template cast<Complex>();
      const double change = more.norm();
      if (!(change < kLeastGain * last)) break;
      found += more;
      if (change <= kNoChange * found.norm()) return scale * found;
      left = right / scale - matrix * found;
      last = change;
    }
    return factorise(matrix).solve(right);
  }
};

Eigen::VectorXcd ExteriorSolver::solve(double waveNumber, const Eigen::VectorXcd& slope) const {
  assert(images_.size() == 1);
  const Slopes slopes{.parity = {1.0, 1.0, 1.0}, .values = slope};
  return solve(waveNumber, std::span(&slopes, 1)).front();
}

std::vector<Eigen::MatrixXcd> ExteriorSolver::solve(double waveNumber,
                                                    std::span<const Slopes> slopes) const {
  assert(waveNumber >= 0.0);
  const std::size_t rows = usesInteriorPoints(waveNumber) ? equations_.size() : part_;
  std::vector<Equations> equations;
  for (const Slopes& one : slopes)
    equations.emplace_back(one, signsOf(one.parity), static_cast<Eigen::Index>(rows));
  for (std::size_t panel = 0; panel < panels_.size(); ++panel) {
    for (std::size_t row = 0; row < rows; ++row) {
      const Vec3 apart = panels_[panel].centroid() - equations_[row].back();
      const double reach =
          kNear * std::sqrt(std::max(spread_[panel].trace(), spreadOf(row).trace()));
      const Influence here = apart.squaredNorm() < reach * reach
                                 ? influenceNear(waveNumber, row, panel)
                                 : influenceFar(waveNumber, row, panel);
      for (Equations& one : equations)
        one.add(static_cast<Eigen::Index>(row), panel, here);
    }
  }
  std::vector<Eigen::MatrixXcd> fields;
  fields.reserve(equations.size());
  for (Equations& one : equations)
    fields.push_back(one.solved());
  return fields;
}

}  // namespace carom::modal
