#pragma once

#include <cstdlib>
#include <utility>

#include "carom/native/sphere_stepper.h"
#include "tests/bench/native_yardstick.h"

namespace carom::bench {

inline SphereStepper makeStepper(SphereWorld world) {
  Result<SphereStepper> stepper = SphereStepper::create(std::move(world));
  if (!stepper) std::abort();
  return *std::move(stepper);
}

/// The gas between six walls, with all places `spread` times as far from the origin. Ids are the
/// indices of AllPairsGas.
inline SphereWorld gasWorld(const Gas& gas, double spread = 1.0) {
  SphereWorld world;
  world.restSpeed = 0.0;
  for (const Vec3& position : gas.positions) {
    const auto id = static_cast<BodyId>(world.spheres.size());
    world.spheres.push_back({id, gas.radius, 1.0, 1.0, spread * position, gas.velocities[id]});
  }
  auto id = static_cast<BodyId>(world.spheres.size());
  for (int axis = 0; axis < 3; ++axis) {
    world.planes.push_back({id++, Vec3::Unit(axis), 0.0, 1.0});
    world.planes.push_back({id++, -Vec3::Unit(axis), -spread * gas.side, 1.0});
  }
  return world;
}

}  // namespace carom::bench
