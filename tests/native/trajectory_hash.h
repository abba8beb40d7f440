#pragma once

#include <cstdint>
#include <vector>

#include "carom/native/sphere_world.h"

namespace carom::test {

struct HashedRun {
  SphereWorld world;
  double duration = 0.0;  ///< s
};

/// Runs that together take every path of the stepper: an elastic gas; a damped one under gravity
/// with a slant and a moving wall; a pile that goes to sleep; a break with friction and spin, and
/// one by Hertz's forces; a swinging cradle, springs, a field and drag; boxes and an oscillating
/// plane.
std::vector<HashedRun> hashedRuns();

/// FNV-1a over the bits of all events and final states of one run.
std::uint64_t runHash(const HashedRun& run);

/// FNV-1a over the hashes of all hashed runs, and over their counters.
std::uint64_t trajectoryHash();

}  // namespace carom::test
