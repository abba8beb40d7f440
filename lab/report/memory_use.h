#pragma once

#include <cstddef>
#include <optional>

namespace carom::lab {

/// Returns the bytes that the process has on its heap now; nullopt if the C library cannot tell (it
/// is glibc's mallinfo2). [any thread]
std::optional<std::size_t> heapInUse();

}  // namespace carom::lab
