#include "modal/analysis/voxel_mesh.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>
#include <string>
#include <utility>

#include <Eigen/Eigenvalues>

namespace carom::modal {
namespace {

constexpr double kFrameGain = 0.001;     // least share of the box's volume that turning saves
constexpr std::size_t kFacesTried = 12;  // triangles whose own axes are tried
constexpr double kFlattest = 5.0;
constexpr double kFlattening = 0.25;   // cells' edges go by this power of the body's
constexpr double kLeastInside = 0.01;  // share of a cell; with less inside, it is left out
constexpr double kVolumeOff = 0.05;    // largest relative error of the volume
constexpr double kSnap = 1e-9;         // share of a cell; surfaces nearer to a face lie on it
// Shift of the rays, in rows, so that they pass beside the vertices and edges of grids and boxes.
constexpr double kGridShift = 1.37e-6;
constexpr int kTries = 9;           // sizes of cells tried, each finer by 1.25: to an eighth
constexpr double kMostCells = 3e7;  // cells in the grid's box, inside or not

// ---- The frame

struct Extent {
  Vec3 low;
  Vec3 size;
};

Extent extentAlong(const SurfaceMesh& surface, const Eigen::Matrix3d& axes) {
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity());
  Vec3 high = -low;
  for (const auto& triangle : surface.triangles) {
    for (const std::uint32_t corner : triangle) {
      const Vec3 at = axes.transpose() * surface.vertices[corner];
      low = low.cwiseMin(at);
      high = high.cwiseMax(at);
    }
  }
  return {low, high - low};
}

Eigen::Matrix3d principalAxes(const SurfaceMesh& surface) {
  const Eigen::Matrix3d moment = secondMoment(surface, volumeCentroid(surface));
  Eigen::Matrix3d axes = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(moment).eigenvectors();
  if (axes.determinant() < 0.0) axes.col(2) *= -1.0;
  return axes;
}

// Axes along an edge of each of the largest triangles, and across its plane.
std::vector<Eigen::Matrix3d> faceAxes(const SurfaceMesh& surface) {
  std::vector<std::pair<double, std::size_t>> largest;
  const auto normal = [&](std::size_t index) -> Vec3 {
    const auto& [a, b, c] = surface.triangles[index];
    return (surface.vertices[b] - surface.vertices[a])
        .cross(surface.vertices[c] - surface.vertices[a]);
  };
  for (std::size_t index = 0; index < surface.triangles.size(); ++index)
    largest.emplace_back(-normal(index).squaredNorm(), index);
  const std::size_t count = std::min(kFacesTried, largest.size());
  std::partial_sort(largest.begin(), largest.begin() + static_cast<std::ptrdiff_t>(count),
                    largest.end());
  std::vector<Eigen::Matrix3d> frames;
  for (std::size_t rank = 0; rank < count; ++rank) {
    const auto& triangle = surface.triangles[largest[rank].second];
    for (std::size_t side = 0; side < 3; ++side) {
      Eigen::Matrix3d axes;
      axes.col(0) = (surface.vertices[triangle[(side + 1) % 3]] - surface.vertices[triangle[side]])
                        .normalized();
      axes.col(2) = normal(largest[rank].second).normalized();
      axes.col(1) = axes.col(2).cross(axes.col(0));
      frames.push_back(axes);
    }
  }
  return frames;
}

Eigen::Matrix3d bestAxes(const SurfaceMesh& surface) {
  std::vector<Eigen::Matrix3d> frames = faceAxes(surface);
  frames.push_back(principalAxes(surface));
  Eigen::Matrix3d best = Eigen::Matrix3d::Identity();
  double least = (1.0 - kFrameGain) * extentAlong(surface, best).size.prod();
  for (const Eigen::Matrix3d& axes : frames) {
    const double volume = extentAlong(surface, axes).size.prod();
    if (!(volume < (1.0 - 1e-9) * least)) continue;
    least = volume;
    best = axes;
  }
  return best;
}

// ---- Rays

struct Crossing {
  std::size_t row;
  double x;  // coordinate in cells
  int turn;  // +1 into the body
};

// Twice the signed area of the triangle from two vertices to a point, in the plane y z. It is the
// same number, but for its sign, whichever way the edge is passed: neighbours never both claim the
// point or both leave it.
double sideOf(const Vec3& from, const Vec3& to, double y, double z) {
  const bool swapped = std::pair(from.y(), from.z()) > std::pair(to.y(), to.z());
  const Vec3& a = swapped ? to : from;
  const Vec3& b = swapped ? from : to;
  const double area = (b.y() - a.y()) * (z - a.z()) - (b.z() - a.z()) * (y - a.y());
  const double side = area >= 0.0 ? std::max(area, std::numeric_limits<double>::min()) : area;
  return swapped ? -side : side;
}

// A grid over the box of the body, and the crossings of its rays with the surface.
class Raster {
 public:
  Raster(const std::vector<Vec3>& vertices, const SurfaceMesh& surface,
         const std::array<int, 3>& count, int rows, int turn)
      : count_(count), rows_(rows), turn_(turn) {
    for (const auto& [a, b, c] : surface.triangles)
      cross(vertices[a], vertices[b], vertices[c]);
    std::sort(crossings_.begin(), crossings_.end(), [](const Crossing& one, const Crossing& other) {
      return std::tie(one.row, one.x, one.turn) < std::tie(other.row, other.x, other.turn);
    });
  }

