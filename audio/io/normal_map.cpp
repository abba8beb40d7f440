#include "carom/audio/normal_map.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <csetjmp>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include <png.h>

#include "audio/io/byte_file.h"

namespace carom {

using namespace audio;

namespace {

using Slope = SurfaceTexture::Slope;

constexpr double kMostStrength = 1e6;

bool isPictureSize(double size) {
  return size >= 1e-6 && size <= 1e6;
}

struct Source {
  std::span<const std::byte> bytes;
  std::size_t at = 0;
};

/// A picture of 16 bits per colour.
struct Picture {
  std::size_t width = 0;
  std::size_t height = 0;
  std::vector<std::uint16_t> colours;  // red, green, blue; the highest row first
};

void take(png_structp png, png_bytep to, std::size_t count) {
  auto* source = static_cast<Source*>(png_get_io_ptr(png));
  if (count > source->bytes.size() - source->at) png_error(png, "it ends too early");
  std::memcpy(to, source->bytes.data() + source->at, count);
  source->at += count;
}

[[noreturn]] void fail(png_structp png, png_const_charp message) {
  *static_cast<std::string*>(png_get_error_ptr(png)) = message;
  png_longjmp(png, 1);
}

void overlook(png_structp, png_const_charp) {}

/// True if so many bytes can hold the picture whose header was read: the compression of PNG makes
/// at most 1032 bytes of one. So a small file that states 8192 x 8192 texels takes no memory for
/// them.
bool canHold(std::size_t bytes, png_structp png, png_infop info) {
  constexpr std::size_t kBestCompression = 1032;
  return png_get_rowbytes(png, info) * std::size_t{png_get_image_height(png, info)} <=
         kBestCompression * bytes;
}

/// Calls libpng, which returns from errors by longjmp: so no variable in here may have a
/// destructor.
bool decode(png_structp png, png_infop info, Source& source, Picture& picture, std::string& why) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  png_set_read_fn(png, &source, take);
  png_set_user_limits(png, SurfaceTexture::kMostTexels, SurfaceTexture::kMostTexels);
  png_read_info(png, info);
  if ((png_get_color_type(png, info) & PNG_COLOR_MASK_COLOR) == 0) {
    why = "it is grey, and a normal map has colours; expected red, green and blue";
    return false;
  }
  if (!canHold(source.bytes.size(), png, info)) {
    why = "it ends too early";
    return false;
  }
  png_set_expand(png);
  png_set_strip_alpha(png);
  png_set_expand_16(png);
  png_set_interlace_handling(png);
  if constexpr (std::endian::native == std::endian::little) png_set_swap(png);
  png_read_update_info(png, info);
  picture.width = png_get_image_width(png, info);
  picture.height = png_get_image_height(png, info);
  picture.colours.resize(3 * picture.width * picture.height);
  // Reads by passes and rows, as png_read_image wants an array of pointers, which would have to
  // live in here.
  for (int pass = png_set_interlace_handling(png); pass > 0; --pass)
    for (std::size_t row = 0; row < picture.height; ++row)
      png_read_row(png,
                   reinterpret_cast<png_bytep>(picture.colours.data() + 3 * picture.width * row),
                   nullptr);
  png_read_end(png, nullptr);
  return true;
}

Result<Picture> pictureOf(std::span<const std::byte> bytes) {
  constexpr std::size_t kSignature = 8;
  if (bytes.size() < kSignature ||
      png_sig_cmp(reinterpret_cast<png_const_bytep>(bytes.data()), 0, kSignature) != 0)
    return Error{"it is no PNG file"};
  std::string why;
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &why, fail, overlook);
  png_infop info = png == nullptr ? nullptr : png_create_info_struct(png);
  if (info == nullptr) {
    png_destroy_read_struct(&png, nullptr, nullptr);
    return Error{"there is no memory to read it"};
  }
  Source source{bytes};
  Picture picture;
  const bool decoded = decode(png, info, source, picture, why);
  png_destroy_read_struct(&png, &info, nullptr);
  if (!decoded) return Error{why.starts_with("it ") ? why : "it is damaged: " + why};
  return picture;
}

