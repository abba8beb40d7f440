#include "bullet_bridge/shape_pair.h"

#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <random>

#include <gtest/gtest.h>

namespace carom {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine_);
  }
  Vec3 vector(double scale) { return scale * Vec3(between(-1, 1), between(-1, 1), between(-1, 1)); }
  Vec3 direction() {
    for (;;) {
      const Vec3 v = vector(1.0);
      if (v.norm() < 1.0 && v.norm() > 0.1) return v.normalized();
    }
  }
  Quat orientation() { return Quat(Eigen::AngleAxisd(between(0.0, 3.14), direction())); }

 private:
  std::mt19937 engine_;
};

// A body that tumbles towards another one at the origin, from `distance` m away.
RigidMotion tumbling(Random& random, double distance, double speed, double spin) {
  RigidMotion motion;
  const Vec3 from = random.direction();
  motion.centre.position = distance * from;
  motion.centre.velocity = speed * (random.vector(0.2) - from);
  motion.centre.acceleration = Vec3(0, -9.81, 0);
  motion.orientation = random.orientation();
  motion.angularVelocity = spin * random.direction();
  return motion;
}

// The first time at which `gap` is no longer positive, by brute force.
template <class Gap>
double searched(Gap gap, double horizon, int pieces) {
  for (int i = 1; i <= pieces; ++i) {
    double low = horizon * (i - 1) / pieces;
    double high = horizon * i / pieces;
    if (gap(high) > 0.0) continue;
    for (int bit = 0; bit < 60; ++bit) {
      const double middle = 0.5 * (low + high);
      (gap(middle) > 0.0 ? low : high) = middle;
    }
    return high;
  }
  return kNever;
}

std::vector<std::unique_ptr<btConvexShape>> convexShapes() {
  std::vector<std::unique_ptr<btConvexShape>> shapes;
  shapes.push_back(std::make_unique<btSphereShape>(btScalar(0.05)));
  shapes.push_back(std::make_unique<btBoxShape>(btVector3(0.05F, 0.03F, 0.08F)));
  shapes.push_back(std::make_unique<btCapsuleShapeX>(btScalar(0.02), btScalar(0.1)));
  shapes.push_back(std::make_unique<btCylinderShape>(btVector3(0.05F, 0.03F, 0.05F)));
  shapes.push_back(std::make_unique<btCylinderShapeZ>(btVector3(0.05F, 0.05F, 0.01F)));
  shapes.push_back(std::make_unique<btConeShape>(btScalar(0.05), btScalar(0.1)));
  auto hull = std::make_unique<btConvexHullShape>();
  Random random(77);
  for (int i = 0; i < 20; ++i) {
    const Vec3 p = 0.06 * random.direction();
    hull->addPoint(btVector3(btScalar(p.x()), btScalar(p.y()), btScalar(p.z())));
  }
  hull->setMargin(btScalar(0.002));
  shapes.push_back(std::move(hull));
  return shapes;
}

TEST(ShapePair, EveryPairOfConvexShapesHasGapZeroAtItsTouchAndIsApartBefore) {
  const auto shapes = convexShapes();
  Random random(1);
  ShapePair pair, swapped;
  int touches = 0;
  double worst = 0.0;
  for (const auto& shape : shapes) {
    for (const auto& against : shapes) {
      for (int trial = 0; trial < 50; ++trial) {
        const MovingShape body{shape.get(), tumbling(random, 0.3, 10.0, 30.0)};
        MovingShape other{against.get(), {}};
        other.motion.orientation = random.orientation();
        other.motion.angularVelocity = random.vector(20.0);
        const double horizon = 1.0 / 30.0;
        ASSERT_TRUE(pair.set(body, other, horizon, 0.01));
        ASSERT_TRUE(swapped.set(other, body, horizon, 0.01));
        const double touch = pair.touchTime();
        EXPECT_NEAR(std::min(swapped.touchTime(), 1.0), std::min(touch, 1.0), 1e-9);
        const double until = std::min(touch, horizon);
        for (int i = 0; i < 20; ++i) {
          EXPECT_GT(pair.proximityAt(until * i / 20.0).gap, 0.0);
        }
        if (touch == kNever) continue;
        ++touches;
        worst = std::max(worst, std::abs(pair.proximityAt(touch).gap));
        EXPECT_NEAR(pair.proximityAt(touch).gap, 0.0, 1e-9)
            << shape->getName() << " " << against->getName();
        EXPECT_LT(pair.proximityAt(touch + 1e-7).gap, 0.0);
      }
    }
  }
  std::printf("touches %d worst gap %g\n", touches, worst);
  EXPECT_GT(touches, 500);
}

}  // namespace
}  // namespace carom
