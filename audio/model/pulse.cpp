#include "audio/model/pulse.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include <Eigen/Dense>

#include "audio/model/acceleration_noise.h"
#include "audio/model/immortal.h"
#include "audio/model/mutex.h"

namespace carom::audio {
namespace {

using std::numbers::pi;

constexpr std::array<std::size_t, 18> kRuleCounts = {2,  3,  4,  5,  6,  8,  10, 12, 16,
                                                     20, 24, 32, 40, 48, 64, 80, 96, 128};
constexpr std::size_t kRules = kRuleCounts.size();

/// A value and its derivative.
struct Jet {
  double value = 0.0;
  double slope = 0.0;
};

// ---- The contact -------------------------------------------------------------------------------

/// Hunt and Crossley's contact with m = K = v0 = 1, in Hamiltonian form. rho = ln(1 + x v) / x
/// instead of the speed v makes it
///
///     d' = (exp(x rho) - 1) / x,    rho' = -d^(3/2),    force = d^(3/2) exp(x rho)
///
/// and rho falls by just 1 + e, which is the impulse too. No difference of nearly equal numbers is
/// left, for any restitution.
struct Contact {
  double restitution = 1.0;
  double x = 0.0;         ///< chi v0
  double firstRho = 1.0;  ///< at first touch
};

struct Indentation {
  double depth = 0.0;
  double rho = 0.0;
};

/// One branch of the contact: from first touch forwards, or from last touch backwards.
struct Branch {
  double x = 0.0;
  double firstRho = 0.0;
  double direction = 1.0;  ///< direction of time: 1 or -1

