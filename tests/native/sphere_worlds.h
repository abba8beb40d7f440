#pragma once

#include <cassert>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "carom/native/sphere_stepper.h"

namespace carom::test {

/// Random numbers that are the same on every platform (SplitMix64, Steele et al. 2014), unlike
/// those of the standard library's distributions.
class SplitMix {
 public:
  explicit SplitMix(std::uint64_t seed) : state_(seed) {}

  double between(double low, double high) {
    return low + (high - low) * (static_cast<double>(next() >> 11) * 0x1p-53);
  }
  Vec3 inCube(double half) {
    const double x = between(-half, half);
    const double y = between(-half, half);
    const double z = between(-half, half);
    return {x, y, z};
  }

 private:
  std::uint64_t next() {
    state_ += 0x9E3779B97F4A7C15ULL;
    std::uint64_t bits = state_;
    bits = (bits ^ (bits >> 30)) * 0xBF58476D1CE4E5B9ULL;
    bits = (bits ^ (bits >> 27)) * 0x94D049BB133111EBULL;
    return bits ^ (bits >> 31);
  }

  std::uint64_t state_;
};

inline double energyOf(const SphereStepper& stepper) {
  return stepper.kineticEnergy() + stepper.potentialEnergy();
}

inline testing::AssertionResult valid(const SphereStepper& stepper) {
  const Status state = stepper.validate();
  if (state) return testing::AssertionSuccess();
  return testing::AssertionFailure() << state.error().message;
}

inline std::vector<ImpulseEvent> eventsUntil(SphereStepper& stepper, double time) {
  const auto events = stepper.advanceTo(time);
  EXPECT_TRUE(valid(stepper));
  return {events.begin(), events.end()};
}

/// A way to spoil a world, and a part of the error message for it.
struct Refusal {
  const char* name;
  void (*spoil)(SphereWorld& world);
  const char* message;
};

inline constexpr BodyId kFirstPlane = 1'000'000;
inline const Vec3 kEarthGravity{0.0, -9.81, 0.0};

inline Sphere sphereAt(BodyId id, const Vec3& position, const Vec3& velocity = Vec3::Zero()) {
  Sphere sphere;
  sphere.id = id;
  sphere.radius = 0.05;
  sphere.mass = 0.2;
  sphere.position = position;
  sphere.velocity = velocity;
  return sphere;
}

inline Plane floorPlane(double restitution = 1.0) {
  return {kFirstPlane, Vec3::UnitY(), 0.0, restitution};
}

/// Six planes around the cube from -half to half.
inline std::vector<Plane> boxOf(double half, double restitution) {
  std::vector<Plane> planes;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {1.0, -1.0}) {
      const auto id = static_cast<BodyId>(kFirstPlane + planes.size());
      planes.push_back({id, side * Vec3::Unit(axis), -half, restitution});
    }
  }
  return planes;
}

/// A world of one ball that is `height` m above the floor.
inline SphereWorld droppedBall(double height, double restitution) {
  SphereWorld world;
  world.gravity = kEarthGravity;
  world.spheres = {sphereAt(1, {0.0, height + 0.05, 0.0})};
  world.spheres[0].restitution = restitution;
  world.planes = {floorPlane(restitution)};
  return world;
}

/// `count` equal balls in a row along x, `gap` apart, the first one moving towards the others.
inline SphereWorld cradle(int count, double gap, double speed) {
  SphereWorld world;
  for (int ball = 0; ball < count; ++ball) {
    world.spheres.push_back(
        sphereAt(static_cast<BodyId>(ball + 1), {ball * (0.1 + gap), 0.0, 0.0}));
  }
  world.spheres[0].velocity = {speed, 0.0, 0.0};
  return world;
}

/// `side`^3 spheres of radius 1 to 3 cm on a lattice in a box, in random motion.
inline SphereWorld gasInBox(int side, double restitution, std::uint64_t seed) {
  SplitMix random(seed);
  SphereWorld world;
  world.restSpeed = restitution < 1.0 ? 0.005 : 0.0;
  const double spacing = 0.07;
  const double half = 0.5 * spacing * side;
  for (int cell = 0; cell < side * side * side; ++cell) {
    const int row = cell / side;
    const int layer = row / side;
    const Vec3 corner(cell % side, row % side, layer);
    Sphere sphere = sphereAt(static_cast<BodyId>(cell), Vec3::Zero(), random.inCube(1.0));
    sphere.position = spacing * (corner + Vec3::Constant(0.5)) - Vec3::Constant(half);
    sphere.radius = random.between(0.01, 0.03);
    sphere.mass = 1e4 * sphere.radius * sphere.radius * sphere.radius;
    sphere.restitution = restitution;
    world.spheres.push_back(sphere);
  }
  world.planes = boxOf(half, restitution);
  return world;
}

inline SphereStepper stepperOf(SphereWorld world) {
  Result<SphereStepper> stepper = SphereStepper::create(std::move(world));
  assert(stepper);
  return *std::move(stepper);
}

}  // namespace carom::test
