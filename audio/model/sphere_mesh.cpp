#include "audio/model/sphere_mesh.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <utility>

namespace carom::audio {
namespace {

using Corners = std::array<std::size_t, 3>;

constexpr double kShift = 1e-6;        // rad, see the class
constexpr double kMinDistance = 1e-4;  // rad
constexpr std::size_t kCellsPerEdge = 16;

/// Pseudo-random number from -1 to 1, the same on every machine.
double scatter(std::uint64_t& state) {
  state = state * 6364136223846793005u + 1442695040888963407u;
  return static_cast<double>(state >> 11) * 0x1p-52 - 1.0;
}

std::vector<Vec3> shifted(const std::vector<Vec3>& points) {
  std::vector<Vec3> moved;
  moved.reserve(points.size());
  std::uint64_t state = 1;
  for (const Vec3& point : points) {
    const double x = scatter(state);
    const double y = scatter(state);
    const double z = scatter(state);
    moved.push_back((point + kShift * Vec3(x, y, z)).normalized());
  }
  return moved;
}

/// The convex hull of points on the unit sphere, grown point by point: each removes the faces that
/// it sees and is joined to their outline.
class Hull {
 public:
  explicit Hull(const std::vector<Vec3>& points) : points_(points) {}

  /// Returns the faces of the hull; none if the points do not span a volume.
  std::vector<Corners> faces() {
    if (!start()) return {};
    for (std::size_t point = 0; point < points_.size(); ++point)
      if (std::find(first_.begin(), first_.end(), point) == first_.end()) add(point);
    std::vector<Corners> result;
    for (const Face& face : faces_)
      result.push_back(face.corner);
    return result;
  }

 private:
  struct Face {
    Corners corner;
    Vec3 normal;
    double height;
  };

  void addFace(std::size_t a, std::size_t b, std::size_t c) {
    const Vec3 normal = (points_[b] - points_[a]).cross(points_[c] - points_[a]);
    faces_.push_back({{a, b, c}, normal, normal.dot(points_[a])});
  }

  template <class Measure>
  std::size_t largest(const Measure& measure) const {
    std::size_t best = 0;
    for (std::size_t point = 1; point < points_.size(); ++point)
      if (measure(points_[point]) > measure(points_[best])) best = point;
    return best;
  }

  /// Begins with a simplex as large as can be found easily; false if the points span no volume.
  bool start() {
    if (points_.size() < 4) return false;
    const Vec3 a = points_[0];
    first_[0] = 0;
    first_[1] = largest([&](const Vec3& p) { return (p - a).norm(); });
    const Vec3 b = points_[first_[1]];
    first_[2] = largest([&](const Vec3& p) { return (p - a).cross(b - a).norm(); });
    const Vec3 normal = (b - a).cross(points_[first_[2]] - a);
    first_[3] = largest([&](const Vec3& p) { return std::abs(normal.dot(p - a)); });
    const double volume = normal.dot(points_[first_[3]] - a);
    if (std::abs(volume) < 1e-4) return false;
    if (volume > 0.0) std::swap(first_[1], first_[2]);  // the fourth lies below the first three
    addFace(first_[0], first_[1], first_[2]);
    addFace(first_[0], first_[3], first_[1]);
    addFace(first_[1], first_[3], first_[2]);
    addFace(first_[2], first_[3], first_[0]);
    return true;
  }

  void add(std::size_t point) {
    const Vec3& place = points_[point];
    edges_.clear();
    const auto isSeen = [&](const Face& face) {
      if (!(face.normal.dot(place) > face.height)) return false;
      for (std::size_t corner = 0; corner < 3; ++corner)
        edges_.emplace_back(face.corner[corner], face.corner[(corner + 1) % 3]);
      return true;
    };
    std::erase_if(faces_, isSeen);
    for (const auto& [from, to] : edges_) {
      const std::pair reverse(to, from);
      if (std::find(edges_.begin(), edges_.end(), reverse) == edges_.end())
        addFace(from, to, point);
    }
  }

  const std::vector<Vec3>& points_;
  std::array<std::size_t, 4> first_ = {0, 0, 0, 0};
  std::vector<Face> faces_;
  std::vector<std::pair<std::size_t, std::size_t>> edges_;
};

bool areApart(const std::vector<Vec3>& points) {
  std::vector<std::size_t> order(points.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t one, std::size_t two) { return points[one].z() < points[two].z(); });
  for (std::size_t one = 0; one < order.size(); ++one)
    for (std::size_t two = one + 1; two < order.size(); ++two) {
      const Vec3 difference = points[order[two]] - points[order[one]];
      if (difference.z() > kMinDistance) break;
      if (difference.norm() < kMinDistance) return false;
    }
  return true;
}

/// Returns the cell, of a cube around the origin, that the direction passes through.
std::size_t cellOf(const Vec3& direction) {
  Eigen::Index axis = 0;
  const double most = direction.cwiseAbs().maxCoeff(&axis);
  const double edge = static_cast<double>(kCellsPerEdge);
  const auto cell = [&](double value) {
    const double place = 0.5 * (value / most + 1.0) * edge;
    return std::min(static_cast<std::size_t>(std::max(place, 0.0)), kCellsPerEdge - 1);
  };
  const std::size_t side =
      2 * static_cast<std::size_t>(axis) + (direction[axis] < 0.0 ? std::size_t{1} : 0);
  return (side * kCellsPerEdge + cell(direction[(axis + 1) % 3])) * kCellsPerEdge +
         cell(direction[(axis + 2) % 3]);
}

Vec3 middleOfCell(std::size_t cell) {
  const auto place = [](std::size_t index) {
    return (2.0 * static_cast<double>(index) + 1.0) / static_cast<double>(kCellsPerEdge) - 1.0;
  };
  const std::size_t side = cell / (kCellsPerEdge * kCellsPerEdge);
  const auto axis = static_cast<Eigen::Index>(side / 2);
  Vec3 middle = Vec3::Zero();
  middle[axis] = side % 2 == 0 ? 1.0 : -1.0;
  middle[(axis + 1) % 3] = place(cell / kCellsPerEdge % kCellsPerEdge);
  middle[(axis + 2) % 3] = place(cell % kCellsPerEdge);
  return middle;
}

}  // namespace

