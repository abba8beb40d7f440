#include "modal/cache/sha256.h"

#include <algorithm>
#include <bit>

namespace carom::modal {
namespace {

constexpr std::size_t kRounds = 64;
constexpr unsigned kByteBits = 8;

/// The first 32 bits of the fractional parts of the cube roots of the first 64 primes.
constexpr std::array<std::uint32_t, kRounds> kRoundConstants = {
    0x428A2F98, 0x71374491, 0xB5C0FBCF, 0xE9B5DBA5, 0x3956C25B, 0x59F111F1, 0x923F82A4, 0xAB1C5ED5,
    0xD807AA98, 0x12835B01, 0x243185BE, 0x550C7DC3, 0x72BE5D74, 0x80DEB1FE, 0x9BDC06A7, 0xC19BF174,
    0xE49B69C1, 0xEFBE4786, 0x0FC19DC6, 0x240CA1CC, 0x2DE92C6F, 0x4A7484AA, 0x5CB0A9DC, 0x76F988DA,
    0x983E5152, 0xA831C66D, 0xB00327C8, 0xBF597FC7, 0xC6E00BF3, 0xD5A79147, 0x06CA6351, 0x14292967,
    0x27B70A85, 0x2E1B2138, 0x4D2C6DFC, 0x53380D13, 0x650A7354, 0x766A0ABB, 0x81C2C92E, 0x92722C85,
    0xA2BFE8A1, 0xA81A664B, 0xC24B8B70, 0xC76C51A3, 0xD192E819, 0xD6990624, 0xF40E3585, 0x106AA070,
    0x19A4C116, 0x1E376C08, 0x2748774C, 0x34B0BCB5, 0x391C0CB3, 0x4ED8AA4A, 0x5B9CCA4F, 0x682E6FF3,
    0x748F82EE, 0x78A5636F, 0x84C87814, 0x8CC70208, 0x90BEFFFA, 0xA4506CEB, 0xBEF9A3F7, 0xC67178F2};

using Words = std::array<std::uint32_t, kRounds>;

/// The message schedule of a block: FIPS 180-4, 6.2.2, step 1.
Words schedule(std::span<const std::byte, 64> block) {
  Words words{};
  for (std::size_t at = 0; at < block.size(); ++at)
    words[at / 4] = words[at / 4] << kByteBits | std::to_integer<std::uint32_t>(block[at]);
  for (std::size_t at = 16; at < kRounds; ++at) {
    const std::uint32_t early = words[at - 15];
    const std::uint32_t late = words[at - 2];
    const std::uint32_t sigma0 = std::rotr(early, 7) ^ std::rotr(early, 18) ^ early >> 3U;
    const std::uint32_t sigma1 = std::rotr(late, 17) ^ std::rotr(late, 19) ^ late >> 10U;
    words[at] = sigma1 + words[at - 7] + sigma0 + words[at - 16];
  }
  return words;
}

}  // namespace

void Sha256::compress(Block block) {
  const Words words = schedule(block);
  auto [a, b, c, d, e, f, g, h] = state_;
  for (std::size_t round = 0; round < kRounds; ++round) {
    const std::uint32_t sum1 = std::rotr(e, 6) ^ std::rotr(e, 11) ^ std::rotr(e, 25);
    const std::uint32_t choice = (e & f) ^ (~e & g);
    const std::uint32_t first = h + sum1 + choice + kRoundConstants[round] + words[round];
    const std::uint32_t sum0 = std::rotr(a, 2) ^ std::rotr(a, 13) ^ std::rotr(a, 22);
    const std::uint32_t majority = (a & b) ^ (a & c) ^ (b & c);
    h = g, g = f, f = e, e = d + first;
    d = c, c = b, b = a, a = first + sum0 + majority;
  }
  const std::array<std::uint32_t, 8> next = {a, b, c, d, e, f, g, h};
  for (std::size_t word = 0; word < next.size(); ++word)
    state_[word] += next[word];
}

void Sha256::add(std::span<const std::byte> bytes) {
  size_ += bytes.size();
  while (!bytes.empty()) {
    const std::size_t taken = std::min(bytes.size(), kBlockSize - pendingSize_);
    std::ranges::copy(bytes.first(taken),
                      pending_.begin() + static_cast<std::ptrdiff_t>(pendingSize_));
    pendingSize_ += taken;
    bytes = bytes.subspan(taken);
    if (pendingSize_ < kBlockSize) return;
    compress(pending_);
    pendingSize_ = 0;
  }
}

Sha256::Digest Sha256::finish() {
  const std::uint64_t bits = size_ * kByteBits;
  constexpr std::size_t kLengthAt = kBlockSize - sizeof bits;
  const std::byte one{0x80};
  add({&one, 1});
  constexpr std::byte kZero{0};
  while (pendingSize_ != kLengthAt)
    add({&kZero, 1});
  std::array<std::byte, sizeof bits> length{};
  for (std::size_t at = 0; at < length.size(); ++at)
    length[at] = static_cast<std::byte>(bits >> (kByteBits * (length.size() - 1 - at)) & 0xFF);
  add(length);
  Digest digest{};
  for (std::size_t at = 0; at < digest.size(); ++at)
    digest[at] = static_cast<std::byte>(state_[at / 4] >> (kByteBits * (3 - at % 4)) & 0xFF);
  return digest;
}

}  // namespace carom::modal
