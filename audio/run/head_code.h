#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "audio/propagation/hrtf.h"
#include "carom/audio/result.h"

namespace carom::audio {

/// Returns the measurements of a head as bytes, for a player that has no files. Responses are cut
/// after `most` samples. [any thread]
std::vector<std::byte> encodedHead(const HrtfMeasurements& head, std::size_t most);
/// Returns the measurements of such bytes. An error, the second half of a sentence, is that of
/// bytes which are none; HrtfSet::create looks at their numbers. [any thread]
Result<HrtfMeasurements> decodedHead(std::span<const std::byte> bytes);

}  // namespace carom::audio
