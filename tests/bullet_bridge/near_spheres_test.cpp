#include "bullet_bridge/near_spheres.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace carom {
namespace {

std::vector<TrackedBody> randomSpheres(std::size_t count, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::vector<TrackedBody> bodies(count);
  for (TrackedBody& body : bodies) {
    body.shape = ContactShape::sphere;
    body.radius = 0.02 + 0.1 * std::abs(uniform(random));
    body.inverseMass = uniform(random) > -0.8 ? 1.0 : 0.0;
    body.current.known = true;
    body.current.start = {100.0 + uniform(random), uniform(random), 0.3 * uniform(random)};
    body.current.velocityAfter = 20.0 * Vec3(uniform(random), uniform(random), uniform(random));
    body.current.acceleration = {0.0, -9.81, 0.0};
  }
  return bodies;
}

// All pairs, all along the way.
bool touch(const TrackedBody& a, const TrackedBody& b, double dt) {
  for (int i = 0; i <= 200; ++i) {
    const double s = dt * i / 200;
    const Vec3 apart = a.current.actual(dt).positionAt(s) - b.current.actual(dt).positionAt(s);
    if (apart.norm() <= a.radius + b.radius) return true;
  }
  return false;
}

TEST(NearSpheres, HoldsEveryPairThatTouchesOnItsWayOnceAndFewOthers) {
  const double dt = 1.0 / 60.0;
  std::size_t touching = 0;
  std::size_t found = 0;
  for (std::uint32_t seed = 0; seed < 10; ++seed) {
    const std::vector<TrackedBody> bodies = randomSpheres(60, seed);
    NearSpheres near;
    std::set<NearSpheres::Pair> pairs;
    for (const auto& [a, b] : near.find(bodies, dt)) {
      EXPECT_TRUE(pairs.insert(std::minmax(a, b)).second) << a << ' ' << b;
      EXPECT_GT(bodies[a].inverseMass + bodies[b].inverseMass, 0.0);
    }
    found += pairs.size();
    for (std::size_t a = 0; a < bodies.size(); ++a) {
      for (std::size_t b = a + 1; b < bodies.size(); ++b) {
        if (bodies[a].inverseMass + bodies[b].inverseMass == 0.0) continue;
        if (!touch(bodies[a], bodies[b], dt)) continue;
        ++touching;
        EXPECT_TRUE(pairs.contains({a, b})) << a << ' ' << b << " of seed " << seed;
      }
    }
  }
  EXPECT_GT(touching, 100u);
  EXPECT_LT(found, 6 * touching);
}

TEST(NearSpheres, LeavesOutOtherShapesAndBodiesWithoutAMotion) {
  std::vector<TrackedBody> bodies = randomSpheres(3, 1);
  for (TrackedBody& body : bodies) {
    body.current.start = Vec3::Zero();
    body.inverseMass = 1.0;
  }
  bodies[1].shape = ContactShape::plane;
  NearSpheres near;
  EXPECT_EQ(near.find(bodies, 0.01), (std::vector<NearSpheres::Pair>{{0, 2}}));
  bodies[2].current.known = false;
  EXPECT_TRUE(near.find(bodies, 0.01).empty());
}

TEST(NearSpheres, SpheresThatAreNowhereDoNotDisturbTheOthers) {
  std::vector<TrackedBody> bodies = randomSpheres(40, 5);
  NearSpheres near;
  std::set<NearSpheres::Pair> expected;
  for (const auto& [a, b] : near.find(bodies, 0.01)) {
    if (a % 8 != 3 && b % 8 != 3) expected.insert(std::minmax(a, b));
  }
  ASSERT_FALSE(expected.empty());
  for (std::size_t body = 3; body < bodies.size(); body += 8) {
    bodies[body].current.start[static_cast<Eigen::Index>(body) % 3] =
        body < 20 ? std::nan("") : std::numeric_limits<double>::infinity();
  }
  std::set<NearSpheres::Pair> pairs;
  for (const auto& [a, b] : near.find(bodies, 0.01))
    pairs.insert(std::minmax(a, b));
  EXPECT_EQ(pairs, expected);
}

TEST(NearSpheres, PointsInOnePlaceArePairs) {
  std::vector<TrackedBody> bodies = randomSpheres(2, 1);
  for (TrackedBody& body : bodies) {
    body.radius = 0.0;
    body.inverseMass = 1.0;
    body.current = {};
    body.current.known = true;
  }
  NearSpheres near;
  EXPECT_EQ(near.find(bodies, 0.01), (std::vector<NearSpheres::Pair>{{0, 1}}));
}

}  // namespace
}  // namespace carom
