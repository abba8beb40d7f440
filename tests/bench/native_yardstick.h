#pragma once

#include <cstddef>
#include <vector>

#include "carom/audio/vector.h"

namespace carom::bench {

/// Equal elastic spheres of 1 kg in a cube, without gravity.
struct Gas {
  double side = 0.0;             ///< m, the cube is from 0 to side on each axis
  double radius = 0.0;           ///< m
  std::vector<Vec3> positions;   ///< m, at time 0
  std::vector<Vec3> velocities;  ///< m/s
};

/// Returns `count` spheres of 1 m diameter on a lattice, in random motion, that fill 30 % of their
/// cube.
Gas makeGas(std::size_t count);

/// Kinetic energy in J of spheres of 1 kg.
double kineticEnergy(const std::vector<Vec3>& velocities);

/// The obviously correct yardstick: a gas between six walls, with all spheres at one time. After
/// each collision all pairs and all walls are examined anew; nothing is predicted or kept. O(N^2)
/// each.
class AllPairsGas {
 public:
  struct Collision {
    std::size_t sphere = 0;
    std::size_t partner = 0;  ///< a sphere with a higher index, or the number of spheres + a wall
    double time = 0.0;        ///< s
  };

  explicit AllPairsGas(const Gas& gas);

  Collision next();
  const std::vector<Vec3>& velocities() const { return velocities_; }

 private:
  double pairTime(std::size_t sphere, std::size_t other) const;
  double wallTime(std::size_t sphere, std::size_t wall) const;
  void look(const Collision& candidate, double wait, Collision& first, double& soonest) const;
  void fly(double duration);
  void collide(const Collision& collision);

  double side_;
  double radius_;
  double time_ = 0.0;
  std::vector<Vec3> positions_;
  std::vector<Vec3> velocities_;
};

}  // namespace carom::bench