  double approach(double rho) const { return x == 0.0 ? rho : std::expm1(x * rho) / x; }
  double force(const Indentation& state) const {
    return state.depth * std::sqrt(state.depth) * std::exp(x * state.rho);
  }
  /// d/ds with s the square root of the time since the branch began: all is smooth in s.
  Indentation rate(double s, const Indentation& state) const {
    const double step = 2.0 * s * direction;
    return {step * approach(state.rho), -step * state.depth * std::sqrt(state.depth)};
  }
};

/// Returns ln((1 + x) / (1 - e x)) - x (1 + e) without its factor x, and for small x without its
/// factor x^2, by its series: the root at 0 would hide the other one. Both rise through that other
/// root.
Jet restitutionEquation(double x, double e) {
  constexpr double kSmall = 0.02;
  constexpr int kSeriesTerms = 12;
  if (x > kSmall) {
    const double logs = std::log1p(x) - std::log1p(-e * x);
    return {logs / x - (1.0 + e), (1.0 / (1.0 + x) + e / (1.0 - e * x) - logs / x) / x};
  }
  Jet sum;
  for (int power = kSeriesTerms; power >= 2; --power) {
    const double term = (std::pow(e, power) - (power % 2 == 0 ? 1.0 : -1.0)) / power;
    sum.slope = sum.slope * x + sum.value;
    sum.value = sum.value * x + term;
  }
  return sum;
}

/// Returns the x of a restitution e, by Newton's method kept within a bracket: the difference rises
/// with x, from below 0 at 0.
double solveDissipation(double e) {
  double low = 0.0;
  double high = 1.0 / e;
  double x = 1.5 * (1.0 - e * e) / (1.0 + e * e * e);  // right to second order in 1 - e
  for (int iteration = 0; iteration < 100; ++iteration) {
    if (!(x > low && x < high)) x = 0.5 * (low + high);
    const Jet difference = restitutionEquation(x, e);
    (difference.value < 0.0 ? low : high) = x;
    const double step = difference.value / difference.slope;
    x -= step;
    if (std::abs(step) <= 1e-16 * x) break;
  }
  return x;
}

Contact makeContact(double restitution) {
  const double e = std::clamp(restitution, kLowestRestitution, 1.0);
  if (!(e < 1.0)) return {};
  const double x = solveDissipation(e);
  return {e, x, std::log1p(x) / x};
}

Branch compression(const Contact& contact) {
  return {contact.x, contact.firstRho, 1.0};
}

Branch rebound(const Contact& contact) {
  return {contact.x, contact.firstRho - (1.0 + contact.restitution), -1.0};
}

/// A branch is computed by its series for s up to this: the terms left out are below 1e-15.
constexpr double kSeriesEnd = 0.02;

Indentation seriesState(const Branch& branch, double s) {
  const double speed = branch.direction * branch.approach(branch.firstRho);
  const double t = s * s;
  const double fall = 0.4 * speed * std::sqrt(speed) * t * t * s;  // by which rho falls, t^(5/2)
  const double stiffening = std::exp(branch.x * branch.firstRho);
  return {speed * t - stiffening * fall * t * (2.0 / 7.0),
          branch.firstRho - branch.direction * fall};
}

Indentation along(const Indentation& from, double step, const Indentation& rate) {
  return {from.depth + step * rate.depth, from.rho + step * rate.rho};
}

/// The modified midpoint rule (Gragg 1965) with `count` substeps: its error is even in the substep.
Indentation midpointStep(const Branch& branch, double s, double step, int count,
                         const Indentation& from) {
  const double h = step / count;
  Indentation before = from;
  Indentation state = along(from, h, branch.rate(s, from));
  for (int index = 1; index < count; ++index) {
    const Indentation next = along(before, 2.0 * h, branch.rate(s + index * h, state));
    before = std::exchange(state, next);
  }
  const Indentation last = along(before, h, branch.rate(s + step, state));
  return {0.5 * (state.depth + last.depth), 0.5 * (state.rho + last.rho)};
}

/// A step of eighth order: midpoint rules of 2, 4, 6 and 8 substeps, extrapolated to substeps of
/// length 0.
Indentation extrapolatedStep(const Branch& branch, double s, double step, Indentation from) {
  std::array<Indentation, 4> column;
  for (int row = 0; row < 4; ++row) {
    const auto at = static_cast<std::size_t>(row);
    column[at] = midpointStep(branch, s, step, 2 * (row + 1), from);
    for (int other = row - 1; other >= 0; --other) {
      const double ratio = (row + 1.0) / (other + 1.0);
      const auto to = static_cast<std::size_t>(other);
      const Indentation gain{column[to + 1].depth - column[to].depth,
                             column[to + 1].rho - column[to].rho};
      column[to] = along(column[to + 1], 1.0 / (ratio * ratio - 1.0), gain);
    }
  }
  return column[0];
}

/// Time from a branch's beginning to the deepest point, where rho = 0.
double turningTime(const Branch& branch) {
  constexpr double kStep = 0.02;
  double s = kSeriesEnd;
  Indentation state = seriesState(branch, s);
  while (branch.direction * state.rho > 0.0) {
    state = extrapolatedStep(branch, s, kStep, state);
    s += kStep;
  }
  for (int iteration = 0; iteration < 4; ++iteration) {
    const double step = -state.rho / branch.rate(s, state).rho;
    state = extrapolatedStep(branch, s, step, state);
    s += step;
  }
  return s * s;
}

double contactDuration(const Contact& contact) {
  return turningTime(compression(contact)) + turningTime(rebound(contact));
}

// ---- The table ---------------------------------------------------------------------------------

constexpr std::size_t kPieces = 32;
constexpr std::size_t kTerms = 9;
constexpr double kHalfReach = 0.5 * std::numbers::sqrt2;  // s where u = 1/2

/// force / s^3 over one half of a contact, s the square root of the distance in u from its end: a
/// smooth function, as piecewise polynomials.
class HalfTable {
 public:
  /// `values` at sampleNodes(), ascending.
  explicit HalfTable(std::span<const double> values);
  HalfTable() = default;

  static std::vector<double> sampleNodes();

  Jet at(double s) const {
    const double position = s * kScale;
    const auto piece = std::min(static_cast<std::size_t>(position), kPieces - 1);
    const double local = 2.0 * (position - static_cast<double>(piece)) - 1.0;
    const std::array<double, kTerms>& terms = pieces_[piece];
    Jet jet{terms[kTerms - 1], 0.0};
    for (std::size_t term = kTerms - 1; term-- > 0;) {
      jet.slope = jet.slope * local + jet.value;
      jet.value = jet.value * local + terms[term];
    }
    return {jet.value, jet.slope * 2.0 * kScale};
  }