  // Calls add(cell's place, box) for each piece of a row in a cell, by row, ascending in x.
  template <class Add>
  void forEachBox(const Add& add) const {
    forEachInterval(
        [&](std::size_t row, double from, double to, int) { addInterval(row, from, to, add); });
  }

  // Mean winding number of the surface about its inside: 1 if bodies do not overlap.
  double overlap() const {
    double length = 0.0;
    double wound = 0.0;
    forEachInterval([&](std::size_t, double from, double to, int winding) {
      length += to - from;
      wound += winding * (to - from);
    });
    return length > 0.0 ? wound / length : 1.0;
  }

 private:
  template <class Visit>
  void forEachInterval(const Visit& visit) const {
    int winding = 0;
    for (std::size_t index = 0; index + 1 < crossings_.size(); ++index) {
      const Crossing& at = crossings_[index];
      const Crossing& next = crossings_[index + 1];
      winding += at.turn;
      if (next.row != at.row)
        winding = 0;
      else if (winding > 0)
        visit(at.row, at.x, next.x, winding);
    }
  }

  std::size_t rowsAcross(int axis) const {
    const int rows = count_[static_cast<std::size_t>(axis)] * rows_;
    return static_cast<std::size_t>(rows);
  }
  double rowAt(std::size_t index) const {
    return (static_cast<double>(index) + 0.5 + kGridShift) / rows_;
  }
  // Range of rows whose rays may be between two coordinates, in cells.
  std::pair<std::size_t, std::size_t> rowsBetween(double low, double high, int axis) const {
    const auto bounded = [&](double at) {
      return static_cast<std::size_t>(std::clamp(at, 0.0, static_cast<double>(rowsAcross(axis))));
    };
    return {bounded(std::floor(low * rows_ - 0.5)), bounded(std::ceil(high * rows_ + 0.5))};
  }

  void cross(const Vec3& a, const Vec3& b, const Vec3& c) {
    const Vec3 normal = (b - a).cross(c - a);
    if (normal.x() == 0.0) return;
    const Vec3 low = a.cwiseMin(b).cwiseMin(c);
    const Vec3 high = a.cwiseMax(b).cwiseMax(c);
    const auto [firstY, lastY] = rowsBetween(low.y(), high.y(), 1);
    const auto [firstZ, lastZ] = rowsBetween(low.z(), high.z(), 2);
    const double way = normal.x() > 0.0 ? 1.0 : -1.0;
    for (std::size_t rowZ = firstZ; rowZ < lastZ; ++rowZ) {
      for (std::size_t rowY = firstY; rowY < lastY; ++rowY) {
        const double y = rowAt(rowY);
        const double z = rowAt(rowZ);
        if (way * sideOf(a, b, y, z) <= 0.0 || way * sideOf(b, c, y, z) <= 0.0 ||
            way * sideOf(c, a, y, z) <= 0.0)
          continue;
        const double x = a.x() - (normal.y() * (y - a.y()) + normal.z() * (z - a.z())) / normal.x();
        crossings_.push_back({rowZ * rowsAcross(1) + rowY, std::clamp(x, low.x(), high.x()),
                              normal.x() > 0.0 ? -turn_ : turn_});
      }
    }
  }

