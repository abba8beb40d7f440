#pragma once

#include <cmath>

namespace carom {

/// In how many substeps after an impact it has been delivered in any case
/// (EventDelivery::complete).
inline int stepsUntilDelivered(double step) {
  constexpr double kLongest = 0.02;  // s; or three substeps, if they are longer
  return 5 + static_cast<int>(std::ceil(kLongest / step));
}

}  // namespace carom
