#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <complex>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include <Eigen/Core>

namespace carom::audio {

// FieldWriter and FieldReader have the same functions, so that one function for each structure both
// writes and reads it: each call codes its argument, or sets it. Little-endian on every platform.
// [one thread each]

/// Encodes structures by appending to `bytes`.
class FieldWriter {
 public:
  explicit FieldWriter(std::vector<std::byte>& bytes) : bytes_(bytes) {}

  void number(std::unsigned_integral auto value) {
    std::array<std::byte, sizeof value> digits;
    for (std::size_t at = 0; at < sizeof value; ++at)
      digits[at] = static_cast<std::byte>(value >> (8 * at) & 0xFF);
    add(digits);
  }
  void number(double value) { number(std::bit_cast<std::uint64_t>(value)); }
  void number(float value) { number(std::bit_cast<std::uint32_t>(value)); }
  void flag(bool value) { number(std::uint8_t{value}); }
  /// Writes one of an enumeration's values, the last of which is `last`.
  template <class Enum>
  void choice(Enum value, Enum) {
    number(static_cast<std::uint8_t>(value));
  }
  /// Writes the number of the elements that follow; the reader checks it by the least bytes of
  /// each.
  template <class T>
  void count(const std::vector<T>& elements, std::size_t) {
    number(static_cast<std::uint64_t>(elements.size()));
  }
  void text(const std::string& value) {
    number(static_cast<std::uint64_t>(value.size()));
    add(std::as_bytes(std::span(value)));
  }
  /// Writes how many bytes there are, and them.
  void bytes(const std::vector<std::byte>& value) {
    number(static_cast<std::uint64_t>(value.size()));
    add(value);
  }

  /// Writes tag, length and content; the length is filled in once the content is there.
  template <class Content>
  void section(std::string_view tag, const Content& content) {
    add(std::as_bytes(std::span(tag)));
    const std::size_t lengthAt = bytes_.size();
    number(std::uint64_t{0});
    content(*this);
    std::vector<std::byte> length;
    FieldWriter(length).number(std::uint64_t{bytes_.size() - lengthAt - sizeof(std::uint64_t)});
    std::ranges::copy(length, bytes_.begin() + static_cast<std::ptrdiff_t>(lengthAt));
  }

 private:
  void add(std::span<const std::byte> more) {
    bytes_.insert(bytes_.end(), more.begin(), more.end());
  }

  std::vector<std::byte>& bytes_;
};

/// Decodes structures from `bytes`; after the first fault, all that it reads is zero.
class FieldReader {
 public:
  /// `start` is where the bytes begin in the file, for messages.
  FieldReader(std::span<const std::byte> bytes, std::size_t start) : bytes_(bytes), start_(start) {}

  void number(std::unsigned_integral auto& value) {
    value = 0;
    if (!has(sizeof value)) return refuse("ends within a number");
    for (std::size_t at = 0; at < sizeof value; ++at)
      value |= static_cast<std::remove_cvref_t<decltype(value)>>(
          std::to_integer<std::uint64_t>(bytes_[at_ + at]) << (8 * at));
    at_ += sizeof value;
  }
  void number(double& value) { value = std::bit_cast<double>(read<std::uint64_t>()); }
  void number(float& value) { value = std::bit_cast<float>(read<std::uint32_t>()); }
  void flag(bool& value) {
    const auto byte = read<std::uint8_t>();
    if (byte > 1) refuse("has a flag that is neither 0 nor 1");
    value = byte == 1;
  }
  template <class Enum>
  void choice(Enum& value, Enum last) {
    const auto byte = read<std::uint8_t>();
    const bool isKnown = byte <= static_cast<std::uint8_t>(last);
    if (!isKnown) refuse("has a choice that there is not");
    value = static_cast<Enum>(isKnown ? byte : 0);
  }
  /// Reads a count and resizes to it, but only if the bytes that are left can hold as many
  /// elements.
  template <class T>
  void count(std::vector<T>& elements, std::size_t bytesEach) {
    const auto size = read<std::uint64_t>();
    if (size > (bytes_.size() - at_) / bytesEach)
      return refuse("counts more elements than there are bytes");
    elements.resize(static_cast<std::size_t>(size));
  }
  void text(std::string& value) {
    const auto size = read<std::uint64_t>();
    if (!has(size)) return refuse("has a text that is longer than what is left");
    value.clear();
    for (const std::byte letter : bytes_.subspan(at_, static_cast<std::size_t>(size)))
      value.push_back(static_cast<char>(letter));
    at_ += value.size();
  }
  void bytes(std::vector<std::byte>& value) {
    value.clear();
    count(value, 1);
    std::ranges::copy(bytes_.subspan(at_, value.size()), value.begin());
    at_ += value.size();
  }

  template <class Content>
  void section(std::string_view tag, const Content& content) {
    const std::string named = "section '" + std::string(tag) + "' ";
    if (!has(tag.size()) || !std::ranges::equal(bytes_.subspan(at_, tag.size()), tag, {}, {},
                                                [](char letter) { return std::byte(letter); }))
      return refuse("has no section '" + std::string(tag) + "' here");
    at_ += tag.size();
    const auto length = read<std::uint64_t>();
    if (!has(length)) return refuse(named + "is longer than the file");
    FieldReader inside(bytes_.subspan(at_, static_cast<std::size_t>(length)), start_ + at_);
    content(inside);
    inside.end();
    if (fault_.empty() && !inside.fault_.empty()) fault_ = named + inside.fault_;
    at_ += static_cast<std::size_t>(length);
  }

  void end() {
    if (at_ != bytes_.size())
      refuse("has " + std::to_string(bytes_.size() - at_) + " bytes too many");
  }
  /// Returns the first fault, and where it is; empty if there is none.
  const std::string& fault() const { return fault_; }

 private:
  bool has(std::uint64_t size) const { return fault_.empty() && size <= bytes_.size() - at_; }
  void refuse(const std::string& why) {
    if (fault_.empty()) fault_ = why + " (byte " + std::to_string(start_ + at_) + ")";
  }
  template <class T>
  T read() {
    T value{};
    number(value);
    return value;
  }

  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
  std::size_t start_;
  std::string fault_;
};

/// Codes the numbers of a fixed-size matrix, row by row.
void codeMatrix(auto& archive, auto& matrix) {
  for (Eigen::Index row = 0; row < matrix.rows(); ++row)
    for (Eigen::Index column = 0; column < matrix.cols(); ++column)
      archive.number(matrix(row, column));
}

/// Codes a SurfaceMesh.
void codeSurface(auto& archive, auto& surface) {
  archive.count(surface.vertices, 3 * sizeof(double));
  for (auto& vertex : surface.vertices)
    codeMatrix(archive, vertex);
  archive.count(surface.triangles, 3 * sizeof(std::uint32_t));
  for (auto& triangle : surface.triangles)
    for (auto& vertex : triangle)
      archive.number(vertex);
}

/// Codes a complex number as its real and its imaginary part.
template <class Real>
void codeComplex(FieldWriter& archive, const std::complex<Real>& value) {
  archive.number(value.real());
  archive.number(value.imag());
}
template <class Real>
void codeComplex(FieldReader& archive, std::complex<Real>& value) {
  Real real = 0;
  Real imaginary = 0;
  archive.number(real);
  archive.number(imaginary);
  value = {real, imaginary};
}

}  // namespace carom::audio
