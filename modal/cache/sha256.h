#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace carom::modal {

/// Computes SHA-256 of bytes as they come (FIPS 180-4, sections 5 and 6.2). It is for content that
/// has to be told apart, not for secrets. [any thread, one at a time]
class Sha256 {
 public:
  using Digest = std::array<std::byte, 32>;

  void add(std::span<const std::byte> bytes);
  /// Returns the digest of all that was added. After it nothing may be added.
  Digest finish();

 private:
  static constexpr std::size_t kBlockSize = 64;
  using Block = std::span<const std::byte, kBlockSize>;

  void compress(Block block);

  // The first 32 bits of the fractional parts of the square roots of the first eight primes.
  std::array<std::uint32_t, 8> state_ = {0x6A09E667, 0xBB67AE85, 0x3C6EF372, 0xA54FF53A,
                                         0x510E527F, 0x9B05688C, 0x1F83D9AB, 0x5BE0CD19};
  std::array<std::byte, kBlockSize> pending_{};
  std::size_t pendingSize_ = 0;
  std::uint64_t size_ = 0;  ///< bytes so far
};

}  // namespace carom::modal
