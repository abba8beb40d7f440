#include "native/jello/jello_skin.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "carom/audio/surface_mesh.h"

namespace carom::native {
namespace {

/// Relative tolerance of squared lengths: nearer places are one place, met from two triangles.
constexpr double kSamePlace = 1e-12;
constexpr std::array<std::array<std::size_t, 3>, 2> kHalves = {{{0, 1, 2}, {0, 2, 3}}};

Vec3 at(const JelloSkin::Places& places, std::size_t point) {
  return {places[0][point], places[1][point], places[2][point]};
}

/// Angle (rad) of the triangle at its corner, if this is the nearest place; more than any corner
/// has if the nearest place is on an edge or in the face.
double angleOf(const std::array<Vec3, 3>& corners, const std::array<double, 3>& weights) {
  for (std::size_t corner = 0; corner < 3; ++corner) {
    if (weights[corner] < 1.0) continue;
    const Vec3 one = corners[(corner + 1) % 3] - corners[corner];
    const Vec3 two = corners[(corner + 2) % 3] - corners[corner];
    return std::atan2(one.cross(two).norm(), one.dot(two));
  }
  return 4.0;
}

/// Squared distance from the point to the bounding box of the four corners.
double squareToBox(const std::array<Vec3, 4>& corners, const Vec3& point) {
  const Vec3 low = corners[0].cwiseMin(corners[1]).cwiseMin(corners[2].cwiseMin(corners[3]));
  const Vec3 high = corners[0].cwiseMax(corners[1]).cwiseMax(corners[2].cwiseMax(corners[3]));
  return (point - point.cwiseMax(low).cwiseMin(high)).squaredNorm();
}

}  // namespace

JelloSkin::JelloSkin(std::size_t count) {
  const std::array<std::size_t, 3> leads = {count * count, count, 1};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t u = leads[(axis + 1) % 3];
    const std::size_t v = leads[(axis + 2) % 3];
    for (const std::size_t side : {std::size_t{0}, count - 1}) {
      for (std::size_t i = 0; i + 1 < count; ++i) {
        for (std::size_t j = 0; j + 1 < count; ++j) {
          const std::size_t a = side * leads[axis] + i * u + j * v;
          if (side == 0)
            squares_.push_back({a, a + v, a + u + v, a + u});
          else
            squares_.push_back({a, a + u, a + u + v, a + v});
        }
      }
    }
  }
}

double JelloSkin::volume(const Places& places) const {
  const Vec3 from = at(places, 0);
  double sixfold = 0.0;
  for (const Square& square : squares_) {
    const Vec3 a = at(places, square[0]) - from;
    const Vec3 b = at(places, square[1]) - from;
    const Vec3 c = at(places, square[2]) - from;
    const Vec3 d = at(places, square[3]) - from;
    sixfold += a.cross(b).dot(c) + a.cross(c).dot(d);
  }
  return sixfold / 6.0;
}

std::optional<JelloSkin::Contact> JelloSkin::meet(const Places& places, const Vec3& middle,
                                                  double radius) const {
  Contact nearest;
  double least = std::numeric_limits<double>::infinity();
  Vec3 facing = Vec3::Zero();
  for (const Square& square : squares_) {
    const std::array<Vec3, 4> all = {at(places, square[0]), at(places, square[1]),
                                     at(places, square[2]), at(places, square[3])};
    if (squareToBox(all, middle) > least * (1.0 + kSamePlace)) continue;
    for (const auto& half : kHalves) {
      const std::array<Vec3, 3> corners = {all[half[0]], all[half[1]], all[half[2]]};
      const auto weights = nearestInTriangle(middle, corners[0], corners[1], corners[2]);
      const Vec3 place =
          weights[0] * corners[0] + weights[1] * corners[1] + weights[2] * corners[2];
      const double distance2 = (middle - place).squaredNorm();
      if (!(distance2 <= least * (1.0 + kSamePlace))) continue;
      const Vec3 area = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
      const double size = area.norm();
      const Vec3 share = size > 0.0 ? Vec3(angleOf(corners, weights) / size * area) : Vec3::Zero();
      const double size2 = kSamePlace * (distance2 + area.norm());
      const bool isSame = (place - nearest.place).squaredNorm() <= size2;
      if (isSame && std::isfinite(least)) facing += share;
      if (distance2 >= least) continue;
      if (!isSame || std::isinf(least)) facing = share;
      least = distance2;
      nearest.points = {square[half[0]], square[half[1]], square[half[2]]};
      nearest.weights = weights;
      nearest.place = place;
    }
  }
  const double distance = std::sqrt(least);
  const bool isOutside = (middle - nearest.place).dot(facing) >= 0.0;
  nearest.depth = radius - (isOutside ? distance : -distance);
  if (!(nearest.depth > 0.0)) return std::nullopt;
  if (distance > 1e-9 * radius)
    nearest.normal = (isOutside ? 1.0 : -1.0) / distance * (middle - nearest.place);
  else
    nearest.normal = facing.normalized();
  return nearest;
}

}  // namespace carom::native
