#include "audio/model/surface_locator.h"

#include <algorithm>
#include <cassert>
#include <numeric>

namespace carom::audio {
namespace {

/// Most items in a leaf, which are looked at one by one.
constexpr std::uint32_t kFew = 4;

}  // namespace

SurfaceLocator::SurfaceLocator(const SurfaceMesh& mesh)
    : mesh_(mesh), items_(mesh.triangles.empty() ? mesh.vertices.size() : mesh.triangles.size()) {
  assert(!mesh.vertices.empty());
  std::iota(items_.begin(), items_.end(), 0u);
  build(0, static_cast<std::uint32_t>(items_.size()));
}

/// Returns the vertices of an item: of a triangle, or in a mesh without triangles one vertex
/// thrice.
std::array<std::uint32_t, 3> SurfaceLocator::cornersOf(std::uint32_t item) const {
  if (mesh_.triangles.empty()) return {item, item, item};
  return mesh_.triangles[item];
}

Eigen::AlignedBox3d SurfaceLocator::boxOf(std::uint32_t item) const {
  Eigen::AlignedBox3d box;
  for (const std::uint32_t corner : cornersOf(item))
    box.extend(mesh_.vertices[corner]);
  return box;
}

/// Makes the node of the items from `begin` to `end` and halves them by their middles, along the
/// longest side of the middles' box.
void SurfaceLocator::build(std::uint32_t begin, std::uint32_t end) {
  const std::size_t node = nodes_.size();
  nodes_.push_back({{}, begin, end, 0});
  Eigen::AlignedBox3d middles;
  for (std::uint32_t at = begin; at < end; ++at) {
    const Eigen::AlignedBox3d box = boxOf(items_[at]);
    nodes_[node].box.extend(box);
    middles.extend(box.center());
  }
  if (end - begin <= kFew) return;
  Eigen::Index axis = 0;
  middles.sizes().maxCoeff(&axis);
  const std::uint32_t middle = begin + (end - begin) / 2;
  const auto at = [this](std::uint32_t index) {
    return items_.begin() + static_cast<std::ptrdiff_t>(index);
  };
  std::nth_element(at(begin), at(middle), at(end), [this, axis](auto a, auto b) {
    const double xa = boxOf(a).center()[axis];
    const double xb = boxOf(b).center()[axis];
    return xa != xb ? xa < xb : a < b;
  });
  build(begin, middle);
  nodes_[node].right = static_cast<std::uint32_t>(nodes_.size());
  build(middle, end);
}

void SurfaceLocator::look(const Vec3& point, std::uint32_t item, Best& best) const {
  const auto take = [&](const std::array<std::uint32_t, 3>& corners,
                        const std::array<double, 3>& weights) {
    Vec3 place = Vec3::Zero();
    for (std::size_t corner = 0; corner < corners.size(); ++corner)
      place += weights[corner] * mesh_.vertices[corners[corner]];
    const double distance2 = (place - point).squaredNorm();
    if (distance2 < best.distance2) best = {distance2, {corners, weights, item}};
  };
  const std::array<std::uint32_t, 3> corners = cornersOf(item);
  const std::array<double, 3> weights = nearestInTriangle(
      point, mesh_.vertices[corners[0]], mesh_.vertices[corners[1]], mesh_.vertices[corners[2]]);
  if (weights[0] + weights[1] + weights[2] < 2.0) {
    take(corners, weights);
  } else {  // NaN: the triangle has no area
    for (const std::uint32_t corner : corners)
      take({corner, corner, corner}, {1.0, 0.0, 0.0});
  }
}

void SurfaceLocator::search(const Vec3& point, const Node& node, Best& best) const {
  if (node.right == 0) {
    for (std::uint32_t at = node.begin; at < node.end; ++at)
      look(point, items_[at], best);
    return;
  }
  const Node& left = *(&node + 1);
  const Node& right = nodes_[node.right];
  const double toLeft = left.box.squaredExteriorDistance(point);
  const double toRight = right.box.squaredExteriorDistance(point);
  const bool leftFirst = toLeft <= toRight;
  if (std::min(toLeft, toRight) < best.distance2) search(point, leftFirst ? left : right, best);
  if (std::max(toLeft, toRight) < best.distance2) search(point, leftFirst ? right : left, best);
}

SurfacePoint SurfaceLocator::nearest(const Vec3& point) const {
  Best best;
  best.point.vertices = cornersOf(0);
  search(point, nodes_.front(), best);
  return best.point;
}

}  // namespace carom::audio
