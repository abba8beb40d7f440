#include "bullet_bridge/shapes/surface_union.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <utility>

namespace carom::bullet {
namespace {

using Polygon = std::vector<Vec3>;
using Ring = std::vector<std::uint32_t>;

struct Plane {
  Vec3 normal;
  double offset;  // normal . x of its points

  double above(const Vec3& point) const { return normal.dot(point) - offset; }
};

struct Solid {
  std::vector<Polygon> faces;
  std::vector<Plane> planes;
  std::vector<Vec3> vertices;
  Vec3 low, high;
};

Vec3 twiceArea(const Polygon& polygon) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t k = 2; k < polygon.size(); ++k)
    sum += (polygon[k - 1] - polygon[0]).cross(polygon[k] - polygon[0]);
  return sum;
}

Plane planeOf(const Polygon& polygon) {
  const Vec3 normal = twiceArea(polygon).normalized();
  return {normal, normal.dot(polygon.front())};
}

Solid solidOf(const SurfaceMesh& mesh, double tolerance) {
  Solid solid;
  solid.vertices = mesh.vertices;
  solid.low = solid.high = mesh.vertices.front();
  for (const Vec3& vertex : mesh.vertices) {
    solid.low = solid.low.cwiseMin(vertex);
    solid.high = solid.high.cwiseMax(vertex);
  }
  for (const auto& [first, second, third] : mesh.triangles) {
    const Polygon face = {mesh.vertices[first], mesh.vertices[second], mesh.vertices[third]};
    solid.faces.push_back(face);
    const Plane plane = planeOf(face);
    const bool known = std::any_of(solid.planes.begin(), solid.planes.end(), [&](const Plane& one) {
      return one.normal.dot(plane.normal) > 1.0 - 1e-9 &&
             std::abs(one.offset - plane.offset) < 0.1 * tolerance;
    });
    if (!known) solid.planes.push_back(plane);
  }
  return solid;
}

enum class Lies { above, on, below, across };

Lies sideOf(const Plane& plane, const Polygon& points, double tolerance) {
  bool above = false;
  bool below = false;
  for (const Vec3& point : points) {
    const double height = plane.above(point);
    above = above || height > tolerance;
    below = below || height < -tolerance;
  }
  if (above && below) return Lies::across;
  if (above) return Lies::above;
  return below ? Lies::below : Lies::on;
}

// Returns the part above the plane and the part below it.
std::pair<Polygon, Polygon> split(const Polygon& polygon, const Plane& plane, double tolerance) {
  Polygon above;
  Polygon below;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Vec3& here = polygon[k];
    const Vec3& next = polygon[(k + 1) % polygon.size()];
    const double height = plane.above(here);
    const double nextHeight = plane.above(next);
    if (height >= -tolerance) above.push_back(here);
    if (height <= tolerance) below.push_back(here);
    if ((height > tolerance && nextHeight < -tolerance) ||
        (height < -tolerance && nextHeight > tolerance)) {
      const Vec3 crossing = here + height / (height - nextHeight) * (next - here);
      above.push_back(crossing);
      below.push_back(crossing);
    }
  }
  return {above, below};
}

bool apart(const Polygon& polygon, const Solid& solid, double tolerance) {
  Vec3 low = polygon.front();
  Vec3 high = low;
  for (const Vec3& corner : polygon) {
    low = low.cwiseMin(corner);
    high = high.cwiseMax(corner);
  }
  const Vec3 margin = Vec3::Constant(2.0 * tolerance);
  if (((low - margin).array() > solid.high.array()).any()) return true;
  if (((high + margin).array() < solid.low.array()).any()) return true;
  const Plane plane = planeOf(polygon);
  const auto beyond = [&](double sign) {
    return std::all_of(solid.vertices.begin(), solid.vertices.end(),
                       [&](const Vec3& vertex) { return sign * plane.above(vertex) > tolerance; });
  };
  return beyond(1.0) || beyond(-1.0);
}

// Returns the parts of the polygon that are outside the solid. A face that lies on one of the
// solid's, looking the same way, counts as outside for one of the two solids only.
std::vector<Polygon> outside(const Polygon& polygon, const Solid& solid, bool keepCoincident,
                             double tolerance) {
  const Vec3 normal = planeOf(polygon).normal;
  std::vector<Polygon> kept;
  Polygon rest = polygon;
  for (const Plane& plane : solid.planes) {
    switch (sideOf(plane, rest, tolerance)) {
      case Lies::above:
        return {polygon};
      case Lies::on:
        if (plane.normal.dot(normal) > 0.0 && keepCoincident) return {polygon};
        break;
      case Lies::below:
        break;
      case Lies::across: {
        auto [above, below] = split(rest, plane, tolerance);
        kept.push_back(std::move(above));
        rest = std::move(below);
        break;
      }
    }
  }
  return kept;
}