 private:
  static constexpr double kScale = static_cast<double>(kPieces) * std::numbers::sqrt2;

  std::array<std::array<double, kTerms>, kPieces> pieces_{};
};

double chebyshevNode(std::size_t index) {
  return -std::cos(pi * (static_cast<double>(index) + 0.5) / static_cast<double>(kTerms));
}

std::vector<double> HalfTable::sampleNodes() {
  std::vector<double> nodes;
  nodes.reserve(kPieces * kTerms);
  for (std::size_t piece = 0; piece < kPieces; ++piece) {
    for (std::size_t index = 0; index < kTerms; ++index) {
      nodes.push_back((static_cast<double>(piece) + 0.5 * (chebyshevNode(index) + 1.0)) / kScale);
    }
  }
  return nodes;
}

HalfTable::HalfTable(std::span<const double> values) {
  using Square = Eigen::Matrix<double, kTerms, kTerms>;
  Square powers;
  for (std::size_t row = 0; row < kTerms; ++row) {
    for (std::size_t term = 0; term < kTerms; ++term) {
      powers(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(term)) =
          std::pow(chebyshevNode(row), static_cast<double>(term));
    }
  }
  const Eigen::PartialPivLU<Square> solver(powers);
  for (std::size_t piece = 0; piece < kPieces; ++piece) {
    const Eigen::Map<const Eigen::Matrix<double, kTerms, 1>> samples(values.data() +
                                                                     piece * kTerms);
    Eigen::Map<Eigen::Matrix<double, kTerms, 1>>(pieces_[piece].data()) = solver.solve(samples);
  }
}

/// Half of the pulse of a contact of this duration and impulse, from the branch's end inwards.
HalfTable tabulate(const Branch& branch, double duration, double impulse) {
  std::vector<double> values;
  const double root = std::sqrt(duration);
  double s = kSeriesEnd;
  Indentation state = seriesState(branch, s);
  for (const double node : HalfTable::sampleNodes()) {
    const double target = node * root;
    if (target > kSeriesEnd) {
      state = extrapolatedStep(branch, s, target - s, state);
      s = target;
    }
    const Indentation there = target > kSeriesEnd ? state : seriesState(branch, target);
    values.push_back(branch.force(there) * duration / (impulse * node * node * node));
  }
  return HalfTable(values);
}

// ---- Quadrature --------------------------------------------------------------------------------

/// Three-term recurrence of orthonormal polynomials: the diagonal and the one beside it.
struct Recurrence {
  Eigen::VectorXd diagonal;
  Eigen::VectorXd beside;
  double total = 0.0;  ///< integral of the weight
};

/// Nodes as eigenvalues (Golub and Welsch 1969), weights by Christoffel's sum, which is positive.
std::vector<PulseNode> gaussNodes(const Recurrence& recurrence) {
  Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver;
  solver.computeFromTridiagonal(recurrence.diagonal, recurrence.beside, Eigen::EigenvaluesOnly);
  std::vector<PulseNode> nodes;
  for (const double node : solver.eigenvalues()) {
    double before = 0.0;
    double polynomial = 1.0;
    double sum = 1.0;
    for (Eigen::Index k = 0; k < recurrence.beside.size(); ++k) {
      const double behind = k > 0 ? recurrence.beside[k - 1] * before : 0.0;
      before = std::exchange(polynomial, ((node - recurrence.diagonal[k]) * polynomial - behind) /
                                             recurrence.beside[k]);
      sum += polynomial * polynomial;
    }
    nodes.push_back({node, recurrence.total / sum});
  }
  return nodes;
}

constexpr Eigen::Index kGridOrder = 12;

/// Gauss-Legendre on [-1, 1].
const std::vector<PulseNode>& legendreNodes() {
  static const std::vector<PulseNode>& nodes = audio::immortal([] {
    Recurrence legendre{Eigen::VectorXd::Zero(kGridOrder), Eigen::VectorXd(kGridOrder - 1), 2.0};
    for (Eigen::Index k = 1; k < kGridOrder; ++k) {
      const auto order = static_cast<double>(k);
      legendre.beside[k - 1] = order / std::sqrt(4.0 * order * order - 1.0);
    }
    return gaussNodes(legendre);
  });
  return nodes;
}

/// A fine discrete stand-in for the pulse, u relative to 1/2.
struct Grid {
  std::vector<PulseNode> nodes;