/// Slope of the texel in column x and row y, rows counted from below.
Slope slopeAt(const Picture& picture, const NormalMapSettings& settings, std::size_t x,
              std::size_t y) {
  const std::uint16_t* colour =
      &picture.colours[3 * ((picture.height - 1 - y) * picture.width + x)];
  // By convention 128 is 0 in 8 bits, so that flat is flat; 16 bits are 257 times that.
  const auto component = [&](std::size_t index) {
    return (static_cast<float>(colour[index]) - 128.0F * 257.0F) / (127.0F * 257.0F);
  };
  const float outwards = component(2);
  const float flattest = 1.0F / SurfaceTexture::kSteepest;
  const float z = std::max(outwards, flattest);
  const auto strength = static_cast<float>(settings.strength);
  return {-strength * component(0) / z,
          (settings.greenIsDown ? 1.0F : -1.0F) * strength * component(1) / z};
}

bool pointsInwards(const Picture& picture) {
  constexpr std::uint16_t kFlat = 128 * 257;
  for (std::size_t at = 2; at < picture.colours.size(); at += 3)
    if (picture.colours[at] > kFlat) return false;
  return true;
}

SurfaceTexture::Size roundedUp(const Picture& picture) {
  return {std::bit_ceil(picture.width), std::bit_ceil(picture.height)};
}

/// The two columns, or rows, of the picture between which the middle of a texel lies.
struct Between {
  std::size_t first;
  std::size_t second;
  float share;
};
Between betweenOf(std::size_t index, std::size_t count, std::size_t ofPicture) {
  const double place = (static_cast<double>(index) + 0.5) * static_cast<double>(ofPicture) /
                           static_cast<double>(count) -
                       0.5;
  const double below = std::floor(place);
  const auto first = static_cast<std::size_t>(below + static_cast<double>(ofPicture)) % ofPicture;
  return {first, (first + 1) % ofPicture, static_cast<float>(place - below)};
}

std::vector<Slope> slopesOf(const Picture& picture, const NormalMapSettings& settings) {
  const SurfaceTexture::Size size = roundedUp(picture);
  std::vector<Slope> slopes;
  slopes.reserve(size.width * size.height);
  for (std::size_t v = 0; v < size.height; ++v) {
    const Between rows = betweenOf(v, size.height, picture.height);
    for (std::size_t u = 0; u < size.width; ++u) {
      const Between columns = betweenOf(u, size.width, picture.width);
      const auto inRow = [&](std::size_t row) {
        return Slope((1.0F - columns.share) * slopeAt(picture, settings, columns.first, row) +
                     columns.share * slopeAt(picture, settings, columns.second, row));
      };
      slopes.emplace_back((1.0F - rows.share) * inRow(rows.first) +
                          rows.share * inRow(rows.second));
    }
  }
  return slopes;
}

}  // namespace

Result<SurfaceTexture> normalMapFromBytes(std::span<const std::byte> bytes, std::string_view name,
                                          const NormalMapSettings& settings) {
  const auto refuse = [name](const std::string& why) {
    return Error{"normal map '" + std::string(name) + "': " + why};
  };
  if (!isPictureSize(settings.size.x()) || !isPictureSize(settings.size.y()))
    return refuse("its size must be positive, from 1e-6 to 1e6 (m)");
  if (!(settings.strength >= 0.0 && settings.strength <= kMostStrength))
    return refuse("its strength must be at least 0, and at most 1e6");
  const Result<Picture> picture = pictureOf(bytes);
  if (!picture) return refuse(picture.error().message);
  if (pointsInwards(*picture))
    return refuse("no normal points outwards; expected blue above a half, as tangent space has it");
  const SurfaceTexture::Size size = roundedUp(*picture);
  const Vec2 texel(settings.size.x() / static_cast<double>(size.width),
                   settings.size.y() / static_cast<double>(size.height));
  Result<SurfaceTexture> texture =
      SurfaceTexture::ofSlopes(size, texel, slopesOf(*picture, settings));
  if (!texture) return refuse(texture.error().message);
  return texture;
}

Result<SurfaceTexture> readNormalMap(const std::filesystem::path& path,
                                     const NormalMapSettings& settings) {
  const Result<std::vector<std::byte>> bytes = readBytes(path);
  if (!bytes) return Error{"normal map '" + path.string() + "': " + bytes.error().message};
  return normalMapFromBytes(*bytes, path.string(), settings);
}

}  // namespace carom
