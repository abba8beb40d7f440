#include "lab/page/packed_text.h"

#include <array>
#include <cstddef>
#include <cstring>
#include <random>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>
#include <zlib.h>

namespace carom::lab {
namespace {

/// Decodes base64 by the definition of RFC 4648: six bits a letter.
std::vector<unsigned char> decoded(const std::string& text) {
  constexpr std::string_view kLetters =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  EXPECT_EQ(text.size() % 4, 0u);
  std::vector<bool> bits;
  for (const char letter : text) {
    if (letter == '=') break;
    const std::size_t number = kLetters.find(letter);
    EXPECT_NE(number, std::string_view::npos);
    for (int bit = 5; bit >= 0; --bit)
      bits.push_back((number >> bit & 1U) != 0);
  }
  std::vector<unsigned char> bytes(bits.size() / 8);
  for (std::size_t at = 0; at < 8 * bytes.size(); ++at)
    if (bits[at]) bytes[at / 8] |= static_cast<unsigned char>(128U >> (at % 8));
  return bytes;
}

std::vector<std::byte> unpacked(const std::string& text, std::size_t size) {
  std::vector<unsigned char> packed = decoded(text);
  std::vector<std::byte> bytes(size + 1);
  z_stream stream = {};
  EXPECT_EQ(inflateInit2(&stream, 15 + 16), Z_OK);
  stream.next_in = packed.data();
  stream.avail_in = static_cast<uInt>(packed.size());
  stream.next_out = reinterpret_cast<Bytef*>(bytes.data());
  stream.avail_out = static_cast<uInt>(bytes.size());
  EXPECT_EQ(inflate(&stream, Z_FINISH), Z_STREAM_END);
  bytes.resize(bytes.size() - stream.avail_out);
  inflateEnd(&stream);
  return bytes;
}

TEST(PackedText, IsUnpackedToTheSameBytes) {
  std::mt19937 random(7);
  for (const std::size_t size : {0u, 1u, 2u, 3u, 4u, 5u, 1000u, 70001u}) {
    std::vector<std::byte> bytes(size);
    for (std::byte& byte : bytes)
      byte = static_cast<std::byte>(random() % 5 == 0 ? random() : 0U);
    const Result<std::string> text = packedText(bytes);
    ASSERT_TRUE(text);
    EXPECT_EQ(unpacked(*text, size), bytes) << size;
  }
}

TEST(PackedText, IsTheSameForTheSameBytes) {
  const std::vector<std::byte> bytes(1000, std::byte{42});
  EXPECT_EQ(*packedText(bytes), *packedText(bytes));
}

}  // namespace
}  // namespace carom::lab
