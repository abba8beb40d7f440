#include "modal/mesh/polygon_mesh.h"

#include <algorithm>
#include <optional>

namespace carom::modal {
namespace {

/// Returns twice the area, along the normal of the plane that fits (Newell's).
Vec3 twiceAreaOf(std::span<const std::uint32_t> polygon, const std::vector<Vec3>& vertices) {
  const Vec3& apex = vertices[polygon[0]];
  Vec3 sum = Vec3::Zero();
  for (std::size_t corner = 2; corner < polygon.size(); ++corner)
    sum += (vertices[polygon[corner - 1]] - apex).cross(vertices[polygon[corner]] - apex);
  return sum;
}

class EarCutter {
 public:
  /// Takes its looks at corners from `looks`.
  EarCutter(std::span<const std::uint32_t> polygon, const std::vector<Vec3>& vertices,
            std::uint64_t& looks)
      : ring_(polygon.begin(), polygon.end()),
        vertices_(vertices),
        normal_(twiceAreaOf(polygon, vertices)),
        looks_(looks) {}

  void cut(std::vector<std::array<std::uint32_t, 3>>& triangles) {
    int without = 0;
    while (ring_.size() > 3 && without < kMostWithout && looks_ > 0) {
      const std::optional<std::size_t> found = nextEar();
      if (!found) ++without;
      const std::size_t ear = found.value_or(1);
      triangles.push_back({before(ear), ring_[ear], after(ear)});
      ring_.erase(ring_.begin() + static_cast<std::ptrdiff_t>(ear));
    }
    for (std::size_t corner = 2; corner < ring_.size(); ++corner)
      triangles.push_back({ring_[0], ring_[corner - 1], ring_[corner]});
  }

 private:
  std::uint32_t before(std::size_t corner) const {
    return ring_[(corner + ring_.size() - 1) % ring_.size()];
  }
  std::uint32_t after(std::size_t corner) const { return ring_[(corner + 1) % ring_.size()]; }

  /// Above 0 if the three vertices turn as the polygon does.
  double turn(std::uint32_t first, std::uint32_t second, std::uint32_t third) const {
    const Vec3& middle = vertices_[second];
    return normal_.dot((middle - vertices_[first]).cross(vertices_[third] - middle));
  }

  bool isEar(std::size_t corner) const {
    looks_ -= std::min<std::uint64_t>(looks_, ring_.size());
    const std::uint32_t first = before(corner);
    const std::uint32_t second = ring_[corner];
    const std::uint32_t third = after(corner);
    if (!(turn(first, second, third) > 0.0)) return false;
    return std::ranges::none_of(ring_, [&](std::uint32_t other) {
      if (other == first || other == second || other == third) return false;
      return turn(first, second, other) >= 0.0 && turn(second, third, other) >= 0.0 &&
             turn(third, first, other) >= 0.0;
    });
  }

  /// Returns a corner that is an ear; none where the polygon crosses itself, or has no area left.
  std::optional<std::size_t> nextEar() const {
    for (std::size_t corner = 1; corner <= ring_.size(); ++corner)
      if (isEar(corner % ring_.size())) return corner % ring_.size();
    return std::nullopt;
  }

  /// Corners that are cut off though they are no ears, as there may be ears behind them.
  static constexpr int kMostWithout = 8;

  std::vector<std::uint32_t> ring_;
  const std::vector<Vec3>& vertices_;
  Vec3 normal_;
  std::uint64_t& looks_;
};

}  // namespace

void PolygonCutter::cut(std::span<const std::uint32_t> polygon,
                        std::vector<std::array<std::uint32_t, 3>>& triangles) {
  if (polygon.size() >= 3) EarCutter(polygon, vertices_, looks_).cut(triangles);
}

}  // namespace carom::modal
