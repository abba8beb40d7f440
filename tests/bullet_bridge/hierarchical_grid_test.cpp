#include "bullet_bridge/broad_phase/hierarchical_grid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/no_alloc_scope.h"

namespace carom {

using namespace bullet;

namespace {

using Boxes = std::vector<SweptBox>;
using Pairs = std::set<HierarchicalGrid::Pair>;
using Place = std::array<double, 3>;

class RandomPlaces {
 public:
  explicit RandomPlaces(std::uint32_t number) : engine_(number) {}
  double operator()(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine_);
  }
  Place placeIn(double halfExtent) {
    return {(*this)(-halfExtent, halfExtent), (*this)(-halfExtent, halfExtent),
            (*this)(-halfExtent, halfExtent)};
  }

 private:
  std::mt19937 engine_;
};

// Adds a cube whose body number is 1000 plus its index in `boxes`.
void addCube(Boxes& boxes, const Place& centre, double size, bool active = true) {
  SweptBox box;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    box.low[axis] = static_cast<float>(centre[axis] - 0.5 * size);
    box.high[axis] = static_cast<float>(centre[axis] + 0.5 * size);
  }
  box.body = static_cast<std::uint32_t>(1000 + boxes.size());
  box.active = active;
  boxes.push_back(box);
}

bool isFinite(const SweptBox& box) {
  const auto finite = [](float value) { return std::isfinite(value); };
  return std::all_of(box.low.begin(), box.low.end(), finite) &&
         std::all_of(box.high.begin(), box.high.end(), finite);
}

bool meet(const SweptBox& a, const SweptBox& b) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (std::max(a.low[axis], b.low[axis]) > std::min(a.high[axis], b.high[axis])) return false;
  }
  return true;
}

// The oracle: every box is tested against every other one.
Pairs allPairs(const Boxes& boxes) {
  Pairs pairs;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const SweptBox& a = boxes[i];
      const SweptBox& b = boxes[j];
      if ((a.active || b.active) && isFinite(a) && isFinite(b) && meet(a, b)) {
        pairs.insert(std::minmax(a.body, b.body));
      }
    }
  }
  return pairs;
}

// Returns the number of pairs.
std::size_t expectAllPairsOnce(const Boxes& boxes) {
  HierarchicalGrid near;
  const auto found = near.find(boxes);
  const Pairs expected = allPairs(boxes);
  EXPECT_EQ(found.size(), expected.size());
  EXPECT_EQ(Pairs(found.begin(), found.end()), expected);
  return expected.size();
}

Boxes gas(std::size_t count, std::uint32_t seed) {
  RandomPlaces random(seed);
  Boxes boxes;
  while (boxes.size() < count) {
    const Place place = random.placeIn(1.0);
    addCube(boxes, place, random(0.1, 0.2));
  }
  return boxes;
}

// Boxes with sizes over five powers of ten; half of them are crowded in a hundredth of the width.
Boxes allSizes(std::size_t count, std::uint32_t seed) {
  RandomPlaces random(seed);
  Boxes boxes;
  while (boxes.size() < count) {
    const double size = std::pow(10.0, random(-3.0, 2.0));
    const double spread = random(0.0, 1.0) < 0.5 ? 1.0 : 100.0;
    const Place place = random.placeIn(spread);
    addCube(boxes, place, size, random(0.0, 1.0) < 0.7);
  }
  return boxes;
}

TEST(HierarchicalGrid, FindsEveryPairOfAGasOnce) {
  std::size_t pairs = 0;
  for (const std::size_t count : {0u, 1u, 2u, 3u, 10u, 100u, 1000u})
    pairs += expectAllPairsOnce(gas(count, static_cast<std::uint32_t>(count)));
  EXPECT_GT(pairs, 1000u);
}

TEST(HierarchicalGrid, FindsEveryPairOfVeryDifferentSizesOnce) {
  for (std::uint32_t seed = 0; seed < 20; ++seed)
    EXPECT_GT(expectAllPairsOnce(allSizes(300, seed)), 100u);
}

TEST(HierarchicalGrid, FindsEveryPairOfManySmallBoxesAmongAFewLargeOnes) {
  RandomPlaces random(3);
  Boxes boxes = gas(500, 3);
  for (int i = 0; i < 5; ++i) {
    addCube(boxes, random.placeIn(1.0), 100.0, false);
    addCube(boxes, random.placeIn(1.0), 0.7);
    addCube(boxes, random.placeIn(1.0), 0.7, false);
  }
  expectAllPairsOnce(boxes);
}

TEST(HierarchicalGrid, FindsEveryPairOfFewSmallBoxesAmongManyLargeOnes) {
  RandomPlaces random(4);
  Boxes boxes = gas(500, 4);
  for (int i = 0; i < 20; ++i)
    addCube(boxes, random.placeIn(1.0), 0.001, i % 2 == 0);
  expectAllPairsOnce(boxes);
}

