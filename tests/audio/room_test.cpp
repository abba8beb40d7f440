#include "carom/audio/room.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/no_alloc_scope.h"
#include "tests/support/random.h"

namespace carom {
namespace {

using test::NoAllocScope;

Absorption uniform(double alpha) {
  Absorption absorption;
  absorption.coefficients.fill(alpha);
  return absorption;
}

/// A box with one corner at `corner` and its edges along the columns of a rotation.
Room makeBox(const Vec3& size, int order, const Vec3& corner = Vec3::Zero(),
             const Quat& turn = Quat::Identity()) {
  Room room;
  room.order = order;
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 normal = turn * Vec3(Vec3::Unit(axis));
    const double low = normal.dot(corner);
    room.reflectors.push_back({normal, low, uniform(0.1)});
    room.reflectors.push_back({-normal, -(low + size[axis]), uniform(0.1)});
  }
  return room;
}

std::vector<Image> imagesOf(const Room& room) {
  Result<std::vector<Image>> images = makeImages(room);
  EXPECT_TRUE(images) << (images ? "" : images.error().message);
  return images ? *images : std::vector<Image>();
}

Vec3 mirrored(const Reflector& wall, const Vec3& point) {
  return point - 2.0 * (wall.normal.dot(point) - wall.offset) * wall.normal;
}

/// Adds to `found` the images of `source` in all sequences of `order` mirrors without the same
/// mirror twice in a row.
void enumerate(const Room& room, const Vec3& source, int order, std::vector<std::size_t> sequence,
               std::vector<std::pair<Vec3, std::vector<std::size_t>>>& found) {
  if (static_cast<int>(sequence.size()) == order) {
    std::ranges::sort(sequence);
    found.emplace_back(source, sequence);
    return;
  }
  for (std::size_t wall = 0; wall < room.reflectors.size(); ++wall) {
    if (!sequence.empty() && sequence.back() == wall) continue;
    auto longer = sequence;
    longer.push_back(wall);
    enumerate(room, mirrored(room.reflectors[wall], source), order, longer, found);
  }
}

bool holds(const std::vector<Vec3>& points, const Vec3& point) {
  return std::ranges::any_of(points,
                             [&](const Vec3& other) { return (other - point).norm() < 1e-9; });
}

/// The distinct images, each with the shortest sequence of mirrors that reaches its place.
std::vector<std::pair<Vec3, std::vector<std::size_t>>> bruteForce(const Room& room,
                                                                  const Vec3& source, int order) {
  std::vector<Vec3> seen = {source};
  std::vector<std::pair<Vec3, std::vector<std::size_t>>> distinct;
  for (int length = 1; length <= order; ++length) {
    std::vector<std::pair<Vec3, std::vector<std::size_t>>> found;
    enumerate(room, source, length, {}, found);
    for (const auto& candidate : found) {
      if (holds(seen, candidate.first)) continue;
      seen.push_back(candidate.first);
      distinct.push_back(candidate);
    }
  }
  return distinct;
}

// --- Fields, as oracles ------------------------------------------------------------------------

/// Gradient, by differences, of the potential D . r / r^3 of a static dipole D at `at`; the wall
/// must cancel its normal part.
Vec3 dipoleGradient(const Vec3& dipole, const Vec3& at, const Vec3& point) {
  const double step = 1e-4;
  const auto potential = [&](const Vec3& x) {
    const Vec3 r = x - at;
    return dipole.dot(r) / std::pow(r.norm(), 3);
  };
  Vec3 gradient;
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 offset = step * Vec3::Unit(axis);
    gradient[axis] = (potential(point + offset) - potential(point - offset)) / (2.0 * step);
  }
  return gradient;
}

