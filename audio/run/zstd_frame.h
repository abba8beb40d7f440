#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "carom/audio/result.h"

namespace carom::audio {

/// The time that packing may take.
enum class Packing : std::uint8_t {
  small,  ///< for files that are kept
  quick,  ///< a quarter of the time, for what mostly is thrown away
};

/// Returns the bytes as one frame of Zstandard (RFC 8878) that states its size, which is at most
/// 2^32 - 1. A build without the library packs nothing: the frame holds the bytes as they are.
/// [any thread]
Result<std::vector<std::byte>> zstdFrame(std::span<const std::byte> bytes, Packing packing);

}  // namespace carom::audio