  /// Adds weight(s, ds) at Gauss-Legendre nodes s, with their weights ds, of pieces of [from, to].
  template <class Weight>
  void add(double from, double to, std::size_t pieces, Weight weight) {
    const double half = 0.5 * (to - from) / static_cast<double>(pieces);
    for (std::size_t piece = 0; piece < pieces; ++piece) {
      const double middle = from + half * (2.0 * static_cast<double>(piece) + 1.0);
      for (const PulseNode& node : legendreNodes()) {
        nodes.push_back(weight(middle + half * node.u, half * node.weight));
      }
    }
  }
};

/// Discretised Stieltjes procedure (Gautschi 2004, section 2.2) with full reorthogonalisation.
Recurrence stieltjes(const std::vector<PulseNode>& grid, std::size_t count) {
  const auto size = static_cast<Eigen::Index>(grid.size());
  const auto order = static_cast<Eigen::Index>(count);
  Eigen::VectorXd u(size);
  Eigen::VectorXd mass(size);
  for (Eigen::Index row = 0; row < size; ++row) {
    u[row] = grid[static_cast<std::size_t>(row)].u;
    mass[row] = grid[static_cast<std::size_t>(row)].weight;
  }
  Recurrence recurrence{Eigen::VectorXd(order), Eigen::VectorXd(order - 1), mass.sum()};
  Eigen::MatrixXd basis(size, order);
  basis.col(0).setConstant(1.0 / std::sqrt(recurrence.total));
  for (Eigen::Index k = 0; k < order; ++k) {
    Eigen::VectorXd next = u.cwiseProduct(basis.col(k));
    recurrence.diagonal[k] = next.cwiseProduct(mass).dot(basis.col(k));
    if (k + 1 == order) break;
    const auto known = basis.leftCols(k + 1);
    for (int pass = 0; pass < 2; ++pass) {
      const Eigen::VectorXd shares = known.transpose() * next.cwiseProduct(mass);
      next.noalias() -= known * shares;
    }
    recurrence.beside[k] = std::sqrt(next.cwiseProduct(mass).dot(next));
    basis.col(k + 1) = next / recurrence.beside[k];
  }
  return recurrence;
}

std::vector<PulseNode> gaussRule(const std::vector<PulseNode>& grid, std::size_t count) {
  std::vector<PulseNode> nodes = gaussNodes(stieltjes(grid, count));
  for (PulseNode& node : nodes)
    node.u += 0.5;
  return nodes;
}

// ---- Closed forms ------------------------------------------------------------------------------

constexpr double kGaussianExponent = 10.0;
constexpr double kGaussianPeak = 3.1622776601683795 * std::numbers::inv_sqrtpi;  // sqrt(10 / pi)
constexpr double kGaussianReach = 0.7745966692414834 * kPulseHalfWidth;          // sqrt(6 / 10)
constexpr double kHandOutScale = 0.5 * pi;

double gaussianForce(double u) {
  return kGaussianPeak * std::exp(-kGaussianExponent * (u - 0.5) * (u - 0.5));
}

constexpr double kCubicRoot = 3.0 / 14.0;  ///< contact durations: the cubic is negative before it

/// The piecewise cubic of Mitchell and Netravali (1988, eq. 8) with B = C = 1/3.
Jet mitchellNetravali(double x) {
  const double y = std::abs(x);
  const double sign = x < 0.0 ? -1.0 : 1.0;
  if (y >= 2.0) return {};
  if (y < 1.0) {
    return {((7.0 * y - 12.0) * y * y + 16.0 / 3.0) / 6.0, sign * (21.0 * y - 24.0) * y / 6.0};
  }
  const double rest = 2.0 - y;
  return {(7.0 * rest - 6.0) * rest * rest / 18.0, -sign * (7.0 * rest - 4.0) * rest / 6.0};
}

/// Returns a rule of the cubic, which pulls in its outer parts. Gauss quadrature needs a weight of
/// one sign, so each of the three parts has a rule of its own, the first and last of `outer` nodes.
std::vector<PulseNode> splitRule(const std::vector<PulseNode>& grid, std::size_t count,
                                 std::size_t outer) {
  std::array<std::vector<PulseNode>, 3> parts;
  for (const PulseNode& node : grid) {
    const bool pulls = node.weight < 0.0;
    parts[!pulls ? 1U : node.u < 0.0 ? 0U : 2U].push_back(node);
  }
  const std::array<std::size_t, 3> counts = {outer, count - 2 * outer, outer};
  std::vector<PulseNode> nodes;
  for (std::size_t part = 0; part < parts.size(); ++part) {
    const double sign = part == 1 ? 1.0 : -1.0;
    for (PulseNode& node : parts[part])
      node.weight *= sign;
    for (const PulseNode& node : gaussRule(parts[part], counts[part])) {
      nodes.push_back({node.u, sign * node.weight});
    }
  }
  return nodes;
}

// ---- Limits of the rules ---------------------------------------------------------------------

using Limits = std::array<double, kRules>;

/// Largest bandwidths (rad per contact duration) of each rule at ruleTolerance(), as measured on a
/// raster of 1/16 and rounded down. A skewed pulse is narrower than an even one: what holds for the
/// elastic contact holds for every restitution.
constexpr Limits kHertzLimits = {0.1875, 0.9375, 2.1875, 3.9375, 6.0,    10.75,
                                 16.0,   21.75,  33.75,  46.0,   58.625, 84.8125,
                                 111.75, 139.5,  196.0,  253.5,  312.0,  430.25};
constexpr Limits kHalfSineLimits = {0.125,  0.875, 2.0625, 3.75,  5.75,   10.375,
                                    15.625, 21.25, 33.125, 45.25, 57.875, 84.0,
                                    111.0,  138.5, 195.0,  252.5, 311.0,  429.25};
constexpr Limits kGaussianLimits = {0.125, 0.625,   1.4375, 2.4375,  3.5,    5.75,
                                    8.0,   10.1875, 14.25,  18.0625, 21.75,  29.3125,
                                    36.75, 44.25,   59.375, 74.75,   90.125, 121.25};
constexpr Limits kCubicLimits = {0.25,   0.0,      0.0,      0.0,      0.3125,  2.125,
                                 3.875,  7.5625,   16.0,     28.3125,  37.0625, 56.125,
                                 78.875, 100.3125, 151.4375, 204.9375, 254.875, 363.6875};
constexpr Limits kHandOutLimits = {0.0625, 0.5,     1.0625,  1.8125, 2.6875,  4.4375,
                                   6.125,  7.8125,  10.9375, 13.875, 16.8125, 22.625,
                                   28.5,   34.4375, 46.125,  58.0,   70.0,    94.125};

/// Nodes in each outer part of the cubic that let its rules reach these limits. 0: the rule is not
/// split, as the rule of two for the whole has its nodes within and its weights positive.
constexpr std::array<std::size_t, kRules> kCubicOuter = {0, 1, 1, 1,  2,  2,  3,  3,  4,
                                                         5, 6, 8, 10, 12, 15, 19, 22, 30};

const Limits& limitsOf(PulseShape shape) {
  switch (shape) {
    case PulseShape::halfSine:
      return kHalfSineLimits;
    case PulseShape::gaussian:
      return kGaussianLimits;
    case PulseShape::mitchellNetravali:
      return kCubicLimits;
    case PulseShape::courseGaussian:
      return kHandOutLimits;
    case PulseShape::hertz:
      break;
  }
  return kHertzLimits;
}

/// Largest magnitude of `function` over [begin, end]: sampled, closest at the ends, then refined by
/// golden section.
template <class Function>
double largestMagnitude(double begin, double end, Function function) {
  constexpr int kSamples = 1024;
  constexpr int kRefinements = 45;
  constexpr double kGolden = std::numbers::phi - 1.0;
  const auto at = [&](double sample) {
    const double share = 0.5 - 0.5 * std::cos(pi * std::clamp(sample / kSamples, 0.0, 1.0));
    return std::abs(function(begin + (end - begin) * share));
  };
  double best = 0.0;
  double largest = at(0.0);
  for (int sample = 1; sample <= kSamples; ++sample) {
    const double value = at(sample);
    if (value > largest) best = sample;
    largest = std::max(largest, value);
  }
  double low = best - 1.0;
  double high = best + 1.0;
  for (int step = 0; step < kRefinements; ++step) {
    const double width = kGolden * (high - low);
    const bool later = at(high - width) < at(low + width);
    (later ? low : high) = later ? high - width : low + width;
  }
  return std::max(largest, at(0.5 * (low + high)));
}

}  // namespace

// ---- Pulse -------------------------------------------------------------------------------------

struct Pulse::Model {
  PulseShape shape = PulseShape::hertz;
  double begin = 0.0;
  double end = 1.0;
  double impulse = 1.0;
  double centre = 0.5;
  double peakForce = 0.0;
  double peakSlope = 0.0;
  HalfTable rise;
  HalfTable fall;
  std::vector<PulseEdge> edges;
  mutable OnceFlag tableMade;
  mutable std::vector<ForceTable::Cell> cells;
  mutable std::array<OnceFlag, kRules> ruleMade;
  mutable std::array<std::vector<PulseNode>, kRules> rules;