  template <class Add>
  void addInterval(std::size_t row, double from, double to, const Add& add) const {
    const auto rowY = static_cast<int>(row % rowsAcross(1));
    const auto rowZ = static_cast<int>(row / rowsAcross(1));
    const double step = 1.0 / rows_;
    CellBox box;
    box.low.tail<2>() << (rowY % rows_) * step, (rowZ % rows_) * step;
    box.high.tail<2>() << (rowY % rows_ + 1) * step, (rowZ % rows_ + 1) * step;
    const int first = std::clamp(static_cast<int>(std::floor(from)), 0, count_[0] - 1);
    for (int x = first; x < count_[0] && x < to; ++x) {
      box.low.x() = snapped(from - x);
      box.high.x() = snapped(to - x);
      if (box.high.x() > box.low.x()) add(std::array<int, 3>{x, rowY / rows_, rowZ / rows_}, box);
    }
  }
  static double snapped(double at) {
    if (at < kSnap) return 0.0;
    return at > 1.0 - kSnap ? 1.0 : at;
  }

  std::array<int, 3> count_;
  int rows_;
  int turn_;
  std::vector<Crossing> crossings_;
};

// ---- The grid

double volumeOf(const CellBox& box) {
  return (box.high - box.low).prod();
}

std::size_t indexOf(const std::array<int, 3>& count, const std::array<int, 3>& place) {
  return (static_cast<std::size_t>(place[2]) * static_cast<std::size_t>(count[1]) +
          static_cast<std::size_t>(place[1])) *
             static_cast<std::size_t>(count[0]) +
         static_cast<std::size_t>(place[0]);
}

std::size_t productOf(const std::array<int, 3>& count) {
  return static_cast<std::size_t>(count[0]) * static_cast<std::size_t>(count[1]) *
         static_cast<std::size_t>(count[2]);
}

std::array<int, 3> placeOf(const std::array<int, 3>& count, std::size_t index) {
  const auto x = static_cast<std::size_t>(count[0]);
  const auto y = static_cast<std::size_t>(count[1]);
  return {static_cast<int>(index % x), static_cast<int>(index / x % y),
          static_cast<int>(index / x / y)};
}

// Makes grids of one surface.
class Voxeliser {
 public:
  Voxeliser(const SurfaceMesh& surface, int rows)
      : surface_(surface),
        rows_(rows),
        volume_(std::abs(signedVolume(surface))),
        turn_(signedVolume(surface) > 0.0 ? 1 : -1),
        axes_(bestAxes(surface)),
        extent_(extentAlong(surface, axes_)) {}

  double volume() const { return volume_; }
  const Vec3& size() const { return extent_.size; }

  // Flat bodies get flat cells: bending and twisting vary most across the thin side.
  std::array<int, 3> countFor(double cellSize) const {
    std::array<int, 3> count;
    const double longest = extent_.size.maxCoeff();
    for (int axis = 0; axis < 3; ++axis) {
      const double length = extent_.size[axis];
      const double slender = std::pow(length / longest, kFlattening);
      const double edge = cellSize * std::max(slender, 1.0 / kFlattest);
      const double cells = std::max(1.0, std::round(length / edge));
      const bool split = cells < 2.0 && 0.5 * length * kFlattest >= cellSize;
      count[static_cast<std::size_t>(axis)] = split ? 2 : static_cast<int>(cells);
    }
    return count;
  }

