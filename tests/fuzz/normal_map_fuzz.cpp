#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "carom/audio/normal_map.h"
#include "tests/fuzz/fuzz_numbers.h"

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t most);

namespace carom::fuzz {
namespace {

constexpr std::size_t kSignature = 8;
constexpr std::array<std::uint8_t, kSignature> kPng = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};

std::uint32_t checksum(std::span<const std::uint8_t> bytes) {
  std::uint32_t sum = ~0U;
  for (const std::uint8_t byte : bytes) {
    sum ^= byte;
    for (int bit = 0; bit < 8; ++bit)
      sum = sum >> 1U ^ (0xedb88320U & (0U - (sum & 1U)));
  }
  return ~sum;
}

std::array<std::uint8_t, 4> bigEndian(std::uint32_t value) {
  return {static_cast<std::uint8_t>(value >> 24U), static_cast<std::uint8_t>(value >> 16U),
          static_cast<std::uint8_t>(value >> 8U), static_cast<std::uint8_t>(value)};
}

/// Gives each chunk of a PNG file the checksum that fits, which no change of bytes would.
void mendChecksums(std::span<std::uint8_t> file) {
  for (std::size_t at = kSignature; file.size() >= at + 12;) {
    std::size_t length = 0;
    for (std::size_t index = 0; index < 4; ++index)
      length = length << 8U | file[at + index];
    if (length > file.size() - at - 12) return;
    std::ranges::copy(bigEndian(checksum(file.subspan(at + 4, 4 + length))),
                      file.begin() + static_cast<std::ptrdiff_t>(at + 8 + length));
    at += 12 + length;
  }
}

/// A PNG file whose picture is not compressed, so that every byte of it can be chosen, with
/// dimensions, kinds, filters and chunks that may not go together.
class PngMaker {
 public:
  explicit PngMaker(FuzzNumbers& numbers) : numbers_(numbers) {}

  std::string make() {
    file_.assign(kPng.begin(), kPng.end());
    addHeader();
    if (colour_ == 3 || numbers_.rarely(16)) add("PLTE", some(3 * numbers_.below(20)));
    if (numbers_.rarely(48)) add("tRNS", some(numbers_.below(8)));
    if (numbers_.rarely(32)) add("gAMA", some(4));
    if (numbers_.rarely(16)) add("sBIT", some(numbers_.below(5)));
    addPicture();
    if (numbers_.chance(250)) add("IEND", {});
    return file_;
  }

