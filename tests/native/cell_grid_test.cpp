#include "native/scheduling/cell_grid.h"

#include <algorithm>
#include <cmath>
#include <set>

#include <gtest/gtest.h>

#include "tests/native/sphere_worlds.h"

namespace carom {

using namespace native;

namespace {

using namespace test;

struct Swarm {
  std::vector<Vec3> positions;
  std::vector<double> radii;
};

/// Spheres with radii from `least` to 1 cm, evenly on a logarithmic scale, anywhere in a cube of 20
/// cm.
Swarm swarm(std::size_t count, double least, std::uint64_t seed) {
  SplitMix random(seed);
  Swarm made;
  for (std::size_t sphere = 0; sphere < count; ++sphere) {
    made.positions.push_back(random.inCube(0.1));
    made.radii.push_back(least * std::pow(0.01 / least, random.between(0.0, 1.0)));
  }
  return made;
}

std::set<std::uint32_t> near(const CellGrid& grid, std::uint32_t sphere,
                             const CellGrid::Probe& probe) {
  std::set<std::uint32_t> found;
  grid.visitNear(sphere, probe, [&](std::uint32_t other) { found.insert(other); });
  return found;
}

class Grids : public testing::TestWithParam<double> {};

TEST_P(Grids, VisitAllThatTouch) {
  const Swarm all = swarm(400, GetParam(), 3);
  const CellGrid grid(all.positions, all.radii);
  EXPECT_GT(grid.levelCount(), 0U);
  for (std::uint32_t sphere = 0; sphere < all.radii.size(); ++sphere) {
    const auto visited = near(grid, sphere, {all.positions[sphere], all.radii[sphere], 0.0});
    EXPECT_FALSE(visited.contains(sphere));
    for (std::uint32_t other = 0; other < all.radii.size(); ++other) {
      const double gap = (all.positions[sphere] - all.positions[other]).norm() - all.radii[sphere] -
                         all.radii[other];
      if (other != sphere && gap <= 0.0) {
        EXPECT_TRUE(visited.contains(other)) << sphere;
      }
    }
  }
}

// Spheres fly from cell to cell. A sphere that comes to touch another one has been visited before,
// at the last crossing of either.
TEST_P(Grids, MissNobodyOnTheWay) {
  Swarm all = swarm(60, GetParam(), 9);
  CellGrid grid(all.positions, all.radii);
  SplitMix random(4);
  std::vector<Vec3> velocities;
  std::vector<double> crossings(all.radii.size());
  std::set<std::pair<std::uint32_t, std::uint32_t>> known;
  const auto meet = [&](std::uint32_t sphere) {
    return [&, sphere](std::uint32_t other) { known.insert(std::minmax(sphere, other)); };
  };
  const auto predict = [&](std::uint32_t sphere, double now) {
    const auto crossing = grid.nextCrossing(
        sphere,
        {all.positions[sphere] + now * velocities[sphere], velocities[sphere], Vec3::Zero()});
    crossings[sphere] = now + crossing.wait;
    return crossing;
  };
  std::vector<CellGrid::Crossing> next(all.radii.size());
  for (std::uint32_t sphere = 0; sphere < all.radii.size(); ++sphere) {
    velocities.push_back(random.inCube(1.0));
    next[sphere] = predict(sphere, 0.0);
    grid.visitNear(sphere, {all.positions[sphere], all.radii[sphere]}, meet(sphere));
  }
  for (double now = 0.0; now < 0.5;) {
    const auto sphere =
        static_cast<std::uint32_t>(std::ranges::min_element(crossings) - crossings.begin());
    now = crossings[sphere];
    grid.cross(sphere, next[sphere]);
    const Vec3 position = all.positions[sphere] + now * velocities[sphere];
    ASSERT_TRUE(grid.holds(sphere, position, 1e-12));
    grid.visitNew(sphere, next[sphere], {position, all.radii[sphere]}, meet(sphere));
    next[sphere] = predict(sphere, now);
    for (std::uint32_t other = 0; other < all.radii.size(); ++other) {
      const Vec3 there = all.positions[other] + now * velocities[other];
      const bool touch = (position - there).norm() <= all.radii[sphere] + all.radii[other];
      if (other != sphere && touch) {
        EXPECT_TRUE(known.contains(std::minmax(sphere, other))) << sphere << " " << other;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(LeastRadii, Grids, testing::Values(0.01, 0.005, 0.001, 1e-6));

TEST(CellGrid, FindsTheSmallFromTheLargeAndTheLargeFromTheSmall) {
  Swarm all = swarm(100, 1e-5, 1);
  for (double& radius : all.radii)
    radius = 1e-5;
  all.radii[0] = 0.1;
  all.positions[0] = Vec3::Zero();
  const CellGrid grid(all.positions, all.radii);
  EXPECT_EQ(grid.levelCount(), 2U) << "those between are empty";
  EXPECT_EQ(near(grid, 0, {all.positions[0], 0.1}).size(), 99U);
  for (std::uint32_t sphere = 1; sphere < 100; ++sphere)
    EXPECT_TRUE(near(grid, sphere, {all.positions[sphere], 1e-5}).contains(0));
}

TEST(CellGrid, LeavesOutWhatIsFarAway) {
  const Swarm all = swarm(4000, 0.01, 5);
  const CellGrid grid(all.positions, all.radii);
  std::size_t visited = 0;
  for (std::uint32_t sphere = 0; sphere < all.radii.size(); ++sphere)
    visited += near(grid, sphere, {all.positions[sphere], all.radii[sphere], 0.0}).size();
  // The 27 near cells of 2 cm hold 4000 * 27 / 1000 spheres, fewer at the sides.
  EXPECT_LT(static_cast<double>(visited) / 4000.0, 108.0);
}

TEST(CellGrid, CrossingsOfAParabolaAreWhereItLeavesTheCell) {
  Swarm all = swarm(400, 0.01, 5);
  const double width = 0.02 * (1.0 + 1e-9);
  all.positions[0] = Vec3::Constant(-0.1);  // so that cells are counted from the origin
  all.positions[1] = Vec3::Constant(0.1);
  all.positions[7] = Vec3::Constant(1.5 * width);
  const CellGrid grid(all.positions, all.radii);
  // A sphere that is thrown up fast enough leaves through the top of its cell, a slow one through
  // the bottom.
  for (const double speed : {3.0, 0.01}) {
    const auto crossing =
        grid.nextCrossing(7, {all.positions[7], {0.0, speed, 0.0}, {0.0, -9.81, 0.0}});
    EXPECT_EQ(crossing.axis, 1);
    EXPECT_EQ(crossing.up, speed > 1.0);
    const double wait = crossing.wait;
    const double height = all.positions[7].y() + wait * speed - 0.5 * 9.81 * wait * wait;
    EXPECT_NEAR(height, crossing.up ? 2.0 * width : width, 1e-15);
  }
}

TEST(CellGrid, WhatLeavesTheLastCellCrossesNoMore) {
  Swarm all = swarm(100, 0.01, 5);
  CellGrid grid(all.positions, all.radii);
  const Vec3 velocity(1e6, 0.0, 0.0);
  double time = 0.0;
  for (int crossings = 0; time < 1e9; ++crossings) {
    ASSERT_LT(crossings, 2'000'000);
    const Vec3 position = all.positions[7] + time * velocity;
    const auto crossing = grid.nextCrossing(7, {position, velocity, Vec3::Zero()});
    time += crossing.wait;
    if (time < 1e9) grid.cross(7, crossing);
  }
  EXPECT_TRUE(grid.holds(7, {1e15, all.positions[7].y(), all.positions[7].z()}, 1e-12));
}

TEST(CellGrid, FindsNeighboursWhereverTheyAreFromTheStart) {
  for (const double away : {1e6, 1e12, 1e100}) {
    Swarm all = swarm(100, 0.01, 5);
    for (std::uint32_t sphere = 60; sphere < 100; ++sphere)
      all.positions[sphere] *= away;
    all.positions[99] = all.positions[98];
    const CellGrid grid(all.positions, all.radii);
    EXPECT_TRUE(near(grid, 98, {all.positions[98], 0.01, 0.0}).contains(99)) << away;
    EXPECT_TRUE(near(grid, 99, {all.positions[99], 0.01, 0.0}).contains(98)) << away;
    EXPECT_TRUE(grid.holds(99, all.positions[99], 1e-12 * away)) << away;
  }
}

}  // namespace
}  // namespace carom