  VoxelMesh grid(const std::array<int, 3>& count) const {
    VoxelMesh mesh;
    mesh.axes = axes_;
    mesh.origin = axes_ * extent_.low;
    mesh.count = count;
    for (int axis = 0; axis < 3; ++axis)
      mesh.cellSize[axis] = extent_.size[axis] / count[static_cast<std::size_t>(axis)];
    std::vector<Vec3> vertices = surface_.vertices;
    for (Vec3& vertex : vertices)
      vertex = (axes_.transpose() * vertex - extent_.low).cwiseQuotient(mesh.cellSize);
    fill(mesh, Raster(vertices, surface_, count, rows_, turn_));
    addNodes(mesh);
    return mesh;
  }

 private:
  void fill(VoxelMesh& mesh, const Raster& raster) const {
    mesh.volume = volume_ / raster.overlap();
    std::vector<double> inside(productOf(mesh.count), 0.0);
    std::vector<std::uint32_t> pieces(inside.size(), 0);
    raster.forEachBox([&](const std::array<int, 3>& place, const CellBox& box) {
      inside[indexOf(mesh.count, place)] += volumeOf(box);
      ++pieces[indexOf(mesh.count, place)];
    });
    mesh.cellAt.assign(inside.size(), -1);
    std::uint32_t boxes = 0;
    for (std::size_t index = 0; index < inside.size(); ++index) {
      if (inside[index] < kLeastInside) continue;
      const bool whole = inside[index] > 1.0 - kSnap;
      mesh.cellAt[index] = static_cast<std::int32_t>(mesh.cells.size());
      mesh.cells.push_back({placeOf(mesh.count, index), {}, boxes, whole ? 0 : pieces[index]});
      mesh.sampled += inside[index] * mesh.cellSize.prod();
      boxes += mesh.cells.back().boxCount;
    }
    mesh.boxes.resize(boxes);
    std::vector<std::uint32_t> used(mesh.cells.size(), 0);
    raster.forEachBox([&](const std::array<int, 3>& place, const CellBox& box) {
      const std::int32_t at = mesh.cellAt[indexOf(mesh.count, place)];
      if (at < 0) return;
      const auto cell = static_cast<std::size_t>(at);
      if (mesh.cells[cell].boxCount > 0) mesh.boxes[mesh.cells[cell].firstBox + used[cell]++] = box;
    });
  }

  static void addNodes(VoxelMesh& mesh) {
    const std::array<int, 3> corners = {mesh.count[0] + 1, mesh.count[1] + 1, mesh.count[2] + 1};
    constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
    std::vector<std::uint32_t> nodeAt(productOf(corners), kNone);
    const auto cornerOf = [&](const VoxelCell& cell, std::size_t corner) {
      const auto bit = [&](std::size_t axis) {
        return cell.place[axis] + static_cast<int>(corner >> axis & 1);
      };
      return indexOf(corners, {bit(0), bit(1), bit(2)});
    };
    for (const VoxelCell& cell : mesh.cells)
      for (std::size_t corner = 0; corner < 8; ++corner)
        nodeAt[cornerOf(cell, corner)] = 0;
    for (std::size_t index = 0; index < nodeAt.size(); ++index) {
      if (nodeAt[index] == kNone) continue;
      nodeAt[index] = static_cast<std::uint32_t>(mesh.nodes.size());
      const auto [x, y, z] = placeOf(corners, index);
      mesh.nodes.push_back(mesh.origin + mesh.axes * Vec3(x, y, z).cwiseProduct(mesh.cellSize));
    }
    for (VoxelCell& cell : mesh.cells)
      for (std::size_t corner = 0; corner < 8; ++corner)
        cell.nodes[corner] = nodeAt[cornerOf(cell, corner)];
  }

