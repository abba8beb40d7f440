#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace carom::audio {

/// Returns the bytes, at most 2^32 - 1, as a frame of Zstandard (RFC 8878) that does not pack them:
/// any decoder reads it, and no library is needed to write it. [any thread]
std::vector<std::byte> rawFrame(std::span<const std::byte> bytes);

}  // namespace carom::audio
