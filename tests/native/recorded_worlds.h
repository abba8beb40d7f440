#pragma once

#include <bit>
#include <cassert>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "carom/native/recording.h"
#include "carom/native/recording_format.h"
#include "tests/native/sphere_worlds.h"

namespace carom::test {

inline constexpr double kRunTime = 2.0;  ///< s

inline Recording recordedRun(const SphereWorld& world, double time) {
  SphereStepper stepper = stepperOf(world);
  stepper.startRecording();
  stepper.advanceTo(time);
  return stepper.takeRecording();
}

inline SphereWorld dampedGas() {
  SphereWorld world = gasInBox(3, 0.9, 21);
  world.gravity = {0.3, -9.81, 0.1};
  return world;
}

/// Balls that are poured into a box and come to rest there.
inline SphereWorld pouredBalls() {
  SphereWorld world = gasInBox(3, 0.4, 22);
  world.gravity = kEarthGravity;
  return world;
}

inline SphereWorld onMovingFloor() {
  SphereWorld world = droppedBall(0.2, 0.9);
  world.planes[0].velocity = {0.1, 0.25, 0.0};
  return world;
}

/// Spheres of five surfaces with different restitutions, of which one pair has a restitution of its
/// own.
inline SphereWorld manyMaterials() {
  SphereWorld world = gasInBox(3, 0.9, 23);
  SurfaceId surface = 0;
  for (Sphere& sphere : world.spheres) {
    sphere.surface = surface++ % 5;
    sphere.restitution = 0.5 + 0.1 * sphere.surface;
  }
  const Status set = world.restitutions.set(1, 3, 0.77);
  assert(set);
  return world;
}

struct NamedWorld {
  std::string name;
  SphereWorld world;
};

inline std::vector<NamedWorld> recordedWorlds() {
  return {{"ElasticGas", gasInBox(4, 1.0, 20)},  {"DampedGas", dampedGas()},
          {"PouredBalls", pouredBalls()},        {"MovingFloor", onMovingFloor()},
          {"ManyMaterials", manyMaterials()},    {"Bounces", droppedBall(0.5, 0.8)},
          {"LooseCradle", cradle(12, 1e-3, 1.0)}};
}

inline std::vector<std::byte> encodedBytes(const Recording& recording) {
  Result<std::vector<std::byte>> bytes = encoded(recording);
  EXPECT_TRUE(bytes) << bytes.error().message;
  return bytes ? *std::move(bytes) : std::vector<std::byte>{};
}

inline Recording redecoded(const Recording& recording) {
  Result<Recording> again = decoded(encodedBytes(recording), "bytes");
  EXPECT_TRUE(again) << again.error().message;
  return again ? *std::move(again) : Recording{};
}

inline bool sameBits(double one, double other) {
  return std::bit_cast<std::uint64_t>(one) == std::bit_cast<std::uint64_t>(other);
}
inline bool sameBits(const Vec3& one, const Vec3& other) {
  return sameBits(one.x(), other.x()) && sameBits(one.y(), other.y()) &&
         sameBits(one.z(), other.z());
}
inline bool sameBits(const Quat& one, const Quat& other) {
  return sameBits(one.w(), other.w()) && sameBits(Vec3(one.vec()), Vec3(other.vec()));
}
/// True if every field of the events has the same bits.
inline bool sameBits(const ImpulseEvent& one, const ImpulseEvent& other) {
  return sameBits(one.time, other.time) && one.body == other.body && one.other == other.other &&
         sameBits(one.impulse, other.impulse) &&
         sameBits(one.appliedImpulse, other.appliedImpulse) &&
         one.hasAppliedImpulse == other.hasAppliedImpulse &&
         sameBits(one.position, other.position) && sameBits(one.normal, other.normal) &&
         sameBits(one.approachSpeed, other.approachSpeed) &&
         sameBits(one.effectiveMass, other.effectiveMass) && sameBits(one.radius, other.radius) &&
         sameBits(one.otherRadius, other.otherRadius) &&
         sameBits(one.bodyPosition, other.bodyPosition) &&
         sameBits(one.bodyOrientation, other.bodyOrientation) &&
         sameBits(one.bodyVelocity, other.bodyVelocity) &&
         sameBits(one.bodyAngularVelocity, other.bodyAngularVelocity);
}

}  // namespace carom::test
