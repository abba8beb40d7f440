#include "tests/bench/cell_yardstick.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace carom::bench {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr std::array<int, 3> kBefore = {-1, -1, -1};
constexpr std::array<int, 3> kBehind = {1, 1, 1};

}  // namespace

CellGas::CellGas(const Gas& gas)
    : side_(gas.side),
      squaredDiameter_(4.0 * gas.radius * gas.radius),
      cellsPerSide_(static_cast<int>(gas.side / (2.0 * gas.radius))),
      width_(gas.side / cellsPerSide_),
      futures_(gas.positions.size()),
      counts_(gas.positions.size()),
      cells_(static_cast<std::size_t>(cellsPerSide_ * cellsPerSide_ * cellsPerSide_)) {
  const auto count = static_cast<std::uint32_t>(gas.positions.size());
  for (std::uint32_t sphere = 0; sphere < count; ++sphere) {
    Sphere& added = spheres_.emplace_back(Sphere{gas.positions[sphere], gas.velocities[sphere]});
    for (std::size_t axis = 0; axis < 3; ++axis)
      added.cell[axis] =
          std::min(cellsPerSide_ - 1,
                   static_cast<int>(added.position[static_cast<Eigen::Index>(axis)] / width_));
    enter(sphere);
    heap_.push_back({kNever, sphere});
    slotOf_.push_back(sphere);
    futures_[sphere].collision = kNever;
  }
  for (std::uint32_t sphere = 0; sphere < count; ++sphere)
    startAnew(sphere);
}

void CellGas::collide() {
  for (;;) {
    const std::uint32_t sphere = heap_.front().sphere;
    now_ = heap_.front().time;
    const Future& future = futures_[sphere];
    if (future.crossing <= future.collision) {
      cross(sphere);
    } else if (future.partnerCollisions == counts_[future.partner]) {
      bounce(sphere, future.partner);
      return;
    } else {
      move(sphere);
      futures_[sphere].collision = kNever;
      predictCollision(sphere, kBefore, kBehind);
      schedule(sphere);
    }
  }
}

double CellGas::kineticEnergy() const {
  double energy = 0.0;
  for (const Sphere& sphere : spheres_)
    energy += 0.5 * sphere.velocity.squaredNorm();
  return energy;
}

// ---- Cells

CellGas::Cell& CellGas::cellAt(const std::array<int, 3>& cell) {
  return cells_[static_cast<std::size_t>((cell[2] * cellsPerSide_ + cell[1]) * cellsPerSide_ +
                                         cell[0])];
}

void CellGas::enter(std::uint32_t sphere) {
  Cell& cell = cellAt(spheres_[sphere].cell);
  spheres_[sphere].slot = cell.count;
  cell.spheres[static_cast<std::size_t>(cell.count++)] = sphere;
}

void CellGas::leaveCell(std::uint32_t sphere) {
  Cell& cell = cellAt(spheres_[sphere].cell);
  const std::uint32_t last = cell.spheres[static_cast<std::size_t>(--cell.count)];
  cell.spheres[static_cast<std::size_t>(spheres_[sphere].slot)] = last;
  spheres_[last].slot = spheres_[sphere].slot;
}

void CellGas::predictCrossing(std::uint32_t sphere) {
  const Sphere& moving = spheres_[sphere];
  Future& future = futures_[sphere];
  future.crossing = kNever;
  for (int axis = 0; axis < 3; ++axis) {
    const double velocity = moving.velocity[axis];
    if (velocity == 0.0) continue;
    const int edge = moving.cell[static_cast<std::size_t>(axis)] + (velocity > 0.0 ? 1 : 0);
    const double wait = std::max(0.0, (edge * width_ - moving.position[axis]) / velocity);
    if (now_ + wait >= future.crossing) continue;
    future.crossing = now_ + wait;
    future.axis = axis;
  }
}

void CellGas::cross(std::uint32_t sphere) {
  move(sphere);
  leaveCell(sphere);
  Sphere& moving = spheres_[sphere];
  const int axis = futures_[sphere].axis;
  const auto index = static_cast<std::size_t>(axis);
  const int direction = moving.velocity[axis] > 0.0 ? 1 : -1;
  moving.cell[index] = (moving.cell[index] + direction + cellsPerSide_) % cellsPerSide_;
  moving.position[axis] = (moving.cell[index] + (direction > 0 ? 0 : 1)) * width_;
  enter(sphere);
  predictCrossing(sphere);
  Offsets low = kBefore;
  Offsets high = kBehind;
  low[index] = high[index] = direction;
  predictCollision(sphere, low, high);
  schedule(sphere);
}

