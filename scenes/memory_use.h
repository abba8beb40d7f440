#pragma once

#include <cstddef>
#include <optional>

namespace carom::scenes {

/// Bytes that the process has on its heap now; nothing where the C library cannot tell (it is
/// glibc's mallinfo2). [any thread]
std::optional<std::size_t> heapInUse();

}  // namespace carom::scenes
