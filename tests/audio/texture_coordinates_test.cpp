#include "carom/audio/texture_coordinates.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "audio/contact/contact_drive.h"
#include "tests/support/random.h"

namespace carom {

using namespace audio;

namespace {

using Corners = TextureCoordinates::Corners;
using Eigen::Vector2d;

/// A mesh with a picture on it: a strip of 24 x 1 quads, bent or not.
struct Strip {
  SurfaceMesh mesh;
  std::vector<Corners> corners;
};

constexpr int kQuads = 24;

/// A strip with vertices at `place`(s, t), s and t from 0 to 1, and texture coordinates
/// `picture`(s, t).
template <typename Place, typename Picture>
Strip strip(Place place, Picture picture) {
  Strip made;
  for (int i = 0; i <= kQuads; ++i)
    for (const double t : {0.0, 1.0})
      made.mesh.vertices.push_back(place(static_cast<double>(i) / kQuads, t));
  for (std::uint32_t i = 0; i < kQuads; ++i) {
    const auto at = [&](std::uint32_t along, std::uint32_t across) {
      return Vector2d(picture(static_cast<double>(i + along) / kQuads, across));
    };
    made.mesh.triangles.push_back({2 * i, 2 * i + 2, 2 * i + 3});
    made.corners.push_back({at(0, 0), at(1, 0), at(1, 1)});
    made.mesh.triangles.push_back({2 * i, 2 * i + 3, 2 * i + 1});
    made.corners.push_back({at(0, 0), at(1, 1), at(0, 1)});
  }
  return made;
}

Vector2d plain(double s, double t) {
  return {s, t};
}

TEST(TextureCoordinates, APictureOnARectangleIsAsLargeAsItAndLiesAlongIt) {
  // The rectangle is 0.6 m along z and 0.2 m along x, seen from +y: u is along z, v along x.
  const Strip flat = strip([](double s, double t) { return Vec3(0.2 * t, 0.0, 0.6 * s); }, plain);
  const auto coordinates = TextureCoordinates::of(flat.mesh, flat.corners);
  ASSERT_TRUE(coordinates) << coordinates.error().message;
  EXPECT_LT((coordinates->size() - Vector2d(0.6, 0.2)).norm(), 1e-12);
  Random random(1);
  for (int trial = 0; trial < 100; ++trial) {
    const Vec3 point{random.between(0.0, 0.2), random.between(-0.1, 0.1), random.between(0.0, 0.6)};
    const TextureCoordinates::Patch patch = coordinates->at(point);
    EXPECT_LT((patch.at - Vector2d(point.z(), point.x())).norm(), 1e-12);
    EXPECT_NEAR(patch.stretch, 1.0, 1e-12);
    EXPECT_LT((patch.perMetre.row(0) - Vec3::UnitZ().transpose()).norm(), 1e-12);
    EXPECT_LT((patch.perMetre.row(1) - Vec3::UnitX().transpose()).norm(), 1e-12);
    EXPECT_LT((patch.tangents - patch.perMetre).norm(), 1e-12);
  }
}

/// For any turn, mirroring, shift, repetition and stretch of the picture, a step on the surface
/// leads where the coordinates say, and the tangents are unit vectors in the surface, along u and
/// v.
TEST(TextureCoordinates, AnyLinearPictureIsFollowed) {
  Random random(2);
  for (int trial = 0; trial < 50; ++trial) {
    Eigen::Matrix2d map;
    for (int entry = 0; entry < 4; ++entry)
      map(entry) = random.between(-3.0, 3.0);
    if (std::abs(map.determinant()) < 0.1) continue;
    const Vector2d shift{random.between(-5.0, 5.0), random.between(-5.0, 5.0)};
    const Strip flat =
        strip([](double s, double t) { return Vec3(s, t, 0.0); },
              [&](double s, double t) { return Vector2d(map * Vector2d(s, t) + shift); });
    const auto coordinates = TextureCoordinates::of(flat.mesh, flat.corners);
    ASSERT_TRUE(coordinates);
    const Vector2d size = coordinates->size();
    const Vector2d from{random.between(0.0, 1.0), random.between(0.0, 1.0)};
    const Vector2d way{random.between(-0.1, 0.1), random.between(-0.1, 0.1)};
    const auto patch = coordinates->at({from.x(), from.y(), 0.0});
    EXPECT_LT((patch.at - size.cwiseProduct(map * from + shift)).norm(), 1e-10);
    EXPECT_LT((patch.perMetre * Vec3(way.x(), way.y(), 0.0) - size.cwiseProduct(map * way)).norm(),
              1e-10);
    EXPECT_NEAR(patch.stretch * patch.stretch, size.x() * size.y() * std::abs(map.determinant()),
                1e-10);
    // Along the first tangent u grows and v stays; along the second v grows.
    const Vector2d right = (map.inverse() * Vector2d::UnitX()).normalized();
    EXPECT_LT((patch.tangents.row(0).head<2>() - right.transpose()).norm(), 1e-10);
    const Vector2d up = patch.tangents.row(1).head<2>();
    EXPECT_NEAR(up.dot(right), 0.0, 1e-12);
    EXPECT_NEAR(up.norm(), 1.0, 1e-12);
    EXPECT_GT((map * up).y(), 0.0);
    // The pictures per metre, along u and v, are those of the whole mesh.
    EXPECT_NEAR(1.0 / size.x(), map.row(0).norm(), 1e-10);
    EXPECT_NEAR(1.0 / size.y(), map.row(1).norm(), 1e-10);
  }
}

SurfaceTexture wavesAlongU(const Vector2d& size, int count) {
  std::vector<SurfaceTexture::Slope> slopes;
  const std::size_t width = 64 * static_cast<std::size_t>(count);
  for (std::size_t v = 0; v < 2; ++v)
    for (std::size_t u = 0; u < width; ++u)
      slopes.emplace_back(
          0.1F * static_cast<float>(
                     std::cos(2.0 * std::numbers::pi * (static_cast<double>(u) + 0.5) / 64.0)),
          0.0F);
  return *SurfaceTexture::ofSlopes({width, 2},
                                   {size.x() / static_cast<double>(width), 0.5 * size.y()}, slopes);
}

/// The momentum (N s) of a body that slides along `place`, after each node: rows of (share of the
/// way, momentum).
template <typename Place>
std::vector<Vector2d> momenta(const SurfaceTexture& texture, const TextureCoordinates* coordinates,
                              int steps, Place place) {
  ContactDrive drive;
  std::vector<PulseNode> nodes;
  std::vector<Vector2d> found;
  double momentum = 0.0;
  for (int index = 0; index < steps; ++index) {
    ContactDrive::Step step;
    step.duration = 0.01;
    step.load = 1e6;
    step.mass = 0.3;
    step.radius = 1e-9;  // reaches everywhere, and is rigid
    step.sampleRate = 48000.0;
    step.surfaces[1] = {.texture = &texture,
                        .coordinates = coordinates,
                        .from = place(static_cast<double>(index) / steps),
                        .to = place(static_cast<double>(index + 1) / steps),
                        .normal = Vec3::UnitY()};
    drive.advance(step, nodes);
    for (const PulseNode& node : nodes) {
      momentum += node.weight;
      found.emplace_back((index + node.u) / steps, momentum);
    }
  }
  return found;
}

/// With a picture of four waves once around a cylinder the momentum is m v s cos(4 x angle) all
/// along the path, over the joints of triangles and over the seam, where the picture begins again.
TEST(TextureCoordinates, APathAroundACylinderHearsThePictureOnceAround) {
  constexpr double kRadius = 0.1;
  const auto around = [](double turns, double t) {
    const double angle = 2.0 * std::numbers::pi * turns;
    return Vec3(kRadius * std::cos(angle), 0.1 * t, -kRadius * std::sin(angle));
  };
  const Strip tube = strip(around, plain);
  const auto coordinates = TextureCoordinates::of(tube.mesh, tube.corners);
  ASSERT_TRUE(coordinates);
  const double length = kQuads * 2.0 * kRadius * std::sin(std::numbers::pi / kQuads);
  EXPECT_NEAR(coordinates->size().x(), length, 1e-9);
  const SurfaceTexture texture = wavesAlongU(coordinates->size(), 4);
  // The path goes one and a half times around, along the polygon.
  const auto place = [&](double share) {
    const double at = 1.5 * kQuads * share;
    const double whole = std::floor(at);
    const Vec3 from = around(whole / kQuads, 0.5);
    return Vec3(from + (at - whole) * (around((whole + 1.0) / kQuads, 0.5) - from));
  };
  const double speed = 1.5 * length / (36 * 0.01);
  const auto expected = [&](double share) {
    return 0.3 * speed * 0.1 * std::cos(4.0 * 2.0 * std::numbers::pi * 1.5 * share);
  };
  const auto found = momenta(texture, &*coordinates, 36, place);
  ASSERT_EQ(found.size(), 36u * 480u);
  double farthest = 0.0;
  for (const Vector2d& one : found)
    farthest = std::max(farthest, std::abs(one.y() + expected(0.0) - expected(one.x())));
  EXPECT_LT(farthest, 0.01 * 0.3 * speed * 0.1);
}

/// The pictures on the two halves of a plane do not fit together: each half keeps its own.
TEST(TextureCoordinates, OverASeamThePathGoesOnWhereTheOtherSheetSays) {
  // Along x there are 12 quads with u from 0 to 0.5, then the picture again from 0.3125 on: it is
  // off by a quarter wave of eight.
  const auto along = [](double s, double t) { return Vec3(s, 0.0, -0.1 * t); };
  Strip flat = strip(along, plain);
  for (std::size_t index = kQuads; index < flat.corners.size(); ++index)
    for (Vec2& corner : flat.corners[index])
      corner.x() += 0.3125;
  const auto coordinates = TextureCoordinates::of(flat.mesh, flat.corners);
  ASSERT_TRUE(coordinates);
  const SurfaceTexture texture = wavesAlongU(coordinates->size(), 4);
  const auto found = momenta(texture, &*coordinates, 16, [](double share) {
    return Vec3(0.03125 + 0.9375 * share, 0.0, -0.05);
  });
  const double scale = 0.3 * (0.9375 / 0.16) * 0.1;
  const auto slope = [](double x) {
    const double u = x < 0.5 ? x : x + 0.3125;
    return std::cos(4.0 * 2.0 * std::numbers::pi * u);
  };
  double farthest = 0.0;
  for (const Vector2d& one : found) {
    const double x = 0.03125 + 0.9375 * one.x();
    if (x > 0.49 && x < 0.56) continue;  // the step over the seam ends behind it
    farthest = std::max(farthest, std::abs(one.y() / scale + slope(0.03125) - slope(x)));
  }
  EXPECT_LT(farthest, 0.02);
}

TEST(TextureCoordinates, WhatCannotBeSeenIsSilentAndNotInfinite) {
  Strip flat = strip([](double s, double t) { return Vec3(s, 0.0, -t); }, plain);
  flat.corners[10] = {Vector2d(0.1, 0.1), Vector2d(0.1, 0.1), Vector2d(0.1, 0.1)};
  flat.corners[11] = flat.corners[10];
  flat.mesh.vertices.emplace_back(5.0, 0.0, 0.0);
  flat.mesh.triangles.push_back({0, 0, 50});  // a degenerate triangle: a line
  flat.corners.push_back({Vector2d(0, 0), Vector2d(1, 0), Vector2d(1, 1)});
  const auto coordinates = TextureCoordinates::of(flat.mesh, flat.corners);
  ASSERT_TRUE(coordinates) << coordinates.error().message;
  EXPECT_TRUE(coordinates->size().allFinite());
  EXPECT_EQ(coordinates->at({5.5 / kQuads, 0.0, -0.4}).stretch, 0.0);
  EXPECT_EQ(coordinates->at({5.0, 0.0, 0.0}).stretch, 0.0);
  const SurfaceTexture texture = wavesAlongU(coordinates->size(), 4);
  const auto found = momenta(texture, &*coordinates, 50,
                             [](double share) { return Vec3(6.0 * share, 0.0, -0.4); });
  for (const Vector2d& one : found)
    ASSERT_TRUE(one.allFinite());
}

TEST(TextureCoordinates, WhatIsNoneIsRefused) {
  const Strip good = strip([](double s, double t) { return Vec3(s, 0.0, -t); }, plain);
  const auto reason = [](const Strip& made) {
    const auto coordinates = TextureCoordinates::of(made.mesh, made.corners);
    return coordinates ? std::string("none") : coordinates.error().message;
  };
  EXPECT_EQ(reason(good), "none");
  EXPECT_EQ(reason({}), "texture coordinates: the mesh has no triangles");
  Strip bad = good;
  bad.corners.pop_back();
  EXPECT_EQ(reason(bad), "texture coordinates: 47 triangles have coordinates; expected all 48");
  bad = good;
  bad.mesh.triangles[3][1] = 50;
  EXPECT_EQ(reason(bad), "texture coordinates: a triangle names vertex 50 of 50");
  bad = good;
  bad.mesh.vertices[7].x() = std::numeric_limits<double>::infinity();
  EXPECT_EQ(reason(bad), "texture coordinates: a vertex is not finite");
  bad = good;
  bad.corners[5][2].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(reason(bad), "texture coordinates: a coordinate of triangle 5 is not finite");
  bad = good;
  for (Corners& corners : bad.corners)
    for (Vec2& corner : corners)
      corner.y() = corner.x();
  EXPECT_EQ(reason(bad), "texture coordinates: they lie in one line all over the mesh");
}

}  // namespace
}  // namespace carom
