#include "native/mechanics/velocity_projection.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "native/math/vector_math.h"

namespace carom::native {
namespace {

constexpr double kSpeedRounding =
    2e-15;  ///< of a speed, relative to the speeds whose difference is taken
constexpr double kProximity = 1e-9;  ///< weight of the proximal term; the diagonals are 1
constexpr int kMostProximalSteps = 100;
constexpr double kWorthwhile = 0.9;  ///< factor by which a step must shrink the residuals at least
constexpr double kSmallestPivot = 1e-20;  ///< pivot that stands for one that rounding took

/// The quadratic programme min y.Q y / 2 + r.y over y >= -y0, around y0, for positive definite Q.
class StrictProgramme {
 public:
  explicit StrictProgramme(std::vector<double> matrix, std::size_t size)
      : size_(size), matrix_(std::move(matrix)), values_(size, 0.0), factor_(size * size, 0.0) {}

  /// Moves values() to the minimum of the programme around their present place, where `residuals`
  /// is the gradient.
  void improve(std::span<const double> residuals);

  std::span<const double> values() const { return values_; }

 private:
  double entry(std::size_t row, std::size_t column) const { return matrix_[row * size_ + column]; }
  bool isFree(std::size_t index) const { return std::ranges::find(free_, index) != free_.end(); }
  void release(std::size_t index);
  void fix(std::size_t from);
  std::vector<double> wanted(std::span<const double> residuals,
                             std::span<const double> start) const;
  bool approachWanted(std::span<const double> wanted);
  std::size_t mostViolated(std::span<const double> residuals, std::span<const double> start) const;

