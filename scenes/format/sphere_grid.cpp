#include "scenes/format/sphere_grid.h"

#include <algorithm>
#include <cmath>

namespace carom::scenes {

namespace {

/// Returns the exponent of the smallest power of two above the diameter.
int cellExponent(double radius) {
  int exponent = 0;
  std::frexp(2.0 * radius, &exponent);
  return exponent;
}

}  // namespace

void SphereGrid::insert(const Ball& ball) {
  const int exponent = cellExponent(ball.radius);
  const Cell cell = cellOf(ball.centre, std::ldexp(1.0, exponent));
  cells_[hash(exponent, cell)].push_back(balls_.size());
  levels_[exponent].push_back(balls_.size());
  balls_.push_back(ball);
}

const SphereGrid::Ball* SphereGrid::nearerThan(double gap, const Vec3& centre, double radius) {
  for (const auto& [exponent, members] : levels_) {
    const Query query{centre, radius, gap};
    const Ball* found = nearestInLevel(query, exponent, members);
    if (found != nullptr) return found;
  }
  return nullptr;
}

SphereGrid::Cell SphereGrid::cellOf(const Vec3& point, double size) {
  Cell cell{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    cell[axis] =
        static_cast<std::int64_t>(std::floor(point[static_cast<Eigen::Index>(axis)] / size));
  }
  return cell;
}

/// Hashes a cell. A collision of two cells only costs time.
std::uint64_t SphereGrid::hash(int exponent, const Cell& cell) {
  auto bits = static_cast<std::uint64_t>(static_cast<std::int64_t>(exponent));
  for (const std::int64_t coordinate : cell) {
    bits = (bits ^ static_cast<std::uint64_t>(coordinate)) * 0x9e3779b97f4a7c15U;
    bits ^= bits >> 29U;
  }
  return bits;
}

const SphereGrid::Ball* SphereGrid::nearestInLevel(const Query& query, int exponent,
                                                   const std::vector<std::size_t>& members) {
  const double size = std::ldexp(1.0, exponent);
  const double reach = (query.radius + 0.5 * size + std::max(query.gap, 0.0)) * (1.0 + 1e-6);
  const Cell low = cellOf(query.centre - Vec3::Constant(reach), size);
  const Cell high = cellOf(query.centre + Vec3::Constant(reach), size);
  double cells = 1.0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    cells *= static_cast<double>(high[axis] - low[axis] + 1);
  }
  if (cells > static_cast<double>(members.size())) return firstNear(query, members);
  return firstNearInCells(query, exponent, low, high);
}

const SphereGrid::Ball* SphereGrid::firstNearInCells(const Query& query, int exponent,
                                                     const Cell& low, const Cell& high) {
  for (std::int64_t x = low[0]; x <= high[0]; ++x) {
    for (std::int64_t y = low[1]; y <= high[1]; ++y) {
      for (std::int64_t z = low[2]; z <= high[2]; ++z) {
        ++work_;
        const auto cell = cells_.find(hash(exponent, {x, y, z}));
        if (cell == cells_.end()) continue;
        const Ball* found = firstNear(query, cell->second);
        if (found != nullptr) return found;
      }
    }
  }
  return nullptr;
}

const SphereGrid::Ball* SphereGrid::firstNear(const Query& query,
                                              const std::vector<std::size_t>& candidates) {
  for (const std::size_t candidate : candidates) {
    ++work_;
    const Ball& ball = balls_[candidate];
    const double nearest = ball.radius + query.radius + query.gap;
    if ((ball.centre - query.centre).squaredNorm() < nearest * nearest) return &ball;
  }
  return nullptr;
}

}  // namespace carom::scenes