  const SurfaceMesh& surface_;
  int rows_;
  double volume_;
  int turn_;
  Eigen::Matrix3d axes_;
  Extent extent_;
};

// True if the inside part of the cell reaches its face at the near or far end of an axis.
bool reaches(const VoxelMesh& mesh, const VoxelCell& cell, Eigen::Index axis, bool far) {
  const auto boxes = std::span(mesh.boxes).subspan(cell.firstBox, cell.boxCount);
  return boxes.empty() || std::ranges::any_of(boxes, [&](const CellBox& box) {
           return far ? box.high[axis] >= 1.0 - kSnap : box.low[axis] <= kSnap;
         });
}

// Number of groups of cells that hang together by faces.
std::size_t piecesOf(const VoxelMesh& mesh) {
  std::vector<std::size_t> parent(mesh.cells.size());
  std::iota(parent.begin(), parent.end(), std::size_t{0});
  const auto root = [&](std::size_t cell) {
    while (parent[cell] != cell)
      cell = parent[cell] = parent[parent[cell]];
    return cell;
  };
  std::size_t pieces = mesh.cells.size();
  for (std::size_t cell = 0; cell < mesh.cells.size(); ++cell) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      std::array<int, 3> place = mesh.cells[cell].place;
      if (++place[axis] == mesh.count[axis]) continue;
      const std::int32_t next = mesh.cellAt[indexOf(mesh.count, place)];
      if (next < 0) continue;
      const auto along = static_cast<Eigen::Index>(axis);
      if (!reaches(mesh, mesh.cells[cell], along, true) ||
          !reaches(mesh, mesh.cells[static_cast<std::size_t>(next)], along, false))
        continue;
      const std::size_t one = root(cell);
      const std::size_t other = root(static_cast<std::size_t>(next));
      if (one == other) continue;
      parent[one] = other;
      --pieces;
    }
  }
  return pieces;
}

Status checkResolution(const VoxelMesh& mesh) {
  if (mesh.cells.empty()) return Error{"nothing of it is left"};
  if (const std::size_t pieces = piecesOf(mesh); pieces > 1)
    return Error{"it falls into " + std::to_string(pieces) + " pieces"};
  const double off = mesh.sampled / mesh.volume - 1.0;
  if (std::abs(off) > kVolumeOff)
    return Error{"its volume is off by " + std::to_string(std::lround(100.0 * off)) + " %"};
  return std::monostate{};
}

Status validate(const SurfaceMesh& surface, const VoxelSettings& settings) {
  for (const Vec3& vertex : surface.vertices)
    if (!vertex.allFinite()) return Error{"the surface has a vertex that is not finite"};
  for (const auto& triangle : surface.triangles)
    for (const std::uint32_t corner : triangle)
      if (corner >= surface.vertices.size())
        return Error{"the surface has a triangle of vertex " + std::to_string(corner) +
                     ", and there are " + std::to_string(surface.vertices.size())};
  if (!closedSurface(surface))
    return Error{
        "the surface is open; a solid needs a closed one, each edge shared by two triangles "
        "that turn the same way"};
  const double volume = std::abs(signedVolume(surface));
  if (!(volume > 1e-9 * std::pow(surfaceArea(surface), 1.5)))
    return Error{"the surface encloses no volume"};
  if (settings.cellSize && !(*settings.cellSize > 0.0 && std::isfinite(*settings.cellSize)))
    return Error{"the size of a cell must be positive (m)"};
  if (!settings.cellSize && settings.degreesOfFreedom < 24)
    return Error{std::to_string(settings.degreesOfFreedom) +
                 " degrees of freedom are too few; one cell has 24"};
  if (settings.rows < 1) return Error{"there must be at least 1 row of samples"};
  return std::monostate{};
}

std::size_t degreesOfFreedom(const VoxelMesh& mesh) {
  return 3 * mesh.nodes.size();
}

// Size of cell (m) of the finest grid within the degrees of freedom, by bisection in the logarithm
// of the size.
double sizeFor(const Voxeliser& voxeliser, std::size_t wanted) {
  double fine = std::cbrt(1.5 * voxeliser.volume() / static_cast<double>(wanted));
  double coarse = 4.0 * std::cbrt(3.0 * voxeliser.volume() / static_cast<double>(wanted));
  coarse = std::max(coarse, voxeliser.size().maxCoeff() / 2.0);
  for (int step = 0; step < 12; ++step) {
    const double middle = std::sqrt(fine * coarse);
    const std::array<int, 3> count = voxeliser.countFor(middle);
    // The whole box has no fewer nodes than the body.
    const std::size_t most = productOf({count[0] + 1, count[1] + 1, count[2] + 1});
    const bool fits = 3 * most <= wanted || (static_cast<double>(most) <= kMostCells &&
                                             degreesOfFreedom(voxeliser.grid(count)) <= wanted);
    (fits ? coarse : fine) = middle;
  }
  return coarse;
}

