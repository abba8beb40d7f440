#pragma once

#include <cmath>

namespace carom {

/// Returns the number of substeps after an impact by which it has been delivered in any case
/// (EventDelivery::complete).
inline int stepsUntilDelivered(double step) {
  constexpr double kLongest = 0.02;  // s, or three substeps if they are longer
  return 5 + static_cast<int>(std::ceil(kLongest / step));
}

}  // namespace carom