TEST(Images, OfADipoleLeaveARigidWallWithoutNormalVelocity) {
  Random random(1);
  for (int trial = 0; trial < 50; ++trial) {
    Room room;
    room.reflectors = {{random.direction(), random.between(-2.0, 2.0), uniform(0.0)}};
    const Reflector& wall = room.reflectors[0];
    const Vec3 foot = wall.offset * wall.normal;
    const Vec3 source = foot + random.between(0.5, 2.0) * wall.normal;
    const Vec3 dipole = random.direction();
    const Image image = imagesOf(room).at(0);
    const Vec3 sideways = wall.normal.unitOrthogonal() * random.between(-2.0, 2.0);
    const Vec3 onWall = foot + sideways;
    const Vec3 direct = dipoleGradient(dipole, source, onWall);
    const Vec3 both = direct + dipoleGradient(image.vector(dipole), image.position(source), onWall);
    EXPECT_NEAR(both.dot(wall.normal), 0.0, 1e-6 * (1.0 + direct.norm()));
  }
}

TEST(Images, OfABoxAreThoseOfAllRowsOfReflectionsUpToTheThirdOrder) {
  Random random(2);
  for (int trial = 0; trial < 6; ++trial) {
    const Vec3 size{random.between(2.0, 5.0), random.between(2.0, 5.0), random.between(2.0, 5.0)};
    const Quat turn = random.orientation();
    const Vec3 corner = 3.0 * random.inCube();
    const Room room = makeBox(size, 3, corner, turn);
    // A wall's coordinate along its axis is lowest at the corner: the box is corner + turn * [0,
    // L].
    const Vec3 source = corner + turn * size.cwiseProduct(Vec3(0.31, 0.42, 0.77));
    const auto expected = bruteForce(room, source, 3);
    const auto images = imagesOf(room);
    ASSERT_EQ(images.size(), 6u + 18u + 38u);
    ASSERT_EQ(images.size(), expected.size());
    for (const auto& row : expected) {
      const std::vector<std::size_t>& walls = row.second;
      const auto match = std::ranges::find_if(images, [&](const Image& image) {
        return (image.position(source) - row.first).norm() < 1e-9;
      });
      ASSERT_NE(match, images.end());
      EXPECT_EQ(match->reflectors, walls);
      EXPECT_EQ(match->order, static_cast<int>(walls.size()));
    }
  }
}

TEST(Images, OfABoxDoNotDependOnTheOrderOfTheReflections) {
  Random random(3);
  const Room room = makeBox({3.0, 4.0, 2.5}, 3, {1.0, 2.0, 3.0}, random.orientation());
  std::vector<std::pair<Vec3, std::vector<std::size_t>>> rows;
  enumerate(room, Vec3(0.5, 0.6, 0.7), 3, {}, rows);
  for (const auto& [place, walls] : rows) {
    // Perpendicular mirrors commute; a pair of parallel walls makes two images, one for each order.
    if (walls[0] / 2 == walls[1] / 2 || walls[1] / 2 == walls[2] / 2) continue;
    for (const auto& [other, same] : rows) {
      if (same != walls) continue;
      EXPECT_LT((place - other).norm(), 1e-12);
    }
  }
}

TEST(Images, AreCongruencesAndEachOnce) {
  const Room room = makeBox({3.0, 4.0, 2.5}, 6);
  const auto images = imagesOf(room);
  const Vec3 source(1.0, 1.1, 1.2);
  std::map<int, int> count;
  std::vector<Vec3> places = {source};
  for (const Image& image : images) {
    ++count[image.order];
    EXPECT_LT((image.linear * image.linear.transpose() - Eigen::Matrix3d::Identity()).norm(),
              1e-12);
    EXPECT_NEAR(image.linear.determinant(), image.order % 2 == 0 ? 1.0 : -1.0, 1e-12);
    EXPECT_EQ(image.reflectors.size(), static_cast<std::size_t>(image.order));
    EXPECT_FALSE(holds(places, image.position(source)));
    places.push_back(image.position(source));
  }
  for (int order = 1; order <= 6; ++order)
    EXPECT_EQ(count[order], 4 * order * order + 2);
}