  std::size_t size_;
  std::vector<double> matrix_;
  std::vector<double> values_;
  std::vector<std::size_t> free_;  ///< indices not held at 0, one per row of `factor_`
  std::vector<double> factor_;     ///< Cholesky's factor, its rows `size_` apart
  std::vector<bool> refused_;      ///< indices that rounding would take in and out for ever
};

/// Adds an index to the free ones, and its row to the factor.
void StrictProgramme::release(std::size_t index) {
  const std::size_t row = free_.size();
  double* const own = &factor_[row * size_];
  double pivot = entry(index, index);
  for (std::size_t column = 0; column < row; ++column) {
    const double* const above = &factor_[column * size_];
    double sum = entry(index, free_[column]);
    for (std::size_t k = 0; k < column; ++k)
      sum -= own[k] * above[k];
    own[column] = sum / above[column];
    pivot -= own[column] * own[column];
  }
  own[row] = std::sqrt(std::max(pivot, kSmallestPivot));
  free_.push_back(index);
}

/// Holds at 0 the free indices whose values are 0, from this row of the factor on.
void StrictProgramme::fix(std::size_t from) {
  const std::vector<std::size_t> rest(free_.begin() + static_cast<std::ptrdiff_t>(from),
                                      free_.end());
  free_.resize(from);
  for (const std::size_t index : rest) {
    if (values_[index] > 0.0) release(index);
  }
}

/// Returns the values, in the order of the free indices, at which their gradient is zero.
std::vector<double> StrictProgramme::wanted(std::span<const double> residuals,
                                            std::span<const double> start) const {
  const std::size_t count = free_.size();
  std::vector<double> found(count);
  for (std::size_t row = 0; row < count; ++row) {
    double sum = -residuals[free_[row]];
    for (std::size_t index = 0; index < size_; ++index) {
      if (start[index] != 0.0 && !isFree(index)) sum += entry(free_[row], index) * start[index];
    }
    for (std::size_t k = 0; k < row; ++k)
      sum -= factor_[row * size_ + k] * found[k];
    found[row] = sum / factor_[row * size_ + row];
  }
  for (std::size_t row = count; row-- > 0;) {
    for (std::size_t k = row + 1; k < count; ++k)
      found[row] -= factor_[k * size_ + row] * found[k];
    found[row] /= factor_[row * size_ + row];
  }
  for (std::size_t row = 0; row < count; ++row)
    found[row] += start[free_[row]];
  return found;
}

/// Moves to the wanted values, or as far towards them as none becomes negative; returns true if it
/// got there.
bool StrictProgramme::approachWanted(std::span<const double> wanted) {
  double way = 1.0;
  std::size_t first = free_.size();
  for (std::size_t row = 0; row < free_.size(); ++row) {
    const double value = values_[free_[row]];
    if (wanted[row] > 0.0) continue;
    const double share = value > 0.0 ? value / (value - wanted[row]) : 0.0;
    if (share < way || first == free_.size()) {
      way = std::min(way, share);
      first = row;
    }
  }
  for (std::size_t row = 0; row < free_.size(); ++row) {
    double& value = values_[free_[row]];
    value =
        first == free_.size() ? wanted[row] : std::max(value + way * (wanted[row] - value), 0.0);
  }
  if (first == free_.size()) return true;
  if (way == 0.0) refused_[free_[first]] = true;
  values_[free_[first]] = 0.0;
  std::size_t from = 0;
  while (values_[free_[from]] > 0.0)
    ++from;
  fix(from);
  return false;
}

/// The index held at 0 whose gradient is most negative, so that it would rise; size_ if there is
/// none.
std::size_t StrictProgramme::mostViolated(std::span<const double> residuals,
                                          std::span<const double> start) const {
  double worst = 0.0;
  std::size_t found = size_;
  for (std::size_t index = 0; index < size_; ++index) {
    if (refused_[index] || isFree(index)) continue;
    double gradient = residuals[index];
    double scale = std::abs(residuals[index]);
    for (std::size_t other = 0; other < size_; ++other) {
      const double part = entry(index, other) * (values_[other] - start[other]);
      gradient += part;
      scale = std::max(scale, std::abs(part));
    }
    if (gradient < worst && gradient < -kSpeedRounding * scale) {
      worst = gradient;
      found = index;
    }
  }
  return found;
}

void StrictProgramme::improve(std::span<const double> residuals) {
  const std::vector<double> start = values_;
  refused_.assign(size_, false);
  for (std::size_t round = 0; round <= 3 * size_; ++round) {
    if (!approachWanted(wanted(residuals, start))) continue;
    const std::size_t next = mostViolated(residuals, start);
    if (next == size_) break;
    release(next);
  }
}

/// Opening speed at one contact by an impulse at the other, both in units in which it is 1 for the
/// same contact.
double coupling(const ClusterSystem& system, std::size_t contact, std::size_t other) {
  const ClusterContact& one = system.contacts[contact];
  const ClusterContact& two = system.contacts[other];
  double sum = 0.0;
  if (one.body == two.body) sum += system.inverseMasses[one.body];
  if (one.other == two.other) sum += system.inverseMasses[one.other];
  if (one.body == two.other) sum -= system.inverseMasses[one.body];
  if (one.other == two.body) sum -= system.inverseMasses[one.other];
  if (sum == 0.0) return 0.0;
  return sum * dotInOrder(one.normal, two.normal) /
         std::sqrt(system.compliances[contact] * system.compliances[other]);
}

std::vector<double> couplings(const ClusterSystem& system, std::span<const std::uint32_t> chosen) {
  const std::size_t size = chosen.size();
  std::vector<double> matrix(size * size, 1.0 + kProximity);
  for (std::size_t row = 0; row < size; ++row) {
    for (std::size_t column = 0; column < row; ++column) {
      matrix[row * size + column] = coupling(system, chosen[row], chosen[column]);
      matrix[column * size + row] = matrix[row * size + column];
    }
  }
  return matrix;
}

}  // namespace

ClusterSystem::ClusterSystem(std::span<const ClusterBody> bodies,
                             std::span<const ClusterContact> at)
    : contacts(at) {
  const auto movable = std::ranges::find_if(
      bodies, [](const ClusterBody& body) { return std::isfinite(body.mass); });
  if (movable != bodies.end()) unit = movable->mass;
  for (const ClusterBody& body : bodies) {
    inverseMasses.push_back(std::isfinite(body.mass) ? unit / body.mass : 0.0);
    velocities.push_back(body.velocity);
  }
  for (const ClusterContact& contact : contacts)
    compliances.push_back(inverseMasses[contact.body] + inverseMasses[contact.other]);
}

double ClusterSystem::openingSpeed(std::size_t contact, std::span<const Vec3> at) const {
  const ClusterContact& pair = contacts[contact];
  return dotInOrder(pair.normal, at[pair.body] - at[pair.other]);
}

double ClusterSystem::rounding(std::size_t contact, std::span<const Vec3> at) const {
  const ClusterContact& pair = contacts[contact];
  return kSpeedRounding * (lengthOf(at[pair.body]) + lengthOf(at[pair.other]));
}

void ClusterSystem::push(std::size_t contact, double impulse, std::span<Vec3> at) const {
  const ClusterContact& pair = contacts[contact];
  at[pair.body] += (impulse * inverseMasses[pair.body]) * pair.normal;
  at[pair.other] -= (impulse * inverseMasses[pair.other]) * pair.normal;
}

std::vector<double> projectionImpulses(const ClusterSystem& system,
                                       std::span<const std::uint32_t> chosen) {
  const std::size_t size = chosen.size();
  if (size == 1) {
    const double opening = system.openingSpeed(chosen[0]);
    return {std::max(-opening / system.compliances[chosen[0]], 0.0)};
  }
  StrictProgramme programme(couplings(system, chosen), size);
  std::vector<double> residuals(size);
  std::vector<double> impulses(size, 0.0);
  std::vector<Vec3> velocities;
  double before = std::numeric_limits<double>::infinity();
  for (int step = 0; step < kMostProximalSteps; ++step) {
    velocities = system.velocities;
    for (std::size_t index = 0; index < size; ++index)
      system.push(chosen[index], impulses[index], velocities);
    double worst = 0.0;
    for (std::size_t index = 0; index < size; ++index) {
      const double opening = system.openingSpeed(chosen[index], velocities);
      residuals[index] = opening / std::sqrt(system.compliances[chosen[index]]);
      if (impulses[index] > 0.0 || opening < 0.0)
        worst = std::max(worst, std::abs(residuals[index]));
    }
    if (worst == 0.0 || (step > 1 && worst > kWorthwhile * before)) break;
    before = worst;
    programme.improve(residuals);
    for (std::size_t index = 0; index < size; ++index)
      impulses[index] = programme.values()[index] / std::sqrt(system.compliances[chosen[index]]);
  }
  return impulses;
}

}  // namespace carom::native
