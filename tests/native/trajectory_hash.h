#pragma once

#include <cstdint>

#include "native/sphere_world.h"

namespace carom::test {

/// A dissipative gas in a box with a slant, under gravity.
SphereWorld trajectoryHashWorld();
inline constexpr double kTrajectoryHashTime = 2.0;  ///< s

/// FNV-1a over the bits of all events and final states of a dissipative gas in a box under
/// gravity, after 2 s and some thousand contacts, so that every path of the stepper takes part.
std::uint64_t trajectoryHash();

}  // namespace carom::test