std::string metres(double size) {
  std::string text = std::to_string(1000.0 * size);
  text.resize(text.find('.') + 3);
  return text + " mm";
}

Error tooCoarse(const Voxeliser& voxeliser, double size, const std::string& why) {
  std::string message = "cells of " + metres(size) + " are too coarse for the body: " + why;
  double finer = size;
  for (int attempt = 0; attempt < kTries; ++attempt) {
    finer /= 1.25;
    const std::array<int, 3> count = voxeliser.countFor(finer);
    if (static_cast<double>(productOf(count)) > kMostCells) break;
    const VoxelMesh mesh = voxeliser.grid(count);
    if (checkResolution(mesh))
      return Error{message + "; cells of " + metres(finer) + " would do (" +
                   std::to_string(degreesOfFreedom(mesh)) + " degrees of freedom)"};
  }
  return Error{message +
               "; no size down to an eighth of it would do, so the surface may be of "
               "several bodies, or of walls too thin for a solid"};
}

// Squared distance outwards from the cell's faces to a point, in cells.
double outside(const VoxelCell& cell, const Vec3& at) {
  Vec3 away;
  for (int axis = 0; axis < 3; ++axis) {
    const double along = at[axis] - cell.place[static_cast<std::size_t>(axis)];
    away[axis] = std::max({0.0, -along, along - 1.0});
  }
  return away.squaredNorm();
}

std::size_t nearestCell(const VoxelMesh& mesh, const Vec3& at) {
  std::size_t nearest = 0;
  for (std::size_t cell = 1; cell < mesh.cells.size(); ++cell)
    if (outside(mesh.cells[cell], at) < outside(mesh.cells[nearest], at)) nearest = cell;
  return nearest;
}

}  // namespace

Result<VoxelMesh> voxelMesh(const SurfaceMesh& surface, const VoxelSettings& settings) {
  if (const Status valid = validate(surface, settings); !valid) return Error{valid.error().message};
  const Voxeliser voxeliser(surface, settings.rows);
  const double size =
      settings.cellSize ? *settings.cellSize : sizeFor(voxeliser, settings.degreesOfFreedom);
  const Vec3 across = voxeliser.size() / size;
  if (across.cwiseMax(1.0).prod() > kMostCells)
    return Error{"cells of " + metres(size) + " are too fine for the body: a grid of more than " +
                 std::to_string(std::lround(kMostCells)) + " cells"};
  VoxelMesh mesh = voxeliser.grid(voxeliser.countFor(size));
  if (const Status valid = checkResolution(mesh); !valid)
    return tooCoarse(voxeliser, size, valid.error().message);
  return mesh;
}

CellPoint locate(const VoxelMesh& mesh, const Vec3& point) {
  const Vec3 at = (mesh.axes.transpose() * (point - mesh.origin)).cwiseQuotient(mesh.cellSize);
  std::array<int, 3> place;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double cell = std::floor(at[static_cast<Eigen::Index>(axis)]);
    place[axis] = static_cast<int>(std::clamp(cell, 0.0, mesh.count[axis] - 1.0));
  }
  const std::int32_t found = mesh.cellAt[indexOf(mesh.count, place)];
  CellPoint result;
  result.cell = found >= 0 ? static_cast<std::size_t>(found) : nearestCell(mesh, at);
  for (std::size_t corner = 0; corner < 8; ++corner) {
    result.weights[corner] = 1.0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double along =
          at[static_cast<Eigen::Index>(axis)] - mesh.cells[result.cell].place[axis];
      result.weights[corner] *= (corner >> axis & 1) != 0 ? along : 1.0 - along;
    }
  }
  return result;
}

}  // namespace carom::modal
