#include "lab/fit/png_picture.h"

#include <algorithm>
#include <array>
#include <cstdlib>

#include <zlib.h>

namespace carom::lab {

namespace {

/// Letters of 3 x 5 dots, a digit in octal for each row, the left dot its highest bit.
struct Glyph {
  char letter;
  std::array<std::uint8_t, 5> rows;
};
constexpr std::array<Glyph, 19> kGlyphs = {{
    {'0', {7, 5, 5, 5, 7}}, {'1', {2, 6, 2, 2, 7}}, {'2', {7, 1, 7, 4, 7}}, {'3', {7, 1, 3, 1, 7}},
    {'4', {5, 5, 7, 1, 1}}, {'5', {7, 4, 7, 1, 7}}, {'6', {7, 4, 7, 5, 7}}, {'7', {7, 1, 2, 2, 2}},
    {'8', {7, 5, 7, 5, 7}}, {'9', {7, 5, 7, 1, 7}}, {'.', {0, 0, 0, 0, 2}}, {'-', {0, 0, 7, 0, 0}},
    {'k', {4, 5, 6, 6, 5}}, {'H', {5, 5, 7, 5, 5}}, {'z', {0, 7, 1, 6, 7}}, {'d', {1, 1, 7, 5, 7}},
    {'B', {6, 5, 6, 5, 6}}, {'s', {0, 3, 6, 3, 6}}, {'+', {0, 2, 7, 2, 0}},
}};

std::string bigEndian(std::uint32_t number) {
  std::string bytes;
  for (int shift = 24; shift >= 0; shift -= 8)
    bytes += static_cast<char>((number >> shift) & 0xFFu);
  return bytes;
}

std::string chunkOf(const std::string& tag, const std::string& content) {
  const std::string body = tag + content;
  const auto* data = reinterpret_cast<const Bytef*>(body.data());
  const auto sum = static_cast<std::uint32_t>(crc32(0, data, static_cast<uInt>(body.size())));
  return bigEndian(static_cast<std::uint32_t>(content.size())) + body + bigEndian(sum);
}

std::string deflated(const std::string& content) {
  uLongf size = compressBound(static_cast<uLong>(content.size()));
  std::string packed(size, '\0');
  compress2(reinterpret_cast<Bytef*>(packed.data()), &size,
            reinterpret_cast<const Bytef*>(content.data()), static_cast<uLong>(content.size()), 9);
  packed.resize(size);
  return packed;
}

}  // namespace

PngPicture::PngPicture(int width, int height)
    : width_(width),
      height_(height),
      pixels_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height),
              PictureColour{255, 255, 255}) {}

void PngPicture::set(int x, int y, PictureColour colour) {
  if (x < 0 || y < 0 || x >= width_ || y >= height_) return;
  pixels_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
          static_cast<std::size_t>(x)] = colour;
}

void PngPicture::line(int fromX, int fromY, int toX, int toY, PictureColour colour) {
  const int steps = std::max({std::abs(toX - fromX), std::abs(toY - fromY), 1});
  for (int step = 0; step <= steps; ++step)
    set(fromX + (toX - fromX) * step / steps, fromY + (toY - fromY) * step / steps, colour);
}

void PngPicture::text(int x, int y, std::string_view text, PictureColour colour) {
  for (const char letter : text) {
    const auto* const glyph = std::ranges::find(kGlyphs, letter, &Glyph::letter);
    if (glyph != kGlyphs.end()) {
      for (int dot = 0; dot < 60; ++dot) {  // each of its dots is 2 x 2 pixels
        const int row = dot / 12 * 2 + dot % 2;
        const int column = dot / 2 % 6;
        const std::uint8_t bits = glyph->rows.at(static_cast<std::size_t>(row / 2));
        if (((bits >> (2 - column / 2)) & 1) != 0) set(x + column, y + row, colour);
      }
    }
    x += 8;
  }
}

std::string PngPicture::bytes() const {
  std::string rows;
  for (std::size_t at = 0; at < pixels_.size(); ++at) {
    if (at % static_cast<std::size_t>(width_) == 0) rows += '\0';  // the row is not filtered
    rows += static_cast<char>(pixels_[at].red);
    rows += static_cast<char>(pixels_[at].green);
    rows += static_cast<char>(pixels_[at].blue);
  }
  std::string header = bigEndian(static_cast<std::uint32_t>(width_)) +
                       bigEndian(static_cast<std::uint32_t>(height_));
  header += std::string("\x08\x02\x00\x00\x00", 5);
  return "\x89PNG\r\n\x1a\n" + chunkOf("IHDR", header) + chunkOf("IDAT", deflated(rows)) +
         chunkOf("IEND", "");
}

}  // namespace carom::lab