TEST(HierarchicalGrid, LargeBoxesThatEndJustBelowZeroFindSmallOnesThatBeginThere) {
  RandomPlaces random(6);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Boxes boxes;
    while (boxes.size() < 3000) {
      Place place = random.placeIn(1.0);
      if (random(0.0, 1.0) < 0.1) place[axis] = 0.05 - random(0.0, 3e-4);
      addCube(boxes, place, 0.1);
    }
    for (int i = 0; i < 10; ++i) {
      Place place = random.placeIn(0.5);
      place[axis] = -0.25 - random(0.0, 3e-4);
      addCube(boxes, place, 0.5);
    }
    expectAllPairsOnce(boxes);
  }
}

TEST(HierarchicalGrid, FindsEveryPairInPlanesAndRows) {
  RandomPlaces random(5);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Boxes plane, row, evenRow;
    for (int i = 0; i < 300; ++i) {
      Place place = random.placeIn(1.0);
      place[axis] = 7.0;
      addCube(plane, place, 0.1);
      Place alone{-3.0, -3.0, -3.0};
      alone[axis] = random(-5.0, 5.0);
      addCube(row, alone, 0.1);
      alone[axis] = 0.25 * i;  // they just touch
      addCube(evenRow, alone, 0.25);
    }
    expectAllPairsOnce(plane);
    expectAllPairsOnce(row);
    EXPECT_EQ(expectAllPairsOnce(evenRow), 299u);
  }
}

TEST(HierarchicalGrid, FindsEveryPairInAThrongWithStragglersFarAway) {
  for (std::uint32_t seed = 0; seed < 20; ++seed) {
    RandomPlaces random(seed);
    Boxes boxes = gas(200, seed);
    for (int i = 0; i < 6; ++i) {
      const Place place = random.placeIn(std::pow(10.0, i));
      addCube(boxes, place, 0.2);
      addCube(boxes, place, 0.1);
    }
    EXPECT_GT(expectAllPairsOnce(boxes), 40u);
  }
}

TEST(HierarchicalGrid, BoxesWhereFloatsAreCoarseHaveTheirPairs) {
  Boxes boxes = gas(50, 8);
  for (const double place : {1e4, 1e6, 1e9, 1e20, 1e30}) {
    addCube(boxes, {place, place, -place}, 0.2);
    addCube(boxes, {place, place, -place}, 0.1);
  }
  expectAllPairsOnce(boxes);
}

TEST(HierarchicalGrid, BoxesInOnePlaceAreAllPairs) {
  for (const double size : {0.0, 1e-3, 1.0}) {
    Boxes boxes;
    for (int i = 0; i < 40; ++i)
      addCube(boxes, {1.0, -2.0, 3.0}, size);
    EXPECT_EQ(expectAllPairsOnce(boxes), 40u * 39u / 2u);
  }
}

TEST(HierarchicalGrid, TwoThatAreInactiveAreNoPair) {
  Boxes boxes = gas(600, 9);
  for (std::size_t i = 0; i < boxes.size(); ++i)
    boxes[i].active = i % 50 == 0;
  EXPECT_GT(expectAllPairsOnce(boxes), 10u);
  for (SweptBox& box : boxes)
    box.active = false;
  EXPECT_TRUE(HierarchicalGrid().find(boxes).empty());
}

TEST(HierarchicalGrid, BoxesThatAreNowhereDoNotDisturbTheOthers) {
  const auto infinity = std::numeric_limits<float>::infinity();
  Boxes boxes = gas(200, 10);
  for (std::size_t i = 3; i < boxes.size(); i += 8) {
    float& low = boxes[i].low[i % 3];
    float& high = boxes[i].high[i % 3];
    if (i % 5 == 0) low = std::nanf("");
    if (i % 5 == 1) high = infinity;
    if (i % 5 == 2) low = -infinity;
    if (i % 5 == 3) low = -infinity, high = infinity;
    if (i % 5 == 4) low = high = std::nanf("");
  }
  EXPECT_GT(expectAllPairsOnce(boxes), 40u);
}

TEST(HierarchicalGrid, TheLowerBodyComesFirst) {
  Boxes boxes = gas(2, 11);
  boxes[1] = boxes[0];
  boxes[0].body = 9;
  boxes[1].body = 4;
  HierarchicalGrid near;
  const auto found = near.find(boxes);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0], HierarchicalGrid::Pair(4, 9));
}

TEST(HierarchicalGrid, TheOrderDependsOnNothingButTheBoxes) {
  const Boxes boxes = allSizes(500, 12);
  HierarchicalGrid near;
  const auto first = near.find(boxes);
  const std::vector<HierarchicalGrid::Pair> pairs(first.begin(), first.end());
  near.find(gas(700, 13));
  HierarchicalGrid fresh;
  for (HierarchicalGrid* again : {&near, &fresh}) {
    const auto found = again->find(boxes);
    EXPECT_TRUE(std::equal(found.begin(), found.end(), pairs.begin(), pairs.end()));
  }
}

TEST(HierarchicalGrid, AllocatesNothingOnceItHasSeenTheScene) {
  const std::array<Boxes, 3> scenes{allSizes(500, 14), gas(400, 15), gas(0, 0)};
  HierarchicalGrid near;
  for (const Boxes& boxes : scenes)
    near.find(boxes);
  const test::NoAllocScope scope;
  for (const Boxes& boxes : scenes)
    near.find(boxes);
  EXPECT_EQ(scope.allocations(), 0u);
}

}  // namespace
}  // namespace carom
