#include "audio/run/zstd_frame.h"

#include <zstd.h>

namespace carom::audio {

namespace {

constexpr int kSmall = 6;  // level of Zstandard: higher ones take longer and save a percent
constexpr int kQuick = 1;  // the same

}  // namespace

Result<std::vector<std::byte>> zstdFrame(std::span<const std::byte> bytes, Packing packing) {
  std::vector<std::byte> packed(ZSTD_compressBound(bytes.size()));
  const std::size_t size = ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(),
                                         packing == Packing::small ? kSmall : kQuick);
  if (ZSTD_isError(size) != 0) return Error{"a part of the run cannot be packed"};
  packed.resize(size);
  return packed;
}

}  // namespace carom::audio
