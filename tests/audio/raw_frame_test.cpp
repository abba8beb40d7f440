#include "audio/run/raw_frame.h"

#include <cstddef>
#include <cstdint>
#include <ostream>
#include <vector>

#include <gtest/gtest.h>
#include <zstd.h>

namespace carom::audio {
namespace {

std::vector<std::byte> bytesOf(std::size_t size) {
  std::vector<std::byte> bytes(size);
  std::uint32_t random = 1;
  for (std::byte& byte : bytes) {
    random = random * 1664525U + 1013904223U;
    byte = static_cast<std::byte>(random >> 24U);
  }
  return bytes;
}

class RawFrame : public testing::TestWithParam<std::size_t> {};

TEST_P(RawFrame, IsUnpackedByZstandard) {
  const std::vector<std::byte> bytes = bytesOf(GetParam());
  const std::vector<std::byte> frame = rawFrame(bytes);
  EXPECT_EQ(ZSTD_getFrameContentSize(frame.data(), frame.size()), bytes.size());
  EXPECT_LE(frame.size(), ZSTD_compressBound(bytes.size()) + 16);
  std::vector<std::byte> unpacked(bytes.size());
  EXPECT_EQ(ZSTD_decompress(unpacked.data(), unpacked.size(), frame.data(), frame.size()),
            bytes.size());
  EXPECT_EQ(unpacked, bytes);
}

constexpr std::size_t kBlock = std::size_t{1} << 17U;
INSTANTIATE_TEST_SUITE_P(Sizes, RawFrame,
                         testing::Values(0, 1, 255, kBlock - 1, kBlock, kBlock + 1, 2 * kBlock,
                                         5 * kBlock / 2));

}  // namespace
}  // namespace carom::audio