/// The images' distances are those of the echoes: for a source and a listener in the middle of a
/// cube of edge L, the first-order images are all at the distance L.
TEST(Images, OfTheMiddleOfACubeAreAtItsEdge) {
  for (const Image& image : imagesOf(makeBox({2.0, 2.0, 2.0}, 1))) {
    EXPECT_NEAR((image.position({1.0, 1.0, 1.0}) - Vec3(1.0, 1.0, 1.0)).norm(), 2.0, 1e-12);
  }
}

TEST(Images, OfABoxAreAllSeenFromInsideAndNoneFromOutside) {
  Random random(4);
  for (const int order : {1, 3}) {
    const Vec3 size(3.0, 4.0, 2.5);
    const Room room = makeBox(size, order);
    for (const Image& image : imagesOf(room)) {
      const Vec3 inside = size.cwiseProduct(Vec3(random.between(0.0, 1.0), 0.3, 0.6));
      const Vec3 alsoInside = size.cwiseProduct(Vec3(0.7, random.between(0.0, 1.0), 0.2));
      EXPECT_TRUE(isVisible(room, image, inside, alsoInside));
      EXPECT_FALSE(isVisible(room, image, inside, Vec3(10.0, 10.0, 10.0)));
      EXPECT_FALSE(isVisible(room, image, Vec3(10.0, 10.0, 10.0), inside));
    }
  }
}

TEST(Images, AreSeenOnlyFromTheFreeSide) {
  Room floor;
  floor.reflectors = {{Vec3::UnitZ(), 1.0, uniform(0.0)}};
  const Image image = imagesOf(floor).at(0);
  EXPECT_TRUE(isVisible(floor, image, {0, 0, 2}, {3, 0, 1.5}));
  EXPECT_TRUE(isVisible(floor, image, {0, 0, 1}, {3, 0, 1}));  // on the floor
  EXPECT_FALSE(isVisible(floor, image, {0, 0, 0.5}, {3, 0, 2}));
  EXPECT_FALSE(isVisible(floor, image, {0, 0, 2}, {3, 0, 0.5}));
  EXPECT_FALSE(isVisible(floor, image, {0, 0, 0.5}, {3, 0, 0.5}));
}

/// A wedge of 45 degrees between the floor and a wall that leans over it: the floor's reflection is
/// heard while its point of reflection lies before the wall's foot. The oracle finds that point by
/// itself.
TEST(Images, AreCutOffWhereAnotherWallStandsInTheWay) {
  Random random(5);
  Room room;
  room.reflectors = {{Vec3::UnitZ(), 0.0, uniform(0.0)},
                     {Vec3(-1.0, 0.0, 1.0).normalized(), 0.0, uniform(0.0)},
                     {Vec3(-1.0, 0.2, -0.3).normalized(), -2.0, uniform(0.0)}};
  const auto images = imagesOf(room);
  const auto isFree = [&](const Vec3& point, double slack) {
    return std::ranges::all_of(room.reflectors, [&](const Reflector& wall) {
      return wall.normal.dot(point) >= wall.offset + slack;
    });
  };
  int seen = 0;
  int cut = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    const Vec3 source = 3.0 * random.inCube();
    const Vec3 listener = 3.0 * random.inCube();
    if (!isFree(source, 0.0) || !isFree(listener, 0.0)) continue;
    for (const Image& image : images) {
      const Reflector& wall = room.reflectors[image.reflectors[0]];
      // Bisection finds where the line from the listener to the image meets the wall.
      Vec3 near = listener;
      Vec3 far = image.position(source);
      for (int halving = 0; halving < 60; ++halving) {
        const Vec3 middle = 0.5 * (near + far);
        (wall.normal.dot(middle) >= wall.offset ? near : far) = middle;
      }
      const bool clearly = isFree(near, -1e-9);
      EXPECT_EQ(isVisible(room, image, source, listener), clearly);
      ++(clearly ? seen : cut);
    }
  }
  EXPECT_GT(seen, 100);
  EXPECT_GT(cut, 100);
}

