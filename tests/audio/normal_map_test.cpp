#include "carom/audio/normal_map.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>
#include <sys/resource.h>

#include "tests/support/temporary_folder.h"

namespace carom::test {
namespace {

using testing::HasSubstr;

/// A picture, written by another interface of libpng than the reader uses.
std::vector<std::byte> pngOf(std::uint32_t format, std::uint32_t width, std::uint32_t height,
                             const std::vector<std::uint8_t>& pixels) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = width;
  image.height = height;
  image.format = format;
  png_alloc_size_t size = 0;
  if (png_image_write_to_memory(&image, nullptr, &size, 0, pixels.data(), 0, nullptr) == 0)
    std::abort();
  std::vector<std::byte> bytes(size);
  if (png_image_write_to_memory(&image, bytes.data(), &size, 0, pixels.data(), 0, nullptr) == 0)
    std::abort();
  bytes.resize(size);
  return bytes;
}

/// The colours of a normal (x right, y up, z outwards), 8 bits each.
std::array<std::uint8_t, 3> colourOf(double slopeRight, double slopeUp) {
  const double length = std::sqrt(slopeRight * slopeRight + slopeUp * slopeUp + 1.0);
  const auto byteOf = [length](double component) {
    return static_cast<std::uint8_t>(std::lround(128.0 + 127.0 * component / length));
  };
  return {byteOf(-slopeRight), byteOf(-slopeUp), byteOf(1.0)};
}

/// A map of 4 x 2 texels, all with different slopes, whose sum is zero.
struct Patch {
  std::vector<Eigen::Vector2d> slopes = {{0.3, 0.0},   {-0.3, 0.1}, {0.0, 0.2},    {0.0, -0.3},
                                         {-0.2, -0.1}, {0.2, 0.1},  {-0.25, 0.05}, {0.25, -0.05}};
  std::vector<std::byte> png() const {
    std::vector<std::uint8_t> pixels;
    for (const int row : {1, 0})  // the picture's highest row first
      for (int column = 0; column < 4; ++column) {
        const Eigen::Vector2d& slope = slopes[static_cast<std::size_t>(4 * row + column)];
        for (const std::uint8_t byte : colourOf(slope.x(), slope.y()))
          pixels.push_back(byte);
      }
    return pngOf(PNG_FORMAT_RGB, 4, 2, pixels);
  }
};

/// Gives the header of a PNG file the checksum that fits: the CRC-32 of its name and content.
void mendHeaderChecksum(std::vector<std::byte>& png) {
  constexpr std::size_t kNamed = 12;
  constexpr std::size_t kLength = 17;
  std::uint32_t sum = ~0U;
  for (std::size_t at = kNamed; at < kNamed + kLength; ++at) {
    sum ^= std::to_integer<std::uint32_t>(png[at]);
    for (int bit = 0; bit < 8; ++bit)
      sum = sum >> 1U ^ (0xedb88320U & (0U - (sum & 1U)));
  }
  for (std::size_t index = 0; index < 4; ++index)
    png[kNamed + kLength + index] = std::byte(~sum >> (24 - 8 * index) & 255U);
}

/// Mean slope from `from` to `to`. The spline smooths the texels' slopes, so that means over whole
/// rows and columns are compared with what the spline keeps of them.
Eigen::Vector2d meanOver(const SurfaceTexture& texture, const Eigen::Vector2d& from,
                         const Eigen::Vector2d& to) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  constexpr int kSteps = 1000;
  for (int step = 0; step < kSteps; ++step)
    sum += texture.slope(from + (step + 0.5) / kSteps * (to - from), 0.0);
  return sum / kSteps;
}

TEST(NormalMap, SlopesAreThoseOfTheColours) {
  const Patch patch;
  const auto texture =
      normalMapFromBytes(patch.png(), "patch", {.size = {0.04, 0.02}, .greenIsDown = false});
  ASSERT_TRUE(texture) << texture.error().message;
  EXPECT_EQ(texture->size().width, 4u);
  EXPECT_EQ(texture->size().height, 2u);
  EXPECT_NEAR(texture->texel().x(), 0.01, 1e-15);
  EXPECT_NEAR(texture->texel().y(), 0.01, 1e-15);
  // Along a row's middle the spline of two rows that repeat keeps 3/4 of the row and 1/4 of the
  // other one; the mean across rows is kept.
  for (const int row : {0, 1}) {
    Eigen::Vector2d own = Eigen::Vector2d::Zero();
    Eigen::Vector2d other = Eigen::Vector2d::Zero();
    for (int column = 0; column < 4; ++column) {
      own += 0.25 * patch.slopes[static_cast<std::size_t>(4 * row + column)];
      other += 0.25 * patch.slopes[static_cast<std::size_t>(4 * (1 - row) + column)];
    }
    const double v = 0.01 * (row + 0.5);
    const Eigen::Vector2d mean = meanOver(*texture, {0.0, v}, {0.04, v});
    EXPECT_LT((mean - 0.75 * own - 0.25 * other).norm(), 0.01) << row;
  }
  // Along a column's middle the spline keeps 3/4 of the column and 1/8 of each neighbour.
  for (int column = 0; column < 4; ++column) {
    const auto of = [&](int which) {
      const auto index = static_cast<std::size_t>((which + 4) % 4);
      return Eigen::Vector2d(0.5 * (patch.slopes[index] + patch.slopes[4 + index]));
    };
    const double u = 0.01 * (column + 0.5);
    const Eigen::Vector2d mean = meanOver(*texture, {u, 0.0}, {u, 0.02});
    const Eigen::Vector2d expected =
        0.75 * of(column) + 0.125 * of(column - 1) + 0.125 * of(column + 1);
    EXPECT_LT((mean - expected).norm(), 0.01) << column;
  }
}

