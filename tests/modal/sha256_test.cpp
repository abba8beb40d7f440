#include "modal/cache/sha256.h"

#include <span>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

namespace carom::test {

using namespace modal;

namespace {

std::string hex(const Sha256::Digest& digest) {
  std::string text;
  for (const std::byte byte : digest)
    for (const unsigned digit :
         {std::to_integer<unsigned>(byte) / 16, std::to_integer<unsigned>(byte) % 16})
      text += "0123456789abcdef"[digit];
  return text;
}

std::string hashOf(std::string_view text) {
  Sha256 hash;
  hash.add(std::as_bytes(std::span(text)));
  return hex(hash.finish());
}

// The hashes are from NIST, "Examples with intermediate values" for SHA-256, and the test vectors
// of FIPS 180-2, appendix B.
TEST(Sha256, HashesAreThePublishedOnes) {
  EXPECT_EQ(hashOf(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(hashOf("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(hashOf("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(hashOf(std::string(1000000, 'a')),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Sha256, DoesNotDependOnThePiecesThatItGets) {
  const std::string text(200, 'x');
  for (std::size_t size = 0; size <= 130; ++size) {
    Sha256 hash;
    hash.add(std::as_bytes(std::span(text).first(size)));
    hash.add(std::as_bytes(std::span(text).subspan(size)));
    EXPECT_EQ(hex(hash.finish()), hashOf(text)) << size;
  }
}

}  // namespace
}  // namespace carom::test
