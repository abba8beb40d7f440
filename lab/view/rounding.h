#pragma once

#include <cmath>

#include "carom/audio/vector.h"

namespace carom::lab {

/// Returns a number with so many binary digits, so that a page takes fewer bytes.
inline double rounded(double number, int digits) {
  if (!std::isfinite(number) || number == 0.0) return number;
  int exponent = 0;
  const double scaled = std::ldexp(std::frexp(number, &exponent), digits);
  return std::ldexp(std::nearbyint(scaled), exponent - digits);
}

inline void roundVector(Vec3& vector, int digits) {
  for (double& number : vector)
    number = rounded(number, digits);
}

}  // namespace carom::lab
