#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace carom::native {

// ByteWriter and ByteReader have the same members, so that one function describes what is written
// and what is read: each call writes its argument, or reads into it. Internal to native/.

inline constexpr unsigned kByteBits = 8;
inline constexpr unsigned kCountBits = 7;  ///< bits of a count in each byte
/// Bytes of a count at most; the last byte has all 8 bits.
inline constexpr unsigned kLongestCount = 9;
inline constexpr std::uint64_t kMoreFollow = 0x80;
inline constexpr std::uint64_t kSignBit = std::uint64_t{1} << 63U;

/// Integer rank of a double: ranks are in the order of the values.
inline std::uint64_t rankOf(double value) {
  const auto bits = std::bit_cast<std::uint64_t>(value);
  return (bits & kSignBit) != 0 ? ~(bits & ~kSignBit) : bits;
}
inline double ofRank(std::uint64_t rank) {
  return std::bit_cast<double>((rank & kSignBit) != 0 ? (~rank | kSignBit) : rank);
}

/// Writes by appending to `bytes`.
class ByteWriter {
 public:
  static constexpr bool kReads = false;

  explicit ByteWriter(std::vector<std::byte>& bytes) : bytes_(bytes) {}

  void fixed(std::uint64_t value, unsigned size) {
    for (unsigned at = 0; at < size; ++at)
      bytes_.push_back(static_cast<std::byte>(value >> (kByteBits * at) & 0xFF));
  }
  void byte(unsigned& value) { fixed(value, 1); }
  void count(std::uint64_t& value) {
    std::uint64_t rest = value;
    for (unsigned at = 1; at < kLongestCount && rest >= kMoreFollow; ++at) {
      fixed(rest | kMoreFollow, 1);
      rest >>= kCountBits;
    }
    fixed(rest, 1);
  }
  void number(double& value) { fixed(std::bit_cast<std::uint64_t>(value), 8); }
  void residual(double& value, double known) {
    const std::uint64_t away = rankOf(value) - rankOf(known);
    std::uint64_t code = (away & kSignBit) != 0 ? ~(away << 1U) : away << 1U;
    count(code);
  }
  void text(std::string& value) {
    std::uint64_t size = value.size();
    count(size);
    for (const char letter : value)
      fixed(static_cast<unsigned char>(letter), 1);
  }

  /// Notes the first fault; returns true if there is none so far.
  bool check(bool right, const char* what) {
    if (!right && fault_.empty()) fault_ = what;
    return fault_.empty();
  }
  bool failed() const { return !fault_.empty(); }
  const std::string& fault() const { return fault_; }

 private:
  std::vector<std::byte>& bytes_;
  std::string fault_;
};

/// Reads from `bytes`; after a fault it returns zeros.
class ByteReader {
 public:
  static constexpr bool kReads = true;

  explicit ByteReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  std::uint64_t fixed(unsigned size) {
    if (!check(bytes_.size() - at_ >= size, "the end comes too early")) return 0;
    std::uint64_t value = 0;
    for (unsigned byte = 0; byte < size; ++byte)
      value |= std::to_integer<std::uint64_t>(bytes_[at_++]) << (kByteBits * byte);
    return value;
  }
  void byte(unsigned& value) { value = static_cast<unsigned>(fixed(1)); }
  void count(std::uint64_t& value) {
    value = 0;
    for (unsigned at = 0; at < kLongestCount; ++at) {
      const std::uint64_t next = fixed(1);
      const bool last = at + 1 == kLongestCount || next < kMoreFollow;
      value |= (last ? next : next & ~kMoreFollow) << (kCountBits * at);
      if (last) return;
    }
  }
  void number(double& value) { value = std::bit_cast<double>(fixed(8)); }
  void residual(double& value, double known) {
    std::uint64_t code = 0;
    count(code);
    const std::uint64_t away = (code & 1U) != 0 ? ~(code >> 1U) : code >> 1U;
    value = ofRank(rankOf(known) + away);
  }
  void text(std::string& value) {
    std::uint64_t size = 0;
    count(size);
    if (!check(size <= bytes_.size() - at_, "the text is longer than what is left")) return;
    value.resize(static_cast<std::size_t>(size));
    for (char& letter : value)
      letter = static_cast<char>(bytes_[at_++]);
  }

  bool check(bool right, const char* what) {
    if (!right && fault_.empty()) {
      fault_ = what;
      faultAt_ = at_;
    }
    return fault_.empty();
  }
  bool failed() const { return !fault_.empty(); }
  const std::string& fault() const { return fault_; }
  std::size_t faultAt() const { return faultAt_; }
  bool atEnd() const { return at_ == bytes_.size(); }

 private:
  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
  std::size_t faultAt_ = 0;
  std::string fault_;
};

}  // namespace carom::native
