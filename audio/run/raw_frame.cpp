#include "audio/run/raw_frame.h"

#include <algorithm>
#include <cassert>
#include <cstdint>

#include "audio/io/field_code.h"

namespace carom::audio {

namespace {

// RFC 8878, section 3.1.1: the frame's header is a magic number, a byte that says that there is one
// segment whose size follows in four bytes, and that size. A raw block has three bytes before it:
// its size times 8, and 1 if it is the last one. No block may be larger than 128 KiB.
constexpr std::uint32_t kFrameMagic = 0xFD2FB528U;
constexpr std::uint8_t kOneSegment = 0b1010'0000;
constexpr std::size_t kLargestBlock = std::size_t{1} << 17U;
constexpr std::size_t kFrameHeader = 9;  // bytes
constexpr std::size_t kBlockHeader = 3;  // bytes

}  // namespace

std::vector<std::byte> rawFrame(std::span<const std::byte> bytes) {
  assert(bytes.size() <= UINT32_MAX);
  const std::size_t blocks = bytes.size() / kLargestBlock + 1;
  std::vector<std::byte> frame;
  frame.reserve(kFrameHeader + kBlockHeader * blocks + bytes.size());
  FieldWriter fields(frame);
  fields.number(kFrameMagic);
  fields.number(kOneSegment);
  fields.number(static_cast<std::uint32_t>(bytes.size()));
  bool isLast = false;
  while (!isLast) {
    const auto block = bytes.first(std::min(bytes.size(), kLargestBlock));
    bytes = bytes.subspan(block.size());
    isLast = bytes.empty();
    const auto head = static_cast<std::uint32_t>(block.size() * 8 + (isLast ? 1U : 0U));
    fields.number(static_cast<std::uint8_t>(head & 0xFFU));
    fields.number(static_cast<std::uint16_t>(head >> 8U));
    frame.insert(frame.end(), block.begin(), block.end());
  }
  return frame;
}

}  // namespace carom::audio
