#include "tests/native/trajectory_hash.h"

#include <bit>

#include "tests/native/sphere_worlds.h"

namespace carom::test {
namespace {

class BitHash {
 public:
  void add(double value) {
    const auto bits = std::bit_cast<std::uint64_t>(value);
    for (unsigned shift = 0; shift < 64; shift += 8) {
      hash_ = (hash_ ^ ((bits >> shift) & 0xFF)) * 0x100000001B3ULL;
    }
  }
  void add(const Vec3& value) {
    for (const double component : value)
      add(component);
  }
  std::uint64_t value() const { return hash_; }

 private:
  std::uint64_t hash_ = 0xCBF29CE484222325ULL;
};

}  // namespace

SphereWorld trajectoryHashWorld() {
  SphereWorld world = gasInBox(3, 0.9, 7);
  world.gravity = {0.3, -9.81, 0.1};
  const Vec3 slant(0.48, 0.8, 0.36);
  world.planes.push_back({kFirstPlane + 6, slant, -0.146, 0.7});
  return world;
}

std::uint64_t trajectoryHash() {
  SphereStepper stepper = stepperOf(trajectoryHashWorld());
  BitHash hash;
  for (const ImpulseEvent& event : stepper.advanceTo(kTrajectoryHashTime)) {
    hash.add(event.time);
    hash.add(event.impulse);
    hash.add(event.position);
    hash.add(event.bodyVelocity);
  }
  for (std::size_t sphere = 0; sphere < stepper.sphereCount(); ++sphere) {
    hash.add(stepper.state(sphere).position);
    hash.add(stepper.state(sphere).velocity);
  }
  return hash.value();
}

}  // namespace carom::test
