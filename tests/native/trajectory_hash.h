#pragma once

#include <cstdint>

namespace carom::test {

/// FNV-1a over the bits of all events and final states of a dissipative gas in a box under
/// gravity, after 2 s and some thousand contacts, so that every path of the stepper takes part.
std::uint64_t trajectoryHash();

}  // namespace carom::test
