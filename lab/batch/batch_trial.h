#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "lab/batch/batch_plan.h"

#include "carom/audio/result.h"

namespace carom::lab {

/// The cost of some samples of a batch, and how they fared.
struct BatchTrial {
  std::size_t tried = 0;
  double seconds = 0.0;  ///< s of one processor, for all branches of a sample, in the median
  double bytes = 0.0;    ///< of all files of a sample, in the mean
  std::vector<std::string> warnings;
};

/// Makes some samples, evenly spread over a plan, in a temporary folder. The models that they need
/// are computed and kept, so that later runs are faster. Warnings say which failed, which are
/// silent or beyond full scale, and how many attempts were rejected. An error is one of the disk.
/// [one thread]
Result<BatchTrial> tryBatch(const BatchPlan& plan,
                            const std::function<void(double share)>& progress);

}  // namespace carom::lab