// ---- Collisions

void CellGas::move(std::uint32_t sphere) {
  Sphere& moving = spheres_[sphere];
  moving.position += (now_ - moving.time) * moving.velocity;
  moving.time = now_;
}

void CellGas::bounce(std::uint32_t sphere, std::uint32_t partner) {
  ++collisions_;
  move(sphere);
  move(partner);
  Vec3 separation = spheres_[sphere].position - spheres_[partner].position;
  for (double& component : separation) {
    if (component > 0.5 * side_) component -= side_;
    if (component < -0.5 * side_) component += side_;
  }
  Vec3& velocity = spheres_[sphere].velocity;
  Vec3& partnerVelocity = spheres_[partner].velocity;
  const Vec3 swapped =
      separation.dot(velocity - partnerVelocity) / separation.squaredNorm() * separation;
  velocity -= swapped;
  partnerVelocity += swapped;
  for (const std::uint32_t changed : {sphere, partner}) {
    ++counts_[changed];
    futures_[changed].collision = kNever;
  }
  startAnew(sphere);
  startAnew(partner);
}

void CellGas::startAnew(std::uint32_t sphere) {
  predictCrossing(sphere);
  predictCollision(sphere, kBefore, kBehind);
  schedule(sphere);
}

void CellGas::predictCollision(std::uint32_t sphere, const Offsets& low, const Offsets& high) {
  const double before = futures_[sphere].collision;
  const std::array<int, 3> home = spheres_[sphere].cell;
  std::array<int, 3> cell{};
  Vec3 shift;
  const auto turn = [&](std::size_t axis, int offset) {
    const int place = home[axis] + offset;
    const int wrap = place < 0 ? 1 : (place >= cellsPerSide_ ? -1 : 0);
    cell[axis] = place + wrap * cellsPerSide_;
    shift[static_cast<Eigen::Index>(axis)] = -wrap * side_;
  };
  for (int z = low[2]; z <= high[2]; ++z) {
    turn(2, z);
    for (int y = low[1]; y <= high[1]; ++y) {
      turn(1, y);
      for (int x = low[0]; x <= high[0]; ++x) {
        turn(0, x);
        lookInCell(sphere, cellAt(cell), shift);
      }
    }
  }
  claim(sphere, before);
}

void CellGas::lookInCell(std::uint32_t sphere, const Cell& cell, const Vec3& shift) {
  const Sphere& moving = spheres_[sphere];
  Future& future = futures_[sphere];
  for (int slot = 0; slot < cell.count; ++slot) {
    const std::uint32_t other = cell.spheres[static_cast<std::size_t>(slot)];
    if (other == sphere) continue;
    const Sphere& base = spheres_[other];
    const Vec3 d = base.position + (now_ - base.time) * base.velocity + shift - moving.position;
    const Vec3 v = base.velocity - moving.velocity;
    const double b = d.dot(v);
    if (b >= 0.0) continue;
    const double c = d.squaredNorm() - squaredDiameter_;
    const double discriminant = b * b - v.squaredNorm() * c;
    if (discriminant < 0.0) continue;
    const double time = now_ + std::max(0.0, c / (std::sqrt(discriminant) - b));
    if (time >= future.collision || time >= futures_[other].collision) continue;
    future.collision = time;
    future.partner = other;
  }
}

/// A new prediction is stored as the partner's, too.
void CellGas::claim(std::uint32_t sphere, double before) {
  Future& future = futures_[sphere];
  if (future.collision >= before) return;
  future.partnerCollisions = counts_[future.partner];
  Future& partner = futures_[future.partner];
  partner.collision = future.collision;
  partner.partner = sphere;
  partner.partnerCollisions = counts_[sphere];
  schedule(future.partner);
}

// ---- The heap

void CellGas::schedule(std::uint32_t sphere) {
  const double time = std::min(futures_[sphere].collision, futures_[sphere].crossing);
  std::size_t place = slotOf_[sphere];
  const auto put = [this](std::size_t at, const Slot& slot) {
    heap_[at] = slot;
    slotOf_[slot.sphere] = at;
  };
  while (place > 0 && time < heap_[(place - 1) / 2].time) {
    put(place, heap_[(place - 1) / 2]);
    place = (place - 1) / 2;
  }
  for (std::size_t child = 2 * place + 1; child < heap_.size(); child = 2 * place + 1) {
    if (child + 1 < heap_.size() && heap_[child + 1].time < heap_[child].time) ++child;
    if (heap_[child].time >= time) break;
    put(place, heap_[child]);
    place = child;
  }
  put(place, {time, sphere});
}

}  // namespace carom::bench
