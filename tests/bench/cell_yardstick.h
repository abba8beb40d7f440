#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "tests/bench/native_yardstick.h"

namespace carom::bench {

/// The fast yardstick: event-driven spheres with cells and a heap, and nothing else. All spheres
/// have one radius and one mass and are elastic; there is no gravity; instead of walls the cube is
/// periodic; events have no identity and are not reported. Each sphere has one predicted collision
/// (Lubachevsky 1991) and one crossing into the next cell; a prediction looks at 27 cells, a
/// crossing at 9.
class CellGas {
 public:
  explicit CellGas(const Gas& gas);

  void collide();  ///< runs to the next collision
  std::uint64_t collisions() const { return collisions_; }
  double kineticEnergy() const;

 private:
  static constexpr int kRoom = 15;  // capacity of a cell; eight spheres fit

  struct Sphere {
    Vec3 position;      // m, at `time`
    Vec3 velocity;      // m/s
    double time = 0.0;  // s
    std::array<int, 3> cell{};
    int slot = 0;  // its index in the cell
  };
  struct Future {
    double collision = 0.0;  // s
    double crossing = 0.0;   // s
    std::uint32_t partner = 0;
    std::uint32_t partnerCollisions = 0;
    int axis = 0;  // axis of the crossing
  };
  struct Cell {
    int count = 0;
    std::array<std::uint32_t, kRoom> spheres{};
  };
  struct Slot {
    double time = 0.0;
    std::uint32_t sphere = 0;
  };
  using Offsets = std::array<int, 3>;

  Cell& cellAt(const std::array<int, 3>& cell);
  void enter(std::uint32_t sphere);
  void leaveCell(std::uint32_t sphere);
  void move(std::uint32_t sphere);
  void predictCrossing(std::uint32_t sphere);
  void predictCollision(std::uint32_t sphere, const Offsets& low, const Offsets& high);
  void lookInCell(std::uint32_t sphere, const Cell& cell, const Vec3& shift);
  void claim(std::uint32_t sphere, double before);
  void cross(std::uint32_t sphere);
  void bounce(std::uint32_t sphere, std::uint32_t partner);
  void startAnew(std::uint32_t sphere);
  void schedule(std::uint32_t sphere);

  double side_;
  double squaredDiameter_;
  int cellsPerSide_;
  double width_;  // m, edge of a cell
  double now_ = 0.0;
  std::uint64_t collisions_ = 0;
  std::vector<Sphere> spheres_;
  std::vector<Future> futures_;
  std::vector<std::uint32_t> counts_;
  std::vector<Cell> cells_;
  std::vector<Slot> heap_;
  std::vector<std::size_t> slotOf_;  // place in the heap, by sphere
};

}  // namespace carom::bench