// The other solids that may touch one, by index. The last one is always among them: parts that have
// no area are dropped before each.
std::vector<std::size_t> neighboursOf(const std::vector<Solid>& solids, std::size_t own,
                                      double tolerance) {
  const Vec3 margin = Vec3::Constant(2.0 * tolerance);
  const Vec3 low = solids[own].low - margin;
  const Vec3 high = solids[own].high + margin;
  std::vector<std::size_t> neighbours;
  for (std::size_t other = 0; other < solids.size(); ++other) {
    if (other == own) continue;
    const Solid& solid = solids[other];
    const bool isApart =
        (low.array() > solid.high.array()).any() || (high.array() < solid.low.array()).any();
    if (!isApart || other + 1 == solids.size()) neighbours.push_back(other);
  }
  return neighbours;
}

std::vector<Polygon> outsideOfAll(const Polygon& face, const std::vector<Solid>& solids,
                                  std::size_t own, const std::vector<std::size_t>& others,
                                  double tolerance) {
  std::vector<Polygon> parts = {face};
  for (const std::size_t other : others) {
    std::vector<Polygon> next;
    for (const Polygon& part : parts) {
      if (twiceArea(part).norm() < tolerance * tolerance) continue;
      if (apart(part, solids[other], tolerance)) {
        next.push_back(part);
        continue;
      }
      for (Polygon& piece : outside(part, solids[other], own < other, tolerance))
        next.push_back(std::move(piece));
    }
    parts = std::move(next);
  }
  return parts;
}

// Vertices by the cells of a grid, about one to a cell.
class VertexGrid {
 public:
  VertexGrid(const std::vector<Vec3>& points, const std::vector<std::uint32_t>& used)
      : cells_(std::clamp<std::size_t>(
            static_cast<std::size_t>(std::cbrt(static_cast<double>(used.size()))), 1, 64)) {
    Eigen::AlignedBox3d box;
    for (const std::uint32_t vertex : used)
      box.extend(points[vertex]);
    low_ = box.min();
    perMetre_ = static_cast<double>(cells_) * box.sizes().cwiseMax(1e-300).cwiseInverse();
    firsts_.resize(cells_ * cells_ * cells_ + 1);
    for (const std::uint32_t vertex : used)
      ++firsts_[cellOf(points[vertex]) + 1];
    std::partial_sum(firsts_.begin(), firsts_.end(), firsts_.begin());
    std::vector<std::size_t> next = firsts_;
    vertices_.resize(used.size());
    for (const std::uint32_t vertex : used)
      vertices_[next[cellOf(points[vertex])]++] = vertex;
  }

  // Calls a function for all vertices in a box, and for some near it.
  template <class Function>
  void visit(const Vec3& low, const Vec3& high, const Function& function) const {
    const auto [firstX, firstY, firstZ] = placeOf(low);
    const auto [lastX, lastY, lastZ] = placeOf(high);
    for (std::size_t z = firstZ; z <= lastZ; ++z) {
      for (std::size_t y = firstY; y <= lastY; ++y) {
        const std::size_t row = cells_ * (y + cells_ * z);
        for (std::size_t k = firsts_[row + firstX]; k < firsts_[row + lastX + 1]; ++k)
          function(vertices_[k]);
      }
    }
  }

 private:
  std::array<std::size_t, 3> placeOf(const Vec3& point) const {
    std::array<std::size_t, 3> place{};
    for (int axis = 0; axis < 3; ++axis) {
      const double at = (point[axis] - low_[axis]) * perMetre_[axis];
      const auto last = static_cast<double>(cells_ - 1);
      place[static_cast<std::size_t>(axis)] =
          at > 0.0 ? static_cast<std::size_t>(std::min(at, last)) : 0;
    }
    return place;
  }
  std::size_t cellOf(const Vec3& point) const {
    const auto [x, y, z] = placeOf(point);
    return x + cells_ * (y + cells_ * z);
  }

  std::size_t cells_;  // along each axis
  Vec3 low_;
  Vec3 perMetre_;                    // cells
  std::vector<std::size_t> firsts_;  // of each cell, in vertices_
  std::vector<std::uint32_t> vertices_;
};