TEST(NormalMap, GreenMayPointDownAndSlopesMayBeStronger) {
  const Patch patch;
  const auto up = normalMapFromBytes(patch.png(), "patch", {});
  const auto down = normalMapFromBytes(patch.png(), "patch", {.greenIsDown = true});
  const auto twice = normalMapFromBytes(patch.png(), "patch", {.strength = 2.0});
  ASSERT_TRUE(up && down && twice);
  const Eigen::Vector2d at(0.3, 0.7);
  const Eigen::Vector2d slope = up->slope(at, 0.0);
  EXPECT_NEAR(down->slope(at, 0.0).x(), slope.x(), 1e-7);
  EXPECT_NEAR(down->slope(at, 0.0).y(), -slope.y(), 1e-7);
  EXPECT_LT((twice->slope(at, 0.0) - 2.0 * slope).norm(), 1e-6);
}

TEST(NormalMap, AFlatMapIsFlat) {
  const auto texture = normalMapFromBytes(pngOf(PNG_FORMAT_RGB, 1, 1, {128, 128, 255}), "flat", {});
  ASSERT_TRUE(texture) << texture.error().message;
  EXPECT_EQ(texture->slope({0.2, 0.3}, 0.0).norm(), 0.0);
}

TEST(NormalMap, TakesAnyFormatWithColours) {
  std::vector<std::uint8_t> pixels;
  for (int texel = 0; texel < 3 * 5; ++texel)
    for (const std::uint8_t byte :
         {std::uint8_t{200}, std::uint8_t{100}, std::uint8_t{220}, std::uint8_t{9}})
      pixels.push_back(byte);
  const auto texture = normalMapFromBytes(pngOf(PNG_FORMAT_RGBA, 3, 5, pixels), "alpha", {});
  ASSERT_TRUE(texture) << texture.error().message;
  EXPECT_EQ(texture->size().width, 4u);  // resampled to powers of two
  EXPECT_EQ(texture->size().height, 8u);
}

TEST(NormalMap, SaysWhatItCannotRead) {
  const auto refusal = [](const std::vector<std::byte>& bytes,
                          const NormalMapSettings& settings = {}) {
    const auto made = normalMapFromBytes(bytes, "bumps.png", settings);
    return made ? std::string() : made.error().message;
  };
  const std::vector<std::byte> png = Patch().png();
  EXPECT_EQ(refusal(png), "");
  EXPECT_EQ(refusal({}), "normal map 'bumps.png': it is no PNG file");
  EXPECT_THAT(refusal(std::vector<std::byte>(100, std::byte{7})), HasSubstr("no PNG"));
  for (std::size_t length = 8; length + 12 < png.size(); ++length)
    EXPECT_THAT(refusal({png.begin(), png.begin() + static_cast<std::ptrdiff_t>(length)}),
                HasSubstr("normal map 'bumps.png': it "));
  EXPECT_THAT(refusal(pngOf(PNG_FORMAT_GRAY, 2, 1, {100, 200})), HasSubstr("grey"));
  EXPECT_THAT(refusal(pngOf(PNG_FORMAT_RGB, 1, 1, {10, 10, 10})),
              HasSubstr("no normal points outwards"));
  EXPECT_THAT(refusal(png, {.size = {0.0, 1.0}}), HasSubstr("size must be positive"));
  EXPECT_THAT(refusal(png, {.size = {1.0, 1e-300}}), HasSubstr("from 1e-6 to 1e6 (m)"));
  EXPECT_THAT(refusal(png, {.size = {1e300, 1.0}}), HasSubstr("from 1e-6 to 1e6 (m)"));
  EXPECT_THAT(refusal(png, {.strength = -1.0}), HasSubstr("strength"));
  EXPECT_THAT(refusal(png, {.strength = 1e300}), HasSubstr("at most 1e6"));
  const auto missing = readNormalMap("/nowhere/bumps.png", {});
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().message, "normal map '/nowhere/bumps.png': there is no such file");
}

// 400 MB, which a build that sets them aside first touches all of.
TEST(NormalMap, ASmallFileThatStatesALargePictureTakesNoMemory) {
  const auto residentAtMost = [] {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return usage.ru_maxrss;  // kB
  };
  std::vector<std::byte> png = Patch().png();
  constexpr std::size_t kHeader = 16;  // width, height, and behind 5 more bytes their checksum
  for (const std::size_t at : {kHeader, kHeader + 4})
    png[at + 2] = std::byte{8192 / 256}, png[at + 3] = std::byte{0};
  mendHeaderChecksum(png);
  const auto before = residentAtMost();
  const auto made = normalMapFromBytes(png, "bumps.png", {});
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().message, "normal map 'bumps.png': it ends too early");
  EXPECT_LT(residentAtMost() - before, 100'000);
}

}  // namespace
}  // namespace carom::test
