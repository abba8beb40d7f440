#pragma once

#include <cmath>
#include <version>

namespace carom::audio {

/// I_0, the modified Bessel function of the first kind, by its power series: the sum of
/// (x^2 / 4)^k / k!^2 (Abramowitz and Stegun 9.6.12). All terms are positive, so only the last
/// place is lost; meant for |x| up to some 50. [any thread]
inline double besselI0Series(double x) {
  const double quarter = 0.25 * x * x;
  double term = 1.0;
  double sum = 1.0;
  for (int k = 1; term > 1e-17 * sum; ++k) {
    term *= quarter / (static_cast<double>(k) * k);
    sum += term;
  }
  return sum;
}

/// I_0 by the standard library where it has the function (libc++ lacks it), by the series
/// elsewhere. [any thread]
inline double besselI0(double x) {
#ifdef __cpp_lib_math_special_functions
  return std::cyl_bessel_i(0.0, x);
#else
  return besselI0Series(x);
#endif
}

}  // namespace carom::audio
