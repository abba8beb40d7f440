#include "modal/radiation/radiating_panels.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "audio/radiation/panel_mesh.h"
#include "modal/mesh/triangle_points.h"

namespace carom::modal {

using namespace audio;

namespace {

constexpr std::size_t kSamplesPerPanel = 12;  // least number, on a surface that was clustered

using Shares = std::vector<Eigen::Triplet<double>>;

Vec3 vectorArea(const std::array<Vec3, 3>& corners) {
  return 0.5 * (corners[1] - corners[0]).cross(corners[2] - corners[0]);
}

Vec3 centroidOf(const std::array<Vec3, 3>& corners) {
  return (corners[0] + corners[1] + corners[2]) / 3.0;
}

// A set of triangles in which to look up the nearest that faces the same way.
class NearestTriangle {
 public:
  explicit NearestTriangle(const SurfaceMesh& mesh) {
    for (std::size_t triangle = 0; triangle < mesh.triangles.size(); ++triangle) {
      Entry entry;
      entry.corners = cornersOf(mesh, triangle);
      entry.centre = centroidOf(entry.corners);
      entry.normal = vectorArea(entry.corners).normalized();
      for (const Vec3& corner : entry.corners)
        entry.reach = std::max(entry.reach, (corner - entry.centre).norm());
      entries_.push_back(entry);
    }
  }

  // A triangle that faces away counts as further off by the size of a triangle or more: the other
  // side of a thin plate is near, but not the same.
  std::size_t to(const Vec3& point, const Vec3& normal) const {
    std::size_t nearest = 0;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t triangle = 0; triangle < entries_.size(); ++triangle) {
      const Entry& entry = entries_[triangle];
      const double turned = (1.0 - entry.normal.dot(normal)) * 2.0 * entry.reach;
      if ((entry.centre - point).norm() - entry.reach + turned >= least) continue;
      const Vec3 there = pointOf(entry.corners, closestOnTriangle(entry.corners, point));
      const double distance = (there - point).norm() + turned;
      if (distance >= least) continue;
      least = distance;
      nearest = triangle;
    }
    return nearest;
  }

 private:
  struct Entry {
    std::array<Vec3, 3> corners;
    Vec3 centre = Vec3::Zero();
    Vec3 normal = Vec3::Zero();
    double reach = 0.0;
  };
  std::vector<Entry> entries_;
};

// The surface from which the panels are made. The model's vertices keep their places; those of a
// sheet's other side follow.
struct Solid {
  SurfaceMesh surface;
  std::size_t vertices = 0;  // number of the model's own
  double thickness = 0.0;
};

// Adds the shape at a place of a triangle, along `weight`, to `row`.
void addShare(Shares& shares, std::size_t row, const Solid& solid, std::size_t triangle,
              const Vec3& barycentric, const Vec3& weight) {
  for (std::size_t corner = 0; corner < 3; ++corner) {
    const std::size_t vertex = solid.surface.triangles[triangle][corner] % solid.vertices;
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      shares.emplace_back(static_cast<int>(row),
                          static_cast<int>(3 * vertex + static_cast<std::size_t>(axis)),
                          barycentric[static_cast<Eigen::Index>(corner)] * weight[axis]);
  }
}

// Each panel lies in one triangle, where shapes are linear: its centroid has the mean.
Shares sharesOfSplit(const Solid& solid, const SurfaceMesh& panels) {
  Shares shares;
  const NearestTriangle nearest(solid.surface);
  for (std::size_t panel = 0; panel < panels.triangles.size(); ++panel) {
    const std::array<Vec3, 3> corners = cornersOf(panels, panel);
    const Vec3 normal = vectorArea(corners).normalized();
    const std::size_t triangle = nearest.to(centroidOf(corners), normal);
    addShare(shares, panel, solid, triangle,
             closestOnTriangle(cornersOf(solid.surface, triangle), centroidOf(corners)), normal);
  }
  return shares;
}

// The centroids, in barycentric coordinates, of the triangles that n - 1 lines along each side of a
// triangle make.
std::vector<Vec3> centroidsOfSplit(std::size_t n) {
  std::vector<Vec3> centroids;
  const auto count = static_cast<double>(n);
  const auto add = [&](double first, double second) {
    centroids.emplace_back(first / count, second / count, 1.0 - (first + second) / count);
  };
  for (std::size_t row = 0; row < n; ++row) {
    for (std::size_t column = 0; row + column < n; ++column) {
      const auto first = static_cast<double>(row);
      const auto second = static_cast<double>(column);
      add(first + 1.0 / 3.0, second + 1.0 / 3.0);
      if (row + column + 1 < n) add(first + 2.0 / 3.0, second + 2.0 / 3.0);
    }
  }
  return centroids;
}

Shares sharesOfClustered(const Solid& solid, const SurfaceMesh& panels) {
  Shares shares;
  const NearestTriangle nearest(panels);
  const double wanted = static_cast<double>(kSamplesPerPanel * panels.triangles.size()) /
                        static_cast<double>(solid.surface.triangles.size());
  const std::vector<Vec3> samples =
      centroidsOfSplit(static_cast<std::size_t>(std::ceil(std::sqrt(wanted))));
  for (std::size_t triangle = 0; triangle < solid.surface.triangles.size(); ++triangle) {
    const std::array<Vec3, 3> corners = cornersOf(solid.surface, triangle);
    const Vec3 area = vectorArea(corners) / static_cast<double>(samples.size());
    for (const Vec3& sample : samples) {
      const std::size_t panel = nearest.to(pointOf(corners, sample), area.normalized());
      const double panelArea = vectorArea(cornersOf(panels, panel)).norm();
      addShare(shares, panel, solid, triangle, sample, area / panelArea);
    }
  }
  return shares;
}

// Returns the two sides and the rim of a sheet. The sheet's vertices come first, moved outwards by
// half of the thickness, then those of the other side.
SurfaceMesh thickened(const SurfaceMesh& sheet, double thickness) {
  std::vector<Vec3> normals(sheet.vertices.size(), Vec3::Zero());
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> passes;
  for (std::size_t triangle = 0; triangle < sheet.triangles.size(); ++triangle) {
    const auto& corners = sheet.triangles[triangle];
    for (std::size_t side = 0; side < 3; ++side) {
      normals[corners[side]] += vectorArea(cornersOf(sheet, triangle));
      ++passes[{corners[side], corners[(side + 1) % 3]}];
    }
  }
  const auto other = static_cast<std::uint32_t>(sheet.vertices.size());
  SurfaceMesh solid = sheet;
  solid.vertices.insert(solid.vertices.end(), sheet.vertices.begin(), sheet.vertices.end());
  for (std::uint32_t vertex = 0; vertex < other; ++vertex) {
    const Vec3 half = 0.5 * thickness * normals[vertex].normalized();
    solid.vertices[vertex] += half;
    solid.vertices[vertex + other] -= half;
  }
  for (const auto& [first, second, third] : sheet.triangles)
    solid.triangles.push_back({first + other, third + other, second + other});
  for (const auto& [edge, times] : passes) {
    const auto [from, to] = edge;
    if (passes.contains({to, from})) continue;
    solid.triangles.push_back({to, from, from + other});
    solid.triangles.push_back({to, from + other, to + other});
  }
  return solid;
}

Result<Solid> solidOf(const ModalModel& model) {
  Solid solid;
  solid.vertices = model.surface.vertices.size();
  Result<SurfaceMesh> clean = cleanSurface(model.surface);
  if (!clean && !closedSurface(model.surface)) {
    solid.thickness = model.mass / (model.material.density * surfaceArea(model.surface));
    clean = cleanSurface(thickened(model.surface, solid.thickness));
  }
  if (!clean) return clean.error();
  solid.surface = std::move(*clean);
  return solid;
}

}  // namespace

