#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "carom/audio/result.h"

namespace carom::lab {

/// Returns bytes packed by gzip (RFC 1952) as text in base64 (RFC 4648), which a page unpacks with
/// the browser's own means. The same bytes give the same text. An error is that of zlib. [any
/// thread]
Result<std::string> packedText(std::span<const std::byte> bytes);

}  // namespace carom::lab
