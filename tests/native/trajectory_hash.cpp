#include "tests/native/trajectory_hash.h"

#include <bit>
#include <cmath>
#include <utility>

#include "tests/native/sphere_worlds.h"

namespace carom::test {
namespace {

class BitHash {
 public:
  void add(std::uint64_t bits) {
    for (unsigned shift = 0; shift < 64; shift += 8) {
      hash_ = (hash_ ^ ((bits >> shift) & 0xFF)) * 0x100000001B3ULL;
    }
  }
  void add(double value) { add(std::bit_cast<std::uint64_t>(value)); }
  void add(const Vec3& value) {
    for (const double component : value)
      add(component);
  }
  std::uint64_t value() const { return hash_; }

 private:
  std::uint64_t hash_ = 0xCBF29CE484222325ULL;
};

std::uint64_t hashOf(SphereStepper& stepper, double duration) {
  BitHash hash;
  for (const ImpulseEvent& event : stepper.advanceTo(duration)) {
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

/// A damped gas of mixed radii over a slant, in a box of which one side withdraws.
SphereWorld dampedGas() {
  SphereWorld world = gasInBox(3, 0.9, 7);
  world.gravity = {0.3, -9.81, 0.1};
  const Vec3 slant(0.48, 0.8, 0.36);
  world.planes.push_back({kFirstPlane + 6, slant, -0.146, 0.7});
  world.planes[0].velocity = {-0.03125, 0.0, 0.015625};
  for (Sphere& sphere : world.spheres)
    sphere.restitutionLaw = {SpeedLaw::viscoelastic, 1.0};
  return world;
}

/// Balls that fall on top of each other and come to rest.
SphereWorld pile() {
  SphereWorld world = gasInBox(3, 0.7, 8);
  world.gravity = kEarthGravity;
  return world;
}

/// A ball that spins into a touching triangle of six, on cloth.
SphereWorld breakShot(Simultaneous simultaneous) {
  SphereWorld world;
  world.gravity = kEarthGravity;
  world.simultaneous = simultaneous;
  world.spheres.push_back(sphereAt(1, {-0.5, 0.05, 0.01}, {4.0, 0.0, 0.0}));
  world.spheres[0].friction.spin = {10.0, 20.0, -30.0};
  for (int row = 0; row < 3; ++row) {
    for (int place = 0; place <= row; ++place) {
      const Vec3 position(0.0866025403784438647 * row, 0.05, 0.1 * place - 0.05 * row);
      world.spheres.push_back(sphereAt(static_cast<BodyId>(world.spheres.size() + 1), position));
    }
  }
  world.planes = boxOf(1.0, 0.7);
  world.planes[2] = floorPlane(0.5);
  world.planes[2].id = kFirstPlane + 2;
  for (Plane& plane : world.planes)
    plane.friction = 0.25;
  for (Sphere& sphere : world.spheres) {
    sphere.friction.sliding = 0.25;
    sphere.friction.rolling = 0.0625;
    sphere.friction.pivoting = 0.001;
    sphere.stiffness = 6e9;
    sphere.restitution = 0.9;
  }
  for (Plane& plane : world.planes)
    plane.stiffness = 1e9;
  return world;
}

/// Touching balls on rods, and two on a spring, in a field and in air.
SphereWorld cradleAndSprings() {
  SphereWorld world;
  world.gravity = kEarthGravity;
  for (int ball = 0; ball < 4; ++ball) {
    const double x = 0.1 * ball;
    const Vec3 hanging(ball == 0 ? x - 0.15 : x, ball == 0 ? -0.2 : -0.25, 0.0);
    world.spheres.push_back(sphereAt(static_cast<BodyId>(ball + 1), hanging));
    for (const double side : {-0.1, 0.1})
      world.rods.push_back({world.spheres.back().id, kAnchor, {x, 0.0, side}});
  }
  world.spheres.push_back(sphereAt(5, {0.5, 0.0, 0.0}, {-1.0, 0.5, 0.0}));
  world.spheres.push_back(sphereAt(6, {0.7, 0.1, 0.0}));
  world.springs = {{5, 6, Vec3::Zero(), 0.15, 50.0, 0.1}};
  world.fields = {{Vec3(0.2, -0.2, 0.1), 2.0, 0.01}};
  world.drag = {0.1, Vec3(0.5, 0.0, 0.0)};
  return world;
}

/// Balls that fall past tilted boxes on a plane that oscillates.
SphereWorld boxesAndOscillation() {
  SphereWorld world = pile();
  world.planes[2].oscillation = {Vec3(0.0, 0.001, 0.0), 30.0, 0.5};
  for (Sphere& sphere : world.spheres) {
    sphere.radius *= 0.5;
    sphere.position.y() += 0.5;
  }
  world.planes.erase(world.planes.begin() + 3);  // open at the top
  Box box;
  box.id = kFirstPlane + 10;
  box.centre = {0.02, 0.12, 0.01};
  box.halfExtents = {0.05, 0.01, 0.04};
  box.orientation = Quat(0.8, 0.36, 0.0, 0.48);
  box.restitution = 0.8;
  box.friction = 0.5;
  world.boxes = {box};
  box.id = kFirstPlane + 11;
  box.centre = {-0.05, 0.2, -0.05};
  box.halfExtents = {0.04, 0.0, 0.04};
  box.orientation = Quat::Identity();
  world.boxes.push_back(box);
  return world;
}

}  // namespace

std::vector<HashedRun> hashedRuns() {
  return {{gasInBox(4, 1.0, 9), 0.5},
          {dampedGas(), 1.0},
          {pile(), 1.0},
          {breakShot(Simultaneous::reflections), 1.0},
          {breakShot(Simultaneous::hertz), 0.3},
          {cradleAndSprings(), 1.0},
          {boxesAndOscillation(), 0.7}};
}

std::uint64_t runHash(const HashedRun& run) {
  SphereStepper stepper = stepperOf(run.world);
  return hashOf(stepper, run.duration);
}

std::uint64_t trajectoryHash() {
  BitHash hash;
  for (HashedRun& run : hashedRuns()) {
    SphereStepper stepper = stepperOf(std::move(run.world));
    hash.add(hashOf(stepper, run.duration));
    const SphereStepperCounters& counters = stepper.counters();
    for (const std::uint64_t count : {counters.restContacts, counters.putToSleep, counters.woken})
      hash.add(count);
  }
  return hash.value();
}

}  // namespace carom::test
