#pragma once

#include <cstddef>

namespace carom::bench {

/// The cost of a piece of work.
struct WorkCost {
  double seconds = 0.0;    ///< CPU time of this thread; infinite: the work failed
  double megabytes = 0.0;  ///< largest memory of the whole process during the work; 0: not known
};

/// Computes 60 elastic modes of a plastic cube of 0.1 m by analyseSolid, to that accuracy.
WorkCost cubeAnalysis(double accuracy);

/// Computes the radiation of these 60 modes on at most so many panels; their analysis is not
/// counted.
WorkCost cubeRadiation(std::size_t panels);

}  // namespace carom::bench