std::optional<SphereMesh> SphereMesh::create(std::vector<Vec3> unitDirections) {
  if (!areApart(unitDirections)) return std::nullopt;
  SphereMesh mesh;
  mesh.points_ = std::move(unitDirections);
  for (const Corners& face : Hull(shifted(mesh.points_)).faces())
    mesh.triangles_.push_back({face, {0, 0, 0}});
  if (mesh.triangles_.empty() || !mesh.connect()) return std::nullopt;
  mesh.fillCells();
  return mesh;
}

/// Finds the neighbours; false when a gap is too wide or the triangles are no closed surface.
bool SphereMesh::connect() {
  using Edge = std::array<std::size_t, 4>;  // from, to, triangle, corner
  std::vector<Edge> edges;
  for (std::size_t triangle = 0; triangle < triangles_.size(); ++triangle) {
    const Corners& corner = triangles_[triangle].corner;
    const Vec3 normal = (points_[corner[1]] - points_[corner[0]])
                            .cross(points_[corner[2]] - points_[corner[0]])
                            .normalized();
    if (!(normal.dot(points_[corner[0]]) > std::cos(kMaxGap))) return false;
    for (std::size_t side = 0; side < 3; ++side)
      edges.push_back({corner[(side + 1) % 3], corner[(side + 2) % 3], triangle, side});
  }
  std::sort(edges.begin(), edges.end());
  for (const Edge& edge : edges) {
    const Edge reverse = {edge[1], edge[0], 0, 0};
    const auto other = std::lower_bound(edges.begin(), edges.end(), reverse);
    if (other == edges.end() || (*other)[0] != edge[1] || (*other)[1] != edge[0]) return false;
    triangles_[edge[2]].neighbour[edge[3]] = (*other)[2];
  }
  return triangles_.size() == 2 * points_.size() - 4;
}

void SphereMesh::fillCells() {
  cells_.resize(6 * kCellsPerEdge * kCellsPerEdge);
  std::size_t start = 0;
  for (std::size_t cell = 0; cell < cells_.size(); ++cell)
    cells_[cell] = start = walk(start, middleOfCell(cell));
}

/// Barycentric coordinates up to a common positive factor.
std::array<double, 3> SphereMesh::coordinates(std::size_t triangle, const Vec3& direction) const {
  const Corners& corner = triangles_[triangle].corner;
  const Vec3& a = points_[corner[0]];
  const Vec3& b = points_[corner[1]];
  const Vec3& c = points_[corner[2]];
  return {direction.dot(b.cross(c)), direction.dot(c.cross(a)), direction.dot(a.cross(b))};
}

/// Finds the triangle that a direction passes through: goes from triangle to triangle, across the
/// edge that the direction lies farthest beyond.
std::size_t SphereMesh::walk(std::size_t start, const Vec3& direction) const {
  std::size_t triangle = start;
  for (std::size_t step = 0; step < triangles_.size(); ++step) {
    const std::array<double, 3> place = coordinates(triangle, direction);
    const auto least = std::min_element(place.begin(), place.end());
    if (*least >= 0.0) return triangle;
    triangle = triangles_[triangle].neighbour[static_cast<std::size_t>(least - place.begin())];
  }
  return nearestByAll(direction);  // rounding may lead in circles, on an edge
}

std::size_t SphereMesh::nearestByAll(const Vec3& direction) const {
  std::size_t best = 0;
  double bestPlace = -2.0 * direction.norm();
  for (std::size_t triangle = 0; triangle < triangles_.size(); ++triangle) {
    const std::array<double, 3> place = coordinates(triangle, direction);
    const double least = *std::min_element(place.begin(), place.end());
    if (least > bestPlace) {
      best = triangle;
      bestPlace = least;
    }
  }
  return best;
}

SphereWeights SphereMesh::weights(const Vec3& direction) const noexcept {
  const double length = direction.norm();
  if (!(length > 0.0 && std::isfinite(length))) return {};
  const Vec3 unit = direction / length;
  const std::size_t triangle = walk(cells_[cellOf(unit)], unit);
  SphereWeights result{triangles_[triangle].corner, coordinates(triangle, unit)};
  for (double& weight : result.weight)
    weight = std::max(weight, 0.0);
  const double sum = result.weight[0] + result.weight[1] + result.weight[2];
  for (double& weight : result.weight)
    weight /= sum;
  return result;
}

}  // namespace carom::audio
