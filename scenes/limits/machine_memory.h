#pragma once

#include <cstdint>

namespace carom::scenes {

/// Returns the bytes of this process that are in memory; 0 where that is not known. [any thread]
std::uint64_t residentMemory();
/// Returns the bytes that this process may write to, in memory or not yet; 0 where that is not
/// known. [any thread]
std::uint64_t mappedMemory();
/// Returns the bytes of memory that the machine, or this container, has; 0 where that is not known.
/// [any thread]
std::uint64_t machineMemory();

}  // namespace carom::scenes
