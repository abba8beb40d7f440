#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace carom::lab {

/// A colour, each part from 0 to 255.
struct PictureColour {
  std::uint8_t red = 0;
  std::uint8_t green = 0;
  std::uint8_t blue = 0;
};

/// A picture that is drawn in memory, white at first. Places are in pixels, x to the right, y down;
/// what lies outside is not drawn. [one thread]
class PngPicture {
 public:
  PngPicture(int width, int height);

  int width() const { return width_; }
  int height() const { return height_; }
  void set(int x, int y, PictureColour colour);
  void line(int fromX, int fromY, int toX, int toY, PictureColour colour);
  /// Writes text of digits, the letters of units (k, H, z, d, B, s), signs and blanks, 8 pixels a
  /// letter and 10 high, from its upper left corner.
  void text(int x, int y, std::string_view text, PictureColour colour);

  /// Returns the bytes of a PNG file (ISO/IEC 15948), 8 bits for each of three colours.
  std::string bytes() const;

 private:
  int width_;
  int height_;
  std::vector<PictureColour> pixels_;
};

}  // namespace carom::lab
