#include "native/polynomial.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>

namespace carom {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kMostSteps = 2200;  ///< bisection alone could need them, from 1e300 to 1e-300

/// In ascending order; at most as many as a polynomial of degree 4 has.
struct Roots {
  std::array<double, 4> at{};
  std::size_t count = 0;

  void add(double root) { at[count++] = root; }
  std::span<const double> all() const { return {at.data(), count}; }
};

double value(std::span<const double> c, double t) {
  double sum = 0.0;
  for (std::size_t i = c.size(); i-- > 0;)
    sum = sum * t + c[i];
  return sum;
}

double slope(std::span<const double> c, double t) {
  double sum = 0.0;
  for (std::size_t i = c.size(); i-- > 1;)
    sum = sum * t + static_cast<double>(i) * c[i];
  return sum;
}

/// A t beyond `from` and all roots: Fujiwara's bound, without its roots a power of two above it.
double beyond(std::span<const double> c, double from) {
  std::size_t degree = c.size() - 1;
  while (degree > 0 && c[degree] == 0.0)
    --degree;
  double reach = 0.0;
  for (std::size_t i = 0; i < degree; ++i) {
    const double ratio = std::abs(c[i] / c[degree]);
    // 2 ratio^(1 / (degree - i)), rounded up to a power of two.
    if (ratio > 0.0)
      reach = std::max(reach, std::ldexp(1.0, std::clamp(std::ilogb(ratio), -1000, 1000) /
                                                      static_cast<int>(degree - i) +
                                                  3));
  }
  const double far = 2.0 * std::max(reach, std::abs(from));
  return far > 0.0 ? far : 1.0;
}

/// The zero in [low, high], at whose ends the signs differ.
double refine(std::span<const double> c, double low, double high) {
  const bool rising = value(c, low) < 0.0;
  double t = 0.5 * (low + high);
  for (int step = 0; step < kMostSteps; ++step) {
    const double here = value(c, t);
    if (here == 0.0) return t;
    ((here < 0.0) == rising ? low : high) = t;
    const double newton = t - here / slope(c, t);
    const double next = newton > low && newton < high ? newton : 0.5 * (low + high);
    if (next == t || next <= low || next >= high) return t;
    t = next;
  }
  return t;
}

Roots rootsAbove(std::span<const double> c, double from);

/// Where the polynomial changes its sign between neighbouring points of a division on which it is
/// monotone.
Roots rootsBetween(std::span<const double> c, double from, const Roots& division) {
  Roots roots;
  double low = from;
  const auto look = [&](double high) {
    if (!(high > low)) return;
    const double before = value(c, low);
    const double behind = value(c, high);
    if (before == 0.0) {
      if (roots.count == 0 || roots.at[roots.count - 1] < low) roots.add(low);
    } else if (behind != 0.0 && (before < 0.0) != (behind < 0.0)) {
      roots.add(refine(c, low, high));
    }
    low = high;
  };
  for (const double high : division.all())
    look(high);
  look(beyond(c, from));
  return roots;
}

Roots rootsOfQuadratic(std::span<const double> c, double from) {
  Roots roots;
  const auto add = [&](double root) {
    if (root > from && std::isfinite(root)) roots.add(root);
  };
  const double half = -0.5 * c[1];
  if (c[2] == 0.0) {
    if (c[1] != 0.0) add(-c[0] / c[1]);
    return roots;
  }
  const double discriminant = half * half - c[0] * c[2];
  if (discriminant < 0.0) return roots;
  const double far = half + std::copysign(std::sqrt(discriminant), half);
  if (far == 0.0) return roots;  // a double root at 0, no change of sign
  const double one = far / c[2];
  const double other = c[0] / far;
  add(std::min(one, other));
  if (one != other) add(std::max(one, other));
  return roots;
}

Roots rootsAbove(std::span<const double> c, double from) {
  if (c.size() == 3) return rootsOfQuadratic(c, from);
  std::array<double, 4> derivative{};
  for (std::size_t i = 1; i < c.size(); ++i)
    derivative[i - 1] = static_cast<double>(i) * c[i];
  return rootsBetween(c, from, rootsAbove({derivative.data(), c.size() - 1}, from));
}

}  // namespace

double valueAt(const Quartic& polynomial, double t) noexcept {
  return value(polynomial, t);
}

double firstFall(const Quartic& polynomial, double from) noexcept {
  std::array<double, 4> derivative{};
  for (std::size_t i = 1; i < polynomial.size(); ++i)
    derivative[i - 1] = static_cast<double>(i) * polynomial[i];
  const Roots turns = rootsAbove(derivative, from);
  double low = from;
  for (std::size_t i = 0; i <= turns.count; ++i) {
    const double high = i < turns.count ? turns.at[i] : beyond(polynomial, from);
    if (!(high > low)) continue;
    const double before = value(polynomial, low);
    if (before >= 0.0 && value(polynomial, high) < 0.0)
      return before == 0.0 ? low : refine(polynomial, low, high);
    low = high;
  }
  return kInfinity;
}

}  // namespace carom
