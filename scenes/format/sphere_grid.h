#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <unordered_map>
#include <vector>

#include "carom/audio/vector.h"

namespace carom::scenes {

/// A spatial index of spheres of very different radii: a hash of cubic cells with one cell size for
/// each power of two of the diameter. A query visits a few cells for each size in use, as long as
/// no sphere in the grid is much smaller than the query's; otherwise it visits all of the small
/// ones, which work() shows. [one thread]
class SphereGrid {
 public:
  struct Ball {
    Vec3 centre = Vec3::Zero();  ///< m, world frame
    double radius = 0.0;         ///< m, > 0
    std::size_t body = 0;        ///< index in Scene::bodies
  };

  void insert(const Ball& ball);

  /// Returns a ball whose surface is nearer than `gap` (m; negative: an overlap deeper than that),
  /// or nullptr. The pointer is valid until the next ball is inserted.
  const Ball* nearerThan(double gap, const Vec3& centre, double radius);

  /// Distances computed and cells visited so far.
  std::uint64_t work() const { return work_; }

 private:
  using Cell = std::array<std::int64_t, 3>;
  struct Query {
    Vec3 centre;
    double radius;
    double gap;
  };

  static Cell cellOf(const Vec3& point, double size);
  static std::uint64_t hash(int exponent, const Cell& cell);
  const Ball* nearestInLevel(const Query& query, int exponent,
                             const std::vector<std::size_t>& members);
  const Ball* firstNearInCells(const Query& query, int exponent, const Cell& low, const Cell& high);
  const Ball* firstNear(const Query& query, const std::vector<std::size_t>& candidates);

  std::vector<Ball> balls_;
  std::map<int, std::vector<std::size_t>> levels_;  // indices in balls_, by exponent of the size
  std::unordered_map<std::uint64_t, std::vector<std::size_t>> cells_;
  std::uint64_t work_ = 0;
};

}  // namespace carom::scenes
