#pragma once

#include <cmath>

namespace carom::audio {

/// True if `value` is finite and above 0, as most physical quantities have to be. [any thread]
inline bool isPositive(double value) {
  return std::isfinite(value) && value > 0.0;
}

}  // namespace carom::audio
