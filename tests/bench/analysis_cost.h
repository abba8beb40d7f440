#pragma once

#include <cstddef>

namespace carom::bench {

/// What a piece of work took.
struct WorkCost {
  double seconds = 0.0;    ///< CPU time of this thread; infinite: it failed
  double megabytes = 0.0;  ///< of the whole process, at its largest during the work; 0: not known
};

/// 60 elastic modes of a plastic cube of 0.1 m by analyseSolid.
WorkCost cubeAnalysis(std::size_t degreesOfFreedom);

/// The radiation of these 60 modes, once they are known, on at most so many panels.
WorkCost cubeRadiation(std::size_t panels);

}  // namespace carom::bench
