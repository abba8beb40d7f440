#pragma once

#include <cassert>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>

namespace carom::audio {

/// Number of functions up to an order: (order + 1)^2.
constexpr std::size_t harmonicCount(int order) {
  const auto side = static_cast<std::size_t>(order) + 1;
  return side * side;
}

/// Evaluates the real orthonormal spherical harmonics of the unit direction (x, y, z), all up to
/// `order`, into the first (order + 1)^2 of `values`, in the order l^2 + l + m: m > 0 goes with
/// cos(m phi), m < 0 with sin(|m| phi), no Condon-Shortley phase, so Y_1 is sqrt(3 / (4 pi))
/// (y, z, x).
///
/// It uses the three-term recurrence in l of the fully normalised Legendre functions (Press et al.,
/// Numerical Recipes, 3rd ed., section 6.7), divided by sin^|m| so that only polynomials of x, y
/// and z remain: no angles, and no poles. `Number` is double, or any other type that adds and
/// multiplies, one that differentiates for instance. [any thread; does not allocate]
template <class Number>
void sphericalHarmonics(const Number& x, const Number& y, const Number& z, int order,
                        std::span<Number> values) {
  assert(values.size() >= harmonicCount(order));
  const auto at = [](int l, int m) {
    const int index = l * l + l + m;
    return static_cast<std::size_t>(index);
  };
  Number cosine(1.0);  // sin^m(theta) times cos(m phi)
  Number sine(0.0);
  double sectoral = std::sqrt(0.25 / std::numbers::pi);  // function of l = m, without sin^m(theta)
  for (int m = 0; m <= order; ++m) {
    if (m > 0) {
      const Number before = cosine;
      cosine = x * cosine - y * sine;
      sine = x * sine + y * before;
      sectoral *= std::sqrt((m == 1 ? 2.0 : 1.0) * (2.0 * m + 1.0) / (2.0 * m));
    }
    Number below(0.0);
    Number legendre(sectoral);
    double scaleBelow = 0.0;
    for (int l = m; l <= order; ++l) {
      values[at(l, m)] = legendre * cosine;
      if (m > 0) values[at(l, -m)] = legendre * sine;
      const double up = l + 1.0;
      const double scale = std::sqrt((4.0 * up * up - 1.0) / (up * up - double(m) * m));
      const Number next = scale * (z * legendre - scaleBelow * below);
      below = legendre;
      legendre = next;
      scaleBelow = 1.0 / scale;
    }
  }
}

}  // namespace carom::audio
