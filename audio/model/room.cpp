#include "carom/audio/room.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <string>
#include <utility>

namespace carom {
namespace {

constexpr double kTolerance = 1e-6;  // 1 for directions; m for places, where it only decides edges
constexpr int kMaxOrder = 32;
constexpr std::size_t kMostReflectors = 1000;  // each is compared with all others

/// Two walls that face each other: low <= normal . x <= low + size.
struct Pair {
  std::size_t lowWall = 0;   // its normal is `normal`
  std::size_t highWall = 0;  // its normal is -`normal`
  Vec3 normal = Vec3::UnitX();
  double low = 0.0;   // m
  double size = 0.0;  // m
};

using Box = std::array<Pair, 3>;

Error refusal(std::size_t reflector, const std::string& what) {
  return Error{"reflector " + std::to_string(reflector) + ": " + what};
}

bool isSamePlane(const Reflector& one, const Reflector& other) {
  return (one.normal - other.normal).norm() <= kTolerance &&
         std::abs(one.offset - other.offset) <= kTolerance;
}

Status checkReflector(const Room& room, std::size_t index) {
  const Reflector& wall = room.reflectors[index];
  if (!wall.normal.allFinite() || std::abs(wall.normal.norm() - 1.0) > kTolerance) {
    return refusal(index, "its normal must have length 1");
  }
  if (!std::isfinite(wall.offset)) return refusal(index, "its offset must be a finite number");
  if (!isValid(wall.absorption)) {
    return refusal(index, "its absorption coefficients must lie between 0 and 1");
  }
  for (std::size_t other = 0; other < index; ++other) {
    if (isSamePlane(wall, room.reflectors[other])) {
      return refusal(index, "the same plane as reflector " + std::to_string(other) +
                                "; its reflection would be heard twice");
    }
  }
  return std::monostate{};
}

Status checkRoom(const Room& room) {
  if (room.order < 0 || room.order > kMaxOrder) {
    return Error{"order is " + std::to_string(room.order) + ", must be 0 to " +
                 std::to_string(kMaxOrder)};
  }
  if (room.reflectors.size() > kMostReflectors)
    return Error{std::to_string(room.reflectors.size()) + " reflectors, must be at most " +
                 std::to_string(kMostReflectors)};
  for (std::size_t index = 0; index < room.reflectors.size(); ++index) {
    if (Status checked = checkReflector(room, index); !checked) return checked;
  }
  return std::monostate{};
}

/// Returns the wall that faces `wall`, or nothing.
std::optional<std::size_t> facing(const Room& room, std::size_t wall) {
  for (std::size_t other = 0; other < room.reflectors.size(); ++other) {
    const Vec3 sum = room.reflectors[wall].normal + room.reflectors[other].normal;
    if (other != wall && sum.norm() <= kTolerance) return other;
  }
  return std::nullopt;
}

std::optional<Pair> makePair(const Room& room, std::size_t wall) {
  const std::optional<std::size_t> opposite = facing(room, wall);
  if (!opposite) return std::nullopt;
  const Reflector& low = room.reflectors[wall];
  const double size = -room.reflectors[*opposite].offset - low.offset;
  if (!(size > 0.0)) return std::nullopt;
  return Pair{wall, *opposite, low.normal.normalized(), low.offset, size};
}

bool isPerpendicular(const Pair& one, const Pair& other) {
  return std::abs(one.normal.dot(other.normal)) <= kTolerance;
}

bool isPaired(const std::vector<Pair>& pairs, std::size_t wall) {
  return std::ranges::any_of(
      pairs, [&](const Pair& pair) { return pair.lowWall == wall || pair.highWall == wall; });
}

std::optional<Box> findBox(const Room& room) {
  if (room.reflectors.size() != 6) return std::nullopt;
  std::vector<Pair> pairs;
  for (std::size_t wall = 0; wall < 6; ++wall) {
    if (isPaired(pairs, wall)) continue;
    const std::optional<Pair> pair = makePair(room, wall);
    if (!pair || isPaired(pairs, pair->highWall)) return std::nullopt;
    pairs.push_back(*pair);
  }
  if (pairs.size() != 3 || !isPerpendicular(pairs[0], pairs[1]) ||
      !isPerpendicular(pairs[1], pairs[2]) || !isPerpendicular(pairs[2], pairs[0])) {
    return std::nullopt;
  }
  return Box{pairs[0], pairs[1], pairs[2]};
}

Error notABox(const std::string& what) {
  return Error{what +
               " needs a box: six reflectors in three pairs that face each other, the pairs "
               "perpendicular, with air between"};
}

Image mirrorAt(const Reflector& wall, std::size_t index) {
  const Vec3 normal = wall.normal.normalized();
  Image image;
  image.linear -= 2.0 * normal * normal.transpose();
  image.shift = 2.0 * wall.offset * normal;
  image.reflectors = {index};
  image.order = 1;
  return image;
}

std::vector<Image> firstOrder(const Room& room) {
  std::vector<Image> images;
  images.reserve(room.reflectors.size());
  for (std::size_t index = 0; index < room.reflectors.size(); ++index) {
    images.push_back(mirrorAt(room.reflectors[index], index));
  }
  return images;
}

/// Moves `image` along one pair's axis to `cell`: with u = normal . x - low, u becomes
/// cell size + u for an even cell and (cell + 1) size - u for an odd one. |cell| reflections, the
/// first and every second one at the wall on the cell's own side.
void moveToCell(const Pair& pair, int cell, Image& image) {
  const bool odd = cell % 2 != 0;
  if (odd) {
    image.linear -= 2.0 * pair.normal * pair.normal.transpose();
    image.shift += ((cell + 1) * pair.size + 2.0 * pair.low) * pair.normal;
  } else {
    image.shift += cell * pair.size * pair.normal;
  }
  const auto count = static_cast<std::size_t>(std::abs(cell));
  const std::size_t near = cell > 0 ? pair.highWall : pair.lowWall;
  const std::size_t far = cell > 0 ? pair.lowWall : pair.highWall;
  image.reflectors.insert(image.reflectors.end(), (count + 1) / 2, near);
  image.reflectors.insert(image.reflectors.end(), count / 2, far);
  image.order += std::abs(cell);
}

Image latticeImage(const Box& box, const std::array<int, 3>& cell) {
  Image image;
  for (std::size_t axis = 0; axis < 3; ++axis)
    moveToCell(box[axis], cell[axis], image);
  std::ranges::sort(image.reflectors);
  return image;
}

std::vector<Image> lattice(const Box& box, int order) {
  std::vector<Image> images;
  for (int sum = 1; sum <= order; ++sum) {
    for (int x = -sum; x <= sum; ++x) {
      const int restX = sum - std::abs(x);
      for (int y = -restX; y <= restX; ++y) {
        const int z = restX - std::abs(y);
        images.push_back(latticeImage(box, {x, y, -z}));
        if (z != 0) images.push_back(latticeImage(box, {x, y, z}));
      }
    }
  }
  return images;
}

/// Distance (m) of a point from a wall, positive on the side of the air.
double height(const Reflector& wall, const Vec3& point) {
  return wall.normal.dot(point) - wall.offset;
}

bool isInAir(const Room& room, const Vec3& point) {
  return std::ranges::all_of(
      room.reflectors, [&](const Reflector& wall) { return height(wall, point) >= -kTolerance; });
}

}  // namespace

Result<std::vector<Image>> makeImages(const Room& room) {
  if (Status checked = checkRoom(room); !checked) return checked.error();
  if (room.order == 0) return std::vector<Image>();
  if (room.order == 1) return firstOrder(room);
  const std::optional<Box> box = findBox(room);
  if (!box) return notABox("order " + std::to_string(room.order));
  return lattice(*box, room.order);
}

bool isVisible(const Room& room, const Image& image, const Vec3& source, const Vec3& listener) {
  if (!isInAir(room, source) || !isInAir(room, listener)) return false;
  if (image.order > 1) return true;
  const Reflector& wall = room.reflectors[image.reflectors.front()];
  const double sourceHeight = std::max(0.0, height(wall, source));
  const double sum = sourceHeight + std::max(0.0, height(wall, listener));
  const double along = sum > 0.0 ? sourceHeight / sum : 0.5;
  const Vec3 mirrored = image.position(source);
  return isInAir(room, mirrored + along * (listener - mirrored));
}

Result<RoomMeasures> measureBox(const Room& room) {
  if (Status checked = checkRoom(room); !checked) return checked.error();
  const std::optional<Box> box = findBox(room);
  if (!box) return notABox("the measure of a room");
  const std::array<double, 3> size = {(*box)[0].size, (*box)[1].size, (*box)[2].size};
  RoomMeasures measures;
  measures.volume = size[0] * size[1] * size[2];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double area = measures.volume / size[axis];
    measures.surface += 2.0 * area;
    for (const std::size_t wall : {(*box)[axis].lowWall, (*box)[axis].highWall}) {
      for (std::size_t band = 0; band < kBandCount; ++band) {
        measures.meanAbsorption.coefficients[band] +=
            area * room.reflectors[wall].absorption.coefficients[band];
      }
    }
  }
  for (double& alpha : measures.meanAbsorption.coefficients) {
    alpha = std::min(1.0, alpha / measures.surface);
  }
  return measures;
}

}  // namespace carom