  explicit Model(PulseShape shape);
  explicit Model(const Contact& contact);

  double force(double u) const;
  double slope(double u) const;
  double hertzForce(double u) const;
  double hertzSlope(double u) const;
  std::vector<double> breaks() const;
  std::vector<PulseNode> grid() const;
  std::vector<PulseNode> makeRule(std::size_t rung) const;
  void findPeaks();
  void findEdges();
  std::vector<ForceTable::Cell> makeCells() const;
};

double Pulse::Model::hertzForce(double u) const {
  const bool early = u < 0.5;
  const double distance = early ? u : 1.0 - u;
  const double s = std::sqrt(distance);
  return distance * s * (early ? rise : fall).at(s).value;
}

double Pulse::Model::hertzSlope(double u) const {
  const bool early = u < 0.5;
  const double s = std::sqrt(early ? u : 1.0 - u);
  const Jet smooth = (early ? rise : fall).at(s);
  const double slope = 0.5 * s * (3.0 * smooth.value + s * smooth.slope);
  return early ? slope : -slope;
}

double Pulse::Model::force(double u) const {
  if (!(u >= begin && u <= end)) return 0.0;
  switch (shape) {
    case PulseShape::hertz:
      return hertzForce(u);
    case PulseShape::halfSine:
      return 0.5 * pi * std::sin(pi * (u < 0.5 ? u : 1.0 - u));
    case PulseShape::gaussian:
      return gaussianForce(u);
    case PulseShape::mitchellNetravali:
      return 4.0 * mitchellNetravali(4.0 * u - 2.0).value;
    case PulseShape::courseGaussian:
      return kHandOutScale * gaussianPulse(u);
  }
  return 0.0;
}

double Pulse::Model::slope(double u) const {
  if (!(u >= begin && u <= end)) return 0.0;
  switch (shape) {
    case PulseShape::hertz:
      return hertzSlope(u);
    case PulseShape::halfSine:
      return 0.5 * pi * pi * std::cos(pi * u);
    case PulseShape::gaussian:
      return -2.0 * kGaussianExponent * (u - 0.5) * gaussianForce(u);
    case PulseShape::mitchellNetravali:
      return 16.0 * mitchellNetravali(4.0 * u - 2.0).slope;
    case PulseShape::courseGaussian:
      return kHandOutScale * gaussianPulseSlope(u);
  }
  return 0.0;
}

/// Returns where the grid's parts must end, in s: for the cubic also where it changes sign and
/// where its pieces meet. A single part is cut into kPieces pieces, which for `hertz` are its
/// table's.
std::vector<double> Pulse::Model::breaks() const {
  if (shape != PulseShape::mitchellNetravali) return {0.0, kHalfReach};
  return {0.0, std::sqrt(kCubicRoot), 0.5, kHalfReach};
}

/// Returns the pulse on a grid: over [0, 1] in s = sqrt(u) and sqrt(1 - u), in which it is smooth
/// within each part; for Gaussians in u.
std::vector<PulseNode> Pulse::Model::grid() const {
  Grid grid;
  if (begin < 0.0) {
    grid.add(begin, end, 2 * kPieces, [&](double u, double step) {
      return PulseNode{u - 0.5, force(u) * step};
    });
    return grid.nodes;
  }
  const std::vector<double> ends = breaks();
  const std::size_t pieces = kPieces / (ends.size() - 1);
  for (std::size_t part = 0; part + 1 < ends.size(); ++part) {
    grid.add(ends[part], ends[part + 1], pieces, [&](double s, double step) {
      return PulseNode{s * s - 0.5, force(s * s) * 2.0 * s * step};
    });
    grid.add(ends[part], ends[part + 1], pieces, [&](double s, double step) {
      return PulseNode{0.5 - s * s, force(1.0 - s * s) * 2.0 * s * step};
    });
  }
  return grid.nodes;
}

std::vector<PulseNode> Pulse::Model::makeRule(std::size_t rung) const {
  const std::size_t outer = shape == PulseShape::mitchellNetravali ? kCubicOuter[rung] : 0;
  if (outer > 0) return splitRule(grid(), kRuleCounts[rung], outer);
  return gaussRule(grid(), kRuleCounts[rung]);
}

void Pulse::Model::findPeaks() {
  peakForce = largestMagnitude(begin, end, [&](double u) { return force(u); });
  peakSlope = largestMagnitude(begin, end, [&](double u) { return slope(u); });
}

Pulse::Model::Model(PulseShape closedForm) : shape(closedForm) {
  assert(shape != PulseShape::hertz);
  if (shape == PulseShape::gaussian || shape == PulseShape::courseGaussian) {
    const double reach = shape == PulseShape::gaussian ? kGaussianReach : kPulseHalfWidth;
    begin = 0.5 - reach;
    end = 0.5 + reach;
  }
  if (shape == PulseShape::courseGaussian) {
    const double root = std::sqrt(6.0);
    impulse = kHandOutScale / (root * std::numbers::inv_sqrtpi) * std::erf(root * kPulseHalfWidth);
  }
  findPeaks();
  findEdges();
}

Pulse::Model::Model(const Contact& contact) {
  const double duration = contactDuration(contact);
  const double momentum = 1.0 + contact.restitution;
  rise = tabulate(compression(contact), duration, momentum);
  fall = tabulate(rebound(contact), duration, momentum);
  // The integral of t m d'' is m (t d' - d) between two times at which d is 0.
  centre = contact.restitution / momentum;
  findPeaks();
  findEdges();
}

void Pulse::Model::findEdges() {
  const auto addEnds = [this](EdgeKind kind, double first, double last) {
    edges.push_back({0.0, kind, first, true});
    edges.push_back({1.0, kind, last, false});
  };
  switch (shape) {
    case PulseShape::hertz:
      addEnds(EdgeKind::root, rise.at(0.0).value, fall.at(0.0).value);
      break;
    case PulseShape::halfSine:
      addEnds(EdgeKind::corner, 0.5 * pi * pi, 0.5 * pi * pi);
      addEnds(EdgeKind::cubic, -pi * pi * pi * pi / 12.0, -pi * pi * pi * pi / 12.0);
      break;
    case PulseShape::mitchellNetravali:
      // At its ends the force is 4 (7 x^3 - 6 x^2) / 18 with x = 4 u; where its pieces meet, the
      // second derivative in x jumps by 4/3 and the third by -28/3, 14 and -28/3.
      addEnds(EdgeKind::parabola, -64.0 / 3.0, -64.0 / 3.0);
      addEnds(EdgeKind::cubic, 896.0 / 9.0, 896.0 / 9.0);
      edges.push_back({0.25, EdgeKind::parabola, 128.0 / 3.0, true});
      edges.push_back({0.25, EdgeKind::cubic, -3584.0 / 9.0, true});
      edges.push_back({0.5, EdgeKind::cubic, 1792.0 / 3.0, true});
      edges.push_back({0.75, EdgeKind::parabola, -128.0 / 3.0, true});
      edges.push_back({0.75, EdgeKind::cubic, -3584.0 / 9.0, true});
      break;
    case PulseShape::gaussian:
    case PulseShape::courseGaussian:
      break;
  }
}

std::vector<ForceTable::Cell> Pulse::Model::makeCells() const {
  constexpr std::size_t kCells = 8192;
  std::vector<ForceTable::Cell> table(kCells);
  const auto at = [this](std::size_t cell) {
    const double share = static_cast<double>(cell) / static_cast<double>(kCells);
    return force(cell == kCells ? end : begin + (end - begin) * share);
  };
  for (std::size_t cell = 0; cell < kCells; ++cell) {
    table[cell].value = static_cast<float>(at(cell));
    table[cell].rise = static_cast<float>(at(cell + 1) - at(cell));
  }
  return table;
}

Pulse::Pulse(std::shared_ptr<const Model> model) : model_(std::move(model)) {}

const Pulse& Pulse::of(PulseShape shape) {
  static const auto& pulses = audio::immortal([] {
    return std::array<Pulse, 5>{Pulse(std::make_shared<const Model>(Contact{})),
                                Pulse(std::make_shared<const Model>(PulseShape::halfSine)),
                                Pulse(std::make_shared<const Model>(PulseShape::gaussian)),
                                Pulse(std::make_shared<const Model>(PulseShape::mitchellNetravali)),
                                Pulse(std::make_shared<const Model>(PulseShape::courseGaussian))};
  });
  return pulses[static_cast<std::size_t>(shape)];
}

Pulse Pulse::dissipativeHertz(double restitution) {
  const Contact contact = makeContact(restitution);
  return contact.x > 0.0 ? Pulse(std::make_shared<const Model>(contact)) : of(PulseShape::hertz);
}

double Pulse::begin() const {
  return model_->begin;
}

double Pulse::end() const {
  return model_->end;
}

double Pulse::force(double u) const {
  return model_->force(u);
}

double Pulse::slope(double u) const {
  return model_->slope(u);
}

double Pulse::impulse() const {
  return model_->impulse;
}

double Pulse::centre() const {
  return model_->centre;
}

double Pulse::peakForce() const {
  return model_->peakForce;
}

double Pulse::peakSlope() const {
  return model_->peakSlope;
}

std::span<const PulseEdge> Pulse::edges() const {
  return model_->edges;
}

ForceTable Pulse::forceTable() const {
  callOnce(model_->tableMade, [this] { model_->cells = model_->makeCells(); });
  const double cells = static_cast<double>(model_->cells.size());
  return {model_->begin, cells / (model_->end - model_->begin), model_->cells};
}

std::span<const std::size_t> Pulse::ruleCounts() {
  return kRuleCounts;
}

std::span<const PulseNode> Pulse::rule(std::size_t count) const {
  const auto found = std::ranges::find(kRuleCounts, count);
  assert(found != kRuleCounts.end());
  if (found == kRuleCounts.end()) return {};
  const auto rung = static_cast<std::size_t>(found - kRuleCounts.begin());
  std::vector<PulseNode>& made = model_->rules[rung];
  callOnce(model_->ruleMade[rung], [&] {
    made = model_->makeRule(rung);
    made.resize(made.size() + kRulePadding);
  });
  return std::span(made).first(made.size() - kRulePadding);
}

std::size_t Pulse::ruleSize(double bandwidth) const {
  const Limits& limits = limitsOf(model_->shape);
  for (std::size_t rung = 0; rung < kRules; ++rung) {
    if (bandwidth <= limits[rung]) return kRuleCounts[rung];
  }
  return 0;
}

double ruleTolerance(double bandwidth) {
  return 1e-7 * std::pow(std::min(1.0, 30.0 / bandwidth), 1.5);
}

double dissipativeLoss(double restitution) {
  return makeContact(restitution).x;
}

double dissipativeDuration(double restitution) {
  static const double elastic = contactDuration(Contact{});
  return contactDuration(makeContact(restitution)) / elastic;
}

}  // namespace carom::audio
