#include "audio/radiation/edge_collapse.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <cstdint>
#include <functional>
#include <iterator>
#include <queue>
#include <utility>
#include <vector>

#include <Eigen/Core>

namespace carom::audio {
namespace {

using Corners = std::array<std::uint32_t, 3>;

constexpr double kLeastTurn = 0.2;     // cosine between a triangle's normals before and after
constexpr double kLeastHeight = 1e-3;  // of a triangle over its longest edge

bool has(const Corners& corners, std::uint32_t vertex) {
  return std::ranges::find(corners, vertex) != corners.end();
}

// The mean square distance of a point from the planes of triangles, by area.
struct Planes {
  Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
  double area = 0.0;

  void add(const Planes& other) {
    sum += other.sum;
    area += other.area;
  }
  double meanSquareAt(const Vec3& point) const {
    const Eigen::Vector4d at = point.homogeneous();
    return area > 0.0 ? at.dot(sum * at) / area : 0.0;
  }
};

class Collapse {
 public:
  Collapse(const SurfaceMesh& mesh, double deviation)
      : mesh_(mesh), left_(mesh.triangles.size()), mostSquare_(deviation * deviation) {
    planes_.resize(mesh.vertices.size());
    around_.resize(mesh.vertices.size());
    gone_.resize(mesh.triangles.size(), false);
    for (std::uint32_t triangle = 0; triangle < mesh.triangles.size(); ++triangle) {
      const Planes planes = planesOf(mesh.triangles[triangle]);
      for (const std::uint32_t corner : mesh.triangles[triangle]) {
        planes_[corner].add(planes);
        around_[corner].push_back(triangle);
      }
    }
    for (const Corners& corners : mesh.triangles)
      for (std::size_t side = 0; side < 3; ++side)
        push(corners[side], corners[(side + 1) % 3]);
  }

  SurfaceMesh downTo(std::size_t most) {
    while (left_ > most && !edges_.empty()) {
      const Edge edge = edges_.top();
      edges_.pop();
      if (edge.square == squareOf(edge.from, edge.to) && mayMove(edge.from, edge.to))
        move(edge.from, edge.to);
    }
    return compacted();
  }

 private:
  // An edge of which `from` may go to `to`. Its order makes the queue's outcome the same each time.
  struct Edge {
    double square;  // m^2, of the length
    std::uint32_t from;
    std::uint32_t to;

    auto operator<=>(const Edge&) const = default;
  };

  Planes planesOf(const Corners& corners) const {
    const Vec3& at = mesh_.vertices[corners[0]];
    const Vec3 twice = normalOf(corners);
    const Vec3 normal = twice.normalized();
    Eigen::Vector4d plane;
    plane << normal, -normal.dot(at);
    return {0.5 * twice.norm() * plane * plane.transpose(), 0.5 * twice.norm()};
  }

  // Returns the normal of a triangle, as long as twice its area.
  Vec3 normalOf(const Corners& corners) const {
    const Vec3& at = mesh_.vertices[corners[0]];
    return (mesh_.vertices[corners[1]] - at).cross(mesh_.vertices[corners[2]] - at);
  }

  double squareOf(std::uint32_t from, std::uint32_t to) const {
    return (mesh_.vertices[from] - mesh_.vertices[to]).squaredNorm();
  }

  double longestSquare(const Corners& corners) const {
    return std::max({squareOf(corners[0], corners[1]), squareOf(corners[1], corners[2]),
                     squareOf(corners[2], corners[0])});
  }

  void push(std::uint32_t from, std::uint32_t to) {
    edges_.push({squareOf(from, to), from, to});
    edges_.push({squareOf(from, to), to, from});
  }

  std::vector<std::uint32_t> neighboursOf(std::uint32_t vertex) const {
    std::vector<std::uint32_t> neighbours;
    for (const std::uint32_t triangle : around_[vertex])
      for (const std::uint32_t corner : mesh_.triangles[triangle])
        if (corner != vertex) neighbours.push_back(corner);
    std::ranges::sort(neighbours);
    neighbours.erase(std::unique(neighbours.begin(), neighbours.end()), neighbours.end());
    return neighbours;
  }

  // True if both are neighbours by an edge with one triangle on each side, and by nothing else that
  // would become double.
  bool isSimple(std::uint32_t from, std::uint32_t to) const {
    const auto shared = std::ranges::count_if(
        around_[from], [&](std::uint32_t triangle) { return has(mesh_.triangles[triangle], to); });
    if (shared != 2) return false;
    std::vector<std::uint32_t> common;
    std::ranges::set_intersection(neighboursOf(from), neighboursOf(to), std::back_inserter(common));
    return common.size() == 2;
  }

  bool mayMove(std::uint32_t from, std::uint32_t to) const {
    if (planes_[from].meanSquareAt(mesh_.vertices[to]) > mostSquare_ || !isSimple(from, to))
      return false;
    return std::ranges::all_of(around_[from], [&](std::uint32_t triangle) {
      Corners corners = mesh_.triangles[triangle];
      if (has(corners, to)) return true;
      const Vec3 before = normalOf(corners);
      std::ranges::replace(corners, from, to);
      const Vec3 after = normalOf(corners);
      return after.norm() > kLeastHeight * longestSquare(corners) &&
             before.dot(after) > kLeastTurn * before.norm() * after.norm();
    });
  }

  void move(std::uint32_t from, std::uint32_t to) {
    planes_[to].add(planes_[from]);
    for (const std::uint32_t triangle : std::exchange(around_[from], {})) {
      Corners& corners = mesh_.triangles[triangle];
      if (has(corners, to)) {
        gone_[triangle] = true;
        --left_;
        for (const std::uint32_t corner : corners)
          if (corner != from) std::erase(around_[corner], triangle);
        continue;
      }
      std::ranges::replace(corners, from, to);
      around_[to].push_back(triangle);
    }
    for (const std::uint32_t neighbour : neighboursOf(to))
      push(to, neighbour);
  }

  SurfaceMesh compacted() const {
    SurfaceMesh result;
    std::vector<std::uint32_t> name(mesh_.vertices.size(), 0);
    std::vector<bool> known(mesh_.vertices.size(), false);
    for (std::size_t triangle = 0; triangle < mesh_.triangles.size(); ++triangle) {
      if (gone_[triangle]) continue;
      Corners corners = mesh_.triangles[triangle];
      for (std::uint32_t& corner : corners) {
        if (!known[corner]) {
          known[corner] = true;
          name[corner] = static_cast<std::uint32_t>(result.vertices.size());
          result.vertices.push_back(mesh_.vertices[corner]);
        }
        corner = name[corner];
      }
      result.triangles.push_back(corners);
    }
    return result;
  }

  SurfaceMesh mesh_;
  std::size_t left_;   // triangles that are not gone
  double mostSquare_;  // m^2
  std::vector<Planes> planes_;
  std::vector<std::vector<std::uint32_t>> around_;  // triangles of each vertex
  std::vector<bool> gone_;
  std::priority_queue<Edge, std::vector<Edge>, std::greater<>> edges_;
};

}  // namespace

SurfaceMesh collapsedSurface(const SurfaceMesh& mesh, std::size_t most, double deviation) {
  return Collapse(mesh, deviation).downTo(most);
}

}  // namespace carom::audio