TEST(Images, VisibilityDoesNotAllocate) {
  const Room room = makeBox({3.0, 4.0, 2.5}, 2);
  const auto images = imagesOf(room);
  const NoAllocScope scope;
  for (const Image& image : images)
    isVisible(room, image, {1, 1, 1}, {2, 2, 2});
  EXPECT_EQ(scope.allocations(), 0u);
}

TEST(Images, OfNothingAreNone) {
  EXPECT_TRUE(imagesOf(Room{}).empty());
  EXPECT_TRUE(imagesOf(makeBox({3.0, 4.0, 2.5}, 0)).empty());
}

TEST(Images, RefuseWhatTheyCannotMirror) {
  const double kNaN = std::numeric_limits<double>::quiet_NaN();
  Room room = makeBox({3.0, 4.0, 2.5}, 1);
  room.reflectors[1].normal *= 1.1;
  EXPECT_FALSE(makeImages(room));
  room = makeBox({3.0, 4.0, 2.5}, 1);
  room.reflectors[2].offset = kNaN;
  EXPECT_FALSE(makeImages(room));
  room = makeBox({3.0, 4.0, 2.5}, 1);
  room.reflectors[5].absorption = uniform(1.5);
  EXPECT_FALSE(makeImages(room));
  room = makeBox({3.0, 4.0, 2.5}, 1);
  room.reflectors.push_back(room.reflectors[0]);
  EXPECT_FALSE(makeImages(room));
  EXPECT_FALSE(makeImages(makeBox({3.0, 4.0, 2.5}, -1)));
  EXPECT_FALSE(makeImages(makeBox({3.0, 4.0, 2.5}, 33)));
}

TEST(Images, OfHigherOrderRefuseWhatIsNoBox) {
  Room open = makeBox({3.0, 4.0, 2.5}, 2);
  open.reflectors.pop_back();
  EXPECT_FALSE(makeImages(open));
  EXPECT_FALSE(measureBox(open));
  Room leaning = makeBox({3.0, 4.0, 2.5}, 2);
  leaning.reflectors[0].normal = leaning.reflectors[1].normal = Vec3(0.8, 0.6, 0.0);
  leaning.reflectors[1].normal = -leaning.reflectors[1].normal;
  EXPECT_FALSE(makeImages(leaning));
  Room insideOut = makeBox({3.0, 4.0, -2.5}, 2);
  EXPECT_FALSE(makeImages(insideOut));
}

TEST(Images, AreTheSameWhicheverWayTheWallsAreListed) {
  Room room = makeBox({3.0, 4.0, 2.5}, 2);
  std::swap(room.reflectors[0], room.reflectors[5]);
  std::swap(room.reflectors[1], room.reflectors[2]);
  const Vec3 source(1.0, 1.1, 1.2);
  std::vector<Vec3> places;
  for (const Image& image : imagesOf(makeBox({3.0, 4.0, 2.5}, 2))) {
    places.push_back(image.position(source));
  }
  for (const Image& image : imagesOf(room))
    EXPECT_TRUE(holds(places, image.position(source)));
}

TEST(MeasureBox, KnowsVolumeSurfaceAndTheMeanWeightedByArea) {
  Random random(6);
  Room room = makeBox({3.0, 4.0, 2.5}, 1, {1, 1, 1}, random.orientation());
  room.reflectors[4].absorption = uniform(0.7);  // one of the two walls of 3 by 4
  const Result<RoomMeasures> measures = measureBox(room);
  ASSERT_TRUE(measures);
  EXPECT_NEAR(measures->volume, 30.0, 1e-9);
  EXPECT_NEAR(measures->surface, 59.0, 1e-9);
  EXPECT_NEAR(measures->meanAbsorption.coefficients[3], (47.0 * 0.1 + 12.0 * 0.7) / 59.0, 1e-12);
}

}  // namespace
}  // namespace carom
