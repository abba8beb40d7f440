#pragma once

#include <cmath>

namespace carom::audio {

/// Above 0, and finite: what most quantities of nature have to be. [any thread]
inline bool isPositive(double value) {
  return std::isfinite(value) && value > 0.0;
}

}  // namespace carom::audio