Result<RadiatingPanels> radiatingPanels(const ModalModel& model, std::size_t most) {
  Result<Solid> solid = solidOf(model);
  if (!solid) return solid.error();
  RadiatingPanels panels;
  panels.thickness = solid->thickness;
  const std::size_t given = solid->surface.triangles.size();
  panels.surface = given > most ? clusteredSurface(solid->surface, most)
                                : halvedSurface(solid->surface, most / 2);
  const double kept = signedVolume(panels.surface) / signedVolume(solid->surface);
  if (!(kept > 1.0 - kMostVolumeLost && kept < 1.0 + kMostVolumeLost)) {
    return Error{"surface: simplified from " + std::to_string(given) + " to " +
                 std::to_string(panels.surface.triangles.size()) + " panels it has " +
                 std::to_string(kept) + " of its volume; expected a simpler mesh, or more panels"};
  }
  const Shares shares = given > most ? sharesOfClustered(*solid, panels.surface)
                                     : sharesOfSplit(*solid, panels.surface);
  panels.normalShape.resize(static_cast<Eigen::Index>(panels.surface.triangles.size()),
                            static_cast<Eigen::Index>(3 * solid->vertices));
  panels.normalShape.setFromTriplets(shares.begin(), shares.end());
  panels.solid = std::move(solid->surface);
  return panels;
}

// The integral of the square of a linear function over a triangle is area / 12 (sum of squares +
// square of sum).
double resolvedShare(const RadiatingPanels& panels, const Eigen::VectorXd& shape) {
  const std::size_t vertices = static_cast<std::size_t>(shape.size()) / 3;
  double whole = 0.0;
  for (std::size_t triangle = 0; triangle < panels.solid.triangles.size(); ++triangle) {
    const Vec3 area = vectorArea(cornersOf(panels.solid, triangle));
    Vec3 along = Vec3::Zero();
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const std::size_t vertex = panels.solid.triangles[triangle][corner] % vertices;
      along[static_cast<Eigen::Index>(corner)] =
          shape.segment<3>(static_cast<Eigen::Index>(3 * vertex)).dot(area.normalized());
    }
    whole += area.norm() / 12.0 * (along.squaredNorm() + along.sum() * along.sum());
  }
  const Eigen::VectorXd means = panels.normalShape * shape;
  double kept = 0.0;
  for (Eigen::Index row = 0; row < means.size(); ++row)
    kept += vectorArea(cornersOf(panels.surface, static_cast<std::size_t>(row))).norm() *
            means[row] * means[row];
  return whole > 0.0 ? kept / whole : 1.0;
}

}  // namespace carom::modal
