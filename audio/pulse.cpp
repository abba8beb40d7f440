#include "audio/pulse.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <mutex>
#include <numbers>
#include <utility>
#include <vector>

#include <Eigen/Dense>

#include "audio/acceleration_noise.h"

namespace carom {
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

struct ContactState {
  double depth = 0.0;
  double rho = 0.0;
};

/// One branch of the contact: from first touch on, or from the last back.
struct Branch {
  double x = 0.0;
  double firstRho = 0.0;
  double direction = 1.0;  ///< of time: 1 or -1

  double approach(double rho) const { return x == 0.0 ? rho : std::expm1(x * rho) / x; }
  double force(const ContactState& state) const {
    return state.depth * std::sqrt(state.depth) * std::exp(x * state.rho);
  }
  /// d/ds with s the square root of the time since the branch began: all is smooth in s.
  ContactState rate(double s, const ContactState& state) const {
    const double step = 2.0 * s * direction;
    return {step * approach(state.rho), -step * state.depth * std::sqrt(state.depth)};
  }
};

/// ln((1 + x) / (1 - e x)) - x (1 + e) without its factor x, and for small x without its factor
/// x^2, by its series: the root at 0 would hide the other one. Either rises through that root.
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

/// Newton's method kept within a bracket: the difference rises with x, from below 0 at 0.
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

/// The branch by its series, for s up to kSeriesEnd: what is left out is below 1e-15.
constexpr double kSeriesEnd = 0.02;

ContactState seriesState(const Branch& branch, double s) {
  const double speed = branch.direction * branch.approach(branch.firstRho);
  const double t = s * s;
  const double fall = 0.4 * speed * std::sqrt(speed) * t * t * s;  // of rho, t^(5/2)
  const double stiffening = std::exp(branch.x * branch.firstRho);
  return {speed * t - stiffening * fall * t * (2.0 / 7.0), branch.firstRho - branch.direction * fall};
}

ContactState along(const ContactState& from, double step, const ContactState& rate) {
  return {from.depth + step * rate.depth, from.rho + step * rate.rho};
}

/// The modified midpoint rule (Gragg 1965) with `count` substeps: its error is even in the substep.
ContactState midpointStep(const Branch& branch, double s, double step, int count,
                          const ContactState& from) {
  const double h = step / count;
  ContactState before = from;
  ContactState state = along(from, h, branch.rate(s, from));
  for (int index = 1; index < count; ++index) {
    const ContactState next = along(before, 2.0 * h, branch.rate(s + index * h, state));
    before = std::exchange(state, next);
  }
  const ContactState last = along(before, h, branch.rate(s + step, state));
  return {0.5 * (state.depth + last.depth), 0.5 * (state.rho + last.rho)};
}

/// A step of eighth order: midpoint rules of 2, 4, 6 and 8 substeps, extrapolated to none.
ContactState extrapolatedStep(const Branch& branch, double s, double step, ContactState from) {
  std::array<ContactState, 4> column;
  for (int row = 0; row < 4; ++row) {
    const auto at = static_cast<std::size_t>(row);
    column[at] = midpointStep(branch, s, step, 2 * (row + 1), from);
    for (int other = row - 1; other >= 0; --other) {
      const double ratio = (row + 1.0) / (other + 1.0);
      const auto to = static_cast<std::size_t>(other);
      const ContactState gain{column[to + 1].depth - column[to].depth,
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
  ContactState state = seriesState(branch, s);
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
const double kHalfReach = std::sqrt(0.5);  // of s, where u = 1/2

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
  ContactState state = seriesState(branch, s);
  for (const double node : HalfTable::sampleNodes()) {
    const double target = node * root;
    if (target > kSeriesEnd) {
      state = extrapolatedStep(branch, s, target - s, state);
      s = target;
    }
    const ContactState there = target > kSeriesEnd ? state : seriesState(branch, target);
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
  static const std::vector<PulseNode> nodes = [] {
    Recurrence legendre{Eigen::VectorXd::Zero(kGridOrder), Eigen::VectorXd(kGridOrder - 1), 2.0};
    for (Eigen::Index k = 1; k < kGridOrder; ++k) {
      const auto order = static_cast<double>(k);
      legendre.beside[k - 1] = order / std::sqrt(4.0 * order * order - 1.0);
    }
    return gaussNodes(legendre);
  }();
  return nodes;
}

/// A fine discrete stand-in for the pulse, u relative to 1/2.
struct Grid {
  std::vector<PulseNode> nodes;

  /// Integrates weight(s) ds over [from, to] in steps, and calls it with s and ds.
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
  for (PulseNode& node : nodes) node.u += 0.5;
  return nodes;
}

// ---- Closed forms ------------------------------------------------------------------------------

constexpr double kGaussianExponent = 10.0;
const double kGaussianPeak = std::sqrt(kGaussianExponent / pi);
const double kGaussianReach = kPulseHalfWidth * std::sqrt(6.0 / kGaussianExponent);
constexpr double kHandOutScale = 0.5 * pi;

double gaussianForce(double u) {
  return kGaussianPeak * std::exp(-kGaussianExponent * (u - 0.5) * (u - 0.5));
}

/// The piecewise cubic of Mitchell and Netravali (1988, eq. 8) with B = C = 1/3.
Jet mitchellNetravali(double x) {
  const double y = std::abs(x);
  const double sign = x < 0.0 ? -1.0 : 1.0;
  if (y >= 2.0) return {};
  if (y < 1.0) {
    return {((7.0 * y - 12.0) * y * y + 16.0 / 3.0) / 6.0, sign * (21.0 * y - 24.0) * y / 6.0};
  }
  const double rest = 2.0 - y;
  return {(5.0 * rest - 3.0) * rest * rest / 18.0, -sign * (5.0 * rest - 2.0) * rest / 6.0};
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
  mutable std::array<std::once_flag, kRules> ruleMade;
  mutable std::array<std::vector<PulseNode>, kRules> rules;

  explicit Model(PulseShape shape);
  explicit Model(const Contact& contact);

  double force(double u) const;
  double slope(double u) const;
  Jet tabulated(double u) const;
  std::vector<PulseNode> grid() const;
  std::vector<PulseNode> makeRule(std::size_t count) const;
  void measure();
};

Jet Pulse::Model::tabulated(double u) const {
  const bool early = u < 0.5;
  const double distance = early ? u : 1.0 - u;
  const double s = std::sqrt(distance);
  const Jet smooth = (early ? rise : fall).at(s);
  const double slope = 0.5 * s * (3.0 * smooth.value + s * smooth.slope);
  return {distance * s * smooth.value, early ? slope : -slope};
}

double Pulse::Model::force(double u) const {
  if (!(u >= begin && u <= end)) return 0.0;
  switch (shape) {
    case PulseShape::hertz:
      return tabulated(u).value;
    case PulseShape::halfSine:
      return 0.5 * pi * std::sin(pi * (u < 0.5 ? u : 1.0 - u));
    case PulseShape::gaussian:
      return gaussianForce(u);
    case PulseShape::mitchellNetravali:
      return 4.0 * mitchellNetravali(4.0 * u - 2.0).value;
    case PulseShape::handOut:
      return kHandOutScale * gaussianPulse(u);
  }
  return 0.0;
}

double Pulse::Model::slope(double u) const {
  if (!(u >= begin && u <= end)) return 0.0;
  switch (shape) {
    case PulseShape::hertz:
      return tabulated(u).slope;
    case PulseShape::halfSine:
      return 0.5 * pi * pi * std::cos(pi * u);
    case PulseShape::gaussian:
      return -2.0 * kGaussianExponent * (u - 0.5) * gaussianForce(u);
    case PulseShape::mitchellNetravali:
      return 16.0 * mitchellNetravali(4.0 * u - 2.0).slope;
    case PulseShape::handOut:
      return kHandOutScale * gaussianPulseSlope(u);
  }
  return 0.0;
}

/// Over [0, 1] in s = sqrt(u) and sqrt(1 - u), where all is smooth between the pieces.
std::vector<PulseNode> Pulse::Model::grid() const {
  Grid grid;
  if (begin < 0.0) {
    grid.add(begin, end, 2 * kPieces, [&](double u, double step) {
      return PulseNode{u - 0.5, force(u) * step};
    });
    return grid.nodes;
  }
  grid.add(0.0, kHalfReach, kPieces, [&](double s, double step) {
    return PulseNode{s * s - 0.5, force(s * s) * 2.0 * s * step};
  });
  grid.add(0.0, kHalfReach, kPieces, [&](double s, double step) {
    return PulseNode{0.5 - s * s, force(1.0 - s * s) * 2.0 * s * step};
  });
  return grid.nodes;
}
std::vector<PulseNode> Pulse::Model::makeRule(std::size_t count) const {
  return gaussRule(grid(), count);
}
void Pulse::Model::measure() {}
Pulse::Model::Model(PulseShape s) : shape(s) {
  if (s == PulseShape::gaussian) { begin = 0.5 - kGaussianReach; end = 0.5 + kGaussianReach; }
  if (s == PulseShape::handOut) { begin = -2.0; end = 3.0;  }
}
Pulse::Model::Model(const Contact& contact) {
  const double duration = contactDuration(contact);
  rise = tabulate(compression(contact), duration, 1.0 + contact.restitution);
  fall = tabulate(rebound(contact), duration, 1.0 + contact.restitution);
}
}
