#pragma once

#include <cmath>
#include <version>

#ifndef __cpp_lib_math_special_functions
#include <numbers>

#include <math.h>  // POSIX declares jn and yn here
#endif

namespace carom::test {

// Special functions for oracles: those of the standard library, or, where it has none (libc++),
// recurrences and series with the same definitions.

#ifdef __cpp_lib_math_special_functions

inline double sphericalBessel(unsigned n, double x) {
  return std::sph_bessel(n, x);
}
inline double sphericalNeumann(unsigned n, double x) {
  return std::sph_neumann(n, x);
}
inline double legendrePolynomial(unsigned n, double x) {
  return std::legendre(n, x);
}
inline double sphericalLegendre(unsigned l, unsigned m, double theta) {
  return std::sph_legendre(l, m, theta);
}
inline double besselJ(int order, double x) {
  return std::cyl_bessel_j(order, x);
}
inline double besselY(int order, double x) {
  return std::cyl_neumann(order, x);
}

#else

/// The spherical Bessel function j_n(x) by its series, Abramowitz and Stegun 10.1.2.
inline double sphericalBessel(unsigned n, double x) {
  double term = 1.0;
  for (unsigned k = 1; k <= n; ++k)
    term *= x / (2.0 * k + 1.0);
  double sum = term;
  for (unsigned k = 1; std::abs(term) > 1e-18 * std::abs(sum); ++k) {
    term *= -0.5 * x * x / (k * (2.0 * (n + k) + 1.0));
    sum += term;
  }
  return sum;
}

/// The spherical Bessel function y_n(x) by Abramowitz and Stegun 10.1.19, upwards, the stable
/// direction.
inline double sphericalNeumann(unsigned n, double x) {
  double before = -std::cos(x) / x;
  if (n == 0) return before;
  double now = before / x - std::sin(x) / x;
  for (unsigned k = 1; k < n; ++k) {
    const double next = (2.0 * k + 1.0) / x * now - before;
    before = now;
    now = next;
  }
  return now;
}

inline double legendrePolynomial(unsigned n, double x) {
  double before = 1.0;
  if (n == 0) return before;
  double now = x;
  for (unsigned k = 1; k < n; ++k) {
    const double next = ((2.0 * k + 1.0) * x * now - k * before) / (k + 1.0);
    before = now;
    now = next;
  }
  return now;
}

/// Y_lm(theta, 0) with the Condon-Shortley phase, by the recurrence of normalised functions.
inline double sphericalLegendre(unsigned l, unsigned m, double theta) {
  const double x = std::cos(theta);
  double before = 0.0;
  double now = std::sqrt(0.25 / std::numbers::pi);
  for (unsigned k = 1; k <= m; ++k)
    now *= -std::sqrt((2.0 * k + 1.0) / (2.0 * k)) * std::sin(theta);
  for (unsigned k = m + 1; k <= l; ++k) {
    const double square = static_cast<double>(k) * k - static_cast<double>(m) * m;
    const double a = std::sqrt((4.0 * k * k - 1.0) / square);
    const double earlier = (k - 1.0) * (k - 1.0) - static_cast<double>(m) * m;
    const double b = std::sqrt(earlier / (4.0 * (k - 1.0) * (k - 1.0) - 1.0));
    const double next = a * (x * now - (k == m + 1 ? 0.0 : b * before));
    before = now;
    now = next;
  }
  return now;
}

inline double besselJ(int order, double x) {
  return ::jn(order, x);
}
inline double besselY(int order, double x) {
  return ::yn(order, x);
}

#endif

}  // namespace carom::test