 private:
  std::string some(std::size_t count) {
    std::string bytes;
    for (std::size_t index = 0; index < count; ++index)
      bytes += static_cast<char>(numbers_.byte());
    return bytes;
  }
  static void append(std::string& to, std::uint32_t value) {
    for (const std::uint8_t byte : bigEndian(value))
      to += static_cast<char>(byte);
  }
  void add(const char* name, const std::string& content) {
    append(file_, static_cast<std::uint32_t>(content.size()));
    const std::string named = name + content;
    file_ += named;
    append(file_, checksum({reinterpret_cast<const std::uint8_t*>(named.data()), named.size()}));
  }
  std::uint32_t wildSize(std::size_t sound) {
    constexpr std::array kWild = {0U, 8192U, 8193U, 0x7fffffffU, 0xffffffffU};
    return numbers_.chance(250) ? static_cast<std::uint32_t>(sound)
                                : kWild[numbers_.below(kWild.size())];
  }
  void addHeader() {
    constexpr std::array<std::uint8_t, 6> kColours = {2, 2, 6, 3, 0, 4};
    constexpr std::array<std::uint8_t, 5> kDepths = {8, 16, 1, 2, 4};
    width_ = 1 + numbers_.below(16);
    height_ = 1 + numbers_.below(16);
    colour_ = kColours[numbers_.below(kColours.size())];
    depth_ = kDepths[numbers_.below(colour_ == 3 || colour_ == 0 ? 5 : 2)];
    std::string header;
    append(header, wildSize(width_));
    append(header, wildSize(height_));
    header += static_cast<char>(numbers_.chance(250) ? depth_ : numbers_.byte());
    header += static_cast<char>(numbers_.chance(250) ? colour_ : numbers_.byte());
    header += std::string(2, '\0');
    isInterlaced_ = numbers_.rarely(64);
    header += static_cast<char>(isInterlaced_);
    add("IHDR", header);
  }
  /// Rows of a filter and bytes, which for an interlaced picture are cut at other places than its
  /// own, in one block of zlib that is stored as it is.
  void addPicture() {
    constexpr std::array<std::size_t, 7> kChannels = {1, 0, 3, 1, 2, 0, 4};
    const std::size_t row = (width_ * kChannels[colour_] * depth_ + 7) / 8;
    std::string rows;
    for (std::size_t y = 0; y < height_; ++y) {
      rows += static_cast<char>(numbers_.below(numbers_.chance(250) ? 5 : 256));
      rows += some(row);
    }
    if (isInterlaced_) rows.resize(rows.size() + 8 * height_ + 16, '\0');
    if (numbers_.rarely(6)) rows.resize(rows.size() / 2);
    const std::size_t size = rows.size();
    std::string block = {'\x78', '\x01', '\x01'};
    for (const std::size_t number : {size, ~size})
      block += {static_cast<char>(number & 255U), static_cast<char>(number >> 8U & 255U)};
    block += rows;
    append(block, adler(rows));
    add("IDAT", block);
  }
  static std::uint32_t adler(std::string_view bytes) {
    std::uint32_t low = 1;
    std::uint32_t high = 0;
    for (const char byte : bytes) {
      low = (low + static_cast<std::uint8_t>(byte)) % 65521U;
      high = (high + low) % 65521U;
    }
    return high << 16U | low;
  }

  FuzzNumbers& numbers_;
  std::string file_;
  std::size_t width_ = 1;
  std::size_t height_ = 1;
  std::uint8_t colour_ = 2;
  std::uint8_t depth_ = 8;
  bool isInterlaced_ = false;
};

bool isPng(std::span<const std::uint8_t> bytes) {
  return bytes.size() >= kSignature && std::ranges::equal(bytes.first(kSignature), kPng);
}

void read(std::span<const std::byte> bytes, const NormalMapSettings& settings) {
  const auto map = normalMapFromBytes(bytes, "fuzz", settings);
  if (!map) {
    require(std::string_view(map.error().message).starts_with("normal map 'fuzz': "));
    return;
  }
  for (const double width : {0.0, 1e-3, 1.0})
    require(map->slope({0.01, -0.3}, width).allFinite());
  require(std::isfinite(map->steepest()) && map->widthOf(100.0) >= 0.0);
}

/// Makes a picture of the bytes, and perhaps settings that are wild.
void readMade(FuzzNumbers& numbers) {
  NormalMapSettings settings{.size = {0.1, 0.2}};
  if (numbers.rarely(32)) {
    settings.size = {numbers.wild(0.1), numbers.wild(0.2)};
    settings.strength = numbers.wild(1.0);
    settings.greenIsDown = numbers.chance(128);
  }
  const std::string file = PngMaker(numbers).make();
  read(std::as_bytes(std::span(file)), settings);
}

}  // namespace
}  // namespace carom::fuzz

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size,
                                               std::size_t most, unsigned) {
  const std::size_t changed = LLVMFuzzerMutate(data, size, most);
  if (carom::fuzz::isPng({data, changed})) carom::fuzz::mendChecksums({data, changed});
  return changed;
}

/// Requires that a PNG file gives either a picture whose slopes are numbers, or an error that names
/// it. The file is the input itself, if that begins as PNG does or with a byte of 0, or else is
/// made of it.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span bytes(data, size);
  carom::fuzz::FuzzNumbers numbers(bytes);
  if (carom::fuzz::isPng(bytes) || (size > 0 && data[0] == 0))
    carom::fuzz::read(std::as_bytes(bytes), {.size = {0.1, 0.2}});
  else
    carom::fuzz::readMade(numbers);
  return 0;
}