// Returns the ring with all vertices that lie on its edges, in their order.
Ring withVerticesOnEdges(const Ring& ring, const std::vector<Vec3>& points,
                         const VertexGrid& vertices, double tolerance) {
  Ring result;
  for (std::size_t k = 0; k < ring.size(); ++k) {
    const std::uint32_t from = ring[k];
    const std::uint32_t to = ring[(k + 1) % ring.size()];
    result.push_back(from);
    const double length = (points[to] - points[from]).norm();
    const Vec3 along = (points[to] - points[from]) / length;
    std::vector<std::pair<double, std::uint32_t>> between;
    const Vec3 margin = Vec3::Constant(tolerance);
    const Vec3 low = points[from].cwiseMin(points[to]) - margin;
    const Vec3 high = points[from].cwiseMax(points[to]) + margin;
    vertices.visit(low, high, [&](std::uint32_t vertex) {
      const Vec3 offset = points[vertex] - points[from];
      const double place = along.dot(offset);
      if (vertex == from || vertex == to || place <= 0.0 || place >= length) return;
      if ((offset - place * along).norm() <= tolerance) between.emplace_back(place, vertex);
    });
    std::sort(between.begin(), between.end());
    for (const auto& [place, vertex] : between)
      result.push_back(vertex);
  }
  return result;
}

// Cuts ears off the ring, the fattest first; those without area, where vertices lie on a line, are
// left for last.
void triangulate(Ring ring, SurfaceMesh& mesh) {
  while (ring.size() >= 3) {
    std::size_t best = 0;
    double bestShape = -1.0;
    for (std::size_t k = 0; k < ring.size(); ++k) {
      const Vec3& before = mesh.vertices[ring[(k + ring.size() - 1) % ring.size()]];
      const Vec3& here = mesh.vertices[ring[k]];
      const Vec3& after = mesh.vertices[ring[(k + 1) % ring.size()]];
      const double longest = std::max({(here - before).squaredNorm(), (after - here).squaredNorm(),
                                       (before - after).squaredNorm()});
      const double shape = (here - before).cross(after - here).norm() / longest;
      if (shape > bestShape) {
        bestShape = shape;
        best = k;
      }
    }
    mesh.triangles.push_back(
        {ring[(best + ring.size() - 1) % ring.size()], ring[best], ring[(best + 1) % ring.size()]});
    ring.erase(ring.begin() + static_cast<std::ptrdiff_t>(best));
  }
}

SurfaceMesh assembled(const std::vector<Polygon>& polygons, double tolerance) {
  SurfaceMesh mesh;
  for (const Polygon& polygon : polygons)
    mesh.vertices.insert(mesh.vertices.end(), polygon.begin(), polygon.end());
  const std::vector<std::uint32_t> names = coincident(mesh.vertices, 4.0 * tolerance);
  std::vector<std::uint32_t> used = names;
  std::sort(used.begin(), used.end());
  used.erase(std::unique(used.begin(), used.end()), used.end());
  const VertexGrid grid(mesh.vertices, used);
  std::size_t next = 0;
  for (const Polygon& polygon : polygons) {
    Ring ring;
    for (std::size_t k = 0; k < polygon.size(); ++k, ++next) {
      if (ring.empty() || ring.back() != names[next]) ring.push_back(names[next]);
    }
    while (ring.size() > 1 && ring.back() == ring.front())
      ring.pop_back();
    if (ring.size() >= 3)
      triangulate(withVerticesOnEdges(ring, mesh.vertices, grid, 4.0 * tolerance), mesh);
  }
  return mesh;
}

}  // namespace

std::optional<SurfaceMesh> unionOfConvex(const std::vector<SurfaceMesh>& meshes, double tolerance) {
  std::vector<Solid> solids;
  solids.reserve(meshes.size());
  for (const SurfaceMesh& mesh : meshes)
    solids.push_back(solidOf(mesh, tolerance));
  std::vector<Polygon> polygons;
  for (std::size_t own = 0; own < solids.size(); ++own) {
    const std::vector<std::size_t> others = neighboursOf(solids, own, tolerance);
    for (const Polygon& face : solids[own].faces) {
      for (Polygon& part : outsideOfAll(face, solids, own, others, tolerance))
        polygons.push_back(std::move(part));
    }
  }
  SurfaceMesh mesh = welded(assembled(polygons, tolerance), 0.0);
  if (mesh.triangles.empty() || !closedSurface(mesh)) return std::nullopt;
  return mesh;
}

}  // namespace carom::bullet
