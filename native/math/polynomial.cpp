#include "native/math/polynomial.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>

namespace carom::native {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Size of a step of Newton's method, relative to t, after which a zero counts as found.
constexpr double kEnough = 4.0 * std::numeric_limits<double>::epsilon();
constexpr int kNewtonSteps = 12;
constexpr int kMostBisections = 2200;  ///< bisection alone could need so many, over 1e-300 to 1e300

struct Interval {
  double from = 0.0;
  double until = kInfinity;
};

/// Roots in ascending order; at most as many as a polynomial of degree 4 has.
struct Roots {
  std::array<double, 4> at{};
  std::size_t count = 0;

  void add(double root) { at[count++] = root; }
  std::span<const double> all() const { return {at.data(), count}; }
};

/// Value of the polynomial at `t`, by Horner's rule.
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

/// Returns a t beyond `from` and all roots: Fujiwara's bound, with powers of two above it instead
/// of its roots.
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

/// Newton's method from a zero of the polynomial truncated after t^2, which is near if the
/// accelerations matter little yet. If it converges in [low, high], the result does not depend on
/// these bounds.
std::optional<double> newton(std::span<const double> c, double low, double high) {
  const double half = -0.5 * c[1];
  const double discriminant = half * half - c[0] * c[2];
  if (discriminant < 0.0) return std::nullopt;
  const double far = half + std::copysign(std::sqrt(discriminant), half);
  for (double t : {c[0] / far, far / c[2]}) {
    for (int step = 0; step < kNewtonSteps && t >= low && t <= high; ++step) {
      const double next = t - value(c, t) / slope(c, t);
      if (std::abs(next - t) <= kEnough * std::abs(t)) return t;
      t = next;
    }
  }
  return std::nullopt;
}

/// Returns the zero in [low, high]; the signs at the two ends differ.
double refine(std::span<const double> c, double low, double high, bool rising) {
  if (const std::optional<double> found = newton(c, low, high)) return *found;
  double t = 0.5 * (low + high);
  double before = high - low;  // the last step but one
  double last = before;
  for (int step = 0; step < kMostBisections; ++step) {
    const double here = value(c, t);
    if (here == 0.0) return t;
    ((here < 0.0) == rising ? low : high) = t;
    double next = t - here / slope(c, t);
    if (std::abs(next - t) <= kEnough * std::abs(t)) return t;
    // Newton steps must halve every second time; far from the zero they may not.
    const bool slow = !(2.0 * std::abs(next - t) < before);
    if (slow || !(next > low && next < high)) next = 0.5 * (low + high);
    if (next == t || next <= low || next >= high) return t;
    before = last;
    last = std::abs(next - t);
    t = next;
  }
  return t;
}

Roots rootsIn(std::span<const double> c, const Interval& in);

/// Returns the places where the polynomial changes its sign between neighbouring points of a
/// division; between these it must be monotone.
Roots rootsBetween(std::span<const double> c, const Interval& in, const Roots& division) {
  Roots roots;
  double low = in.from;
  const auto look = [&](double high) {
    if (!(high > low)) return;
    const double before = value(c, low);
    const double behind = value(c, high);
    if (before == 0.0) {
      if (roots.count == 0 || roots.at[roots.count - 1] < low) roots.add(low);
    } else if (behind != 0.0 && (before < 0.0) != (behind < 0.0)) {
      roots.add(refine(c, low, high, before < 0.0));
    }
    low = high;
  };
  for (const double high : division.all())
    look(high);
  look(in.until < kInfinity ? in.until : beyond(c, in.from));
  return roots;
}

Roots rootsOfQuadratic(std::span<const double> c, const Interval& in) {
  Roots roots;
  const auto add = [&](double root) {
    if (root > in.from && root < in.until) roots.add(root);
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

Roots rootsIn(std::span<const double> c, const Interval& in) {
  if (c.size() == 3) return rootsOfQuadratic(c, in);
  std::array<double, 4> derivative{};
  for (std::size_t i = 1; i < c.size(); ++i)
    derivative[i - 1] = static_cast<double>(i) * c[i];
  return rootsBetween(c, in, rootsIn({derivative.data(), c.size() - 1}, in));
}

/// True if a cheap bound shows that the polynomial stays above zero.
bool staysAbove(const Quartic& c, double from, double until) {
  if (from != 0.0 || !(until < kInfinity)) return false;
  const auto least = [](double coefficient) { return std::min(coefficient, 0.0); };
  const double lowest =
      c[0] +
      until * (least(c[1]) + until * (least(c[2]) + until * (least(c[3]) + until * least(c[4]))));
  return lowest > 0.0;
}

}  // namespace

double firstFall(const Quartic& polynomial, double from, double until) noexcept {
  if (staysAbove(polynomial, from, until)) return kInfinity;
  const Interval in{from, until};
  std::array<double, 4> derivative{};
  for (std::size_t i = 1; i < polynomial.size(); ++i)
    derivative[i - 1] = static_cast<double>(i) * polynomial[i];
  const Roots turns = rootsIn(derivative, in);
  double low = from;
  double before = value(polynomial, low);
  for (std::size_t i = 0; i <= turns.count; ++i) {
    const double end = until < kInfinity ? until : beyond(polynomial, from);
    const double high = i < turns.count ? turns.at[i] : end;
    if (!(high > low)) continue;
    const double behind = value(polynomial, high);
    if (before >= 0.0 && behind < 0.0)
      return before == 0.0 ? low : refine(polynomial, low, high, false);
    low = high;
    before = behind;
  }
  return kInfinity;
}

}  // namespace carom::native
