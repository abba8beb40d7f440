#include "modal/analysis/spline_mesh.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>
#include <string>
#include <utility>

#include <Eigen/Eigenvalues>

#include "modal/analysis/overlap_raster.h"

namespace carom::modal {
namespace {

constexpr double kFrameGain = 0.001;     // least share of the box's volume that turning saves
constexpr std::size_t kFacesTried = 12;  // triangles whose own axes are tried
constexpr double kFlattest = 5.0;
constexpr double kFlattening = 0.25;   // cells' edges go by this power of the body's
constexpr double kLeastInside = 1e-8;  // share of a cell; with less inside, it is left out
constexpr double kWhole = 1.0 - 1e-9;  // share of a cell; with more inside, it is whole
constexpr double kLeastFace = 1e-6;    // share of a face through which cells hang together
constexpr double kFill = 1e-9;         // stiffness and density outside, over those inside
constexpr double kOverlapping = 1e-4;  // of the mean winding, beyond 1
constexpr double kMostCells = 4e6;     // cells in the grid's box, inside or not
constexpr std::size_t kFewestFreedom = std::size_t{3} * kCellFunctions;  // degrees of freedom
constexpr std::size_t kUsualGrid = 6000;
constexpr int kReach = 3;  // cells before its own place that a function begins

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

// ---- The grid

std::size_t productOf(const std::array<int, 3>& count) {
  return indexOf(count, {0, 0, count[2]});
}

std::array<int, 3> placeOf(const std::array<int, 3>& count, std::size_t index) {
  const auto x = static_cast<std::size_t>(count[0]);
  const auto y = static_cast<std::size_t>(count[1]);
  return {static_cast<int>(index % x), static_cast<int>(index / x % y),
          static_cast<int>(index / x / y)};
}

// Functions along each axis.
std::array<int, 3> functionsOf(const std::array<int, 3>& count) {
  return {count[0] + kReach, count[1] + kReach, count[2] + kReach};
}

// The place of one of a cell's functions among all of the grid.
std::array<int, 3> functionAt(const std::array<int, 3>& cell, std::size_t function) {
  return {cell[0] + static_cast<int>(function % 4), cell[1] + static_cast<int>(function / 4 % 4),
          cell[2] + static_cast<int>(function / 16)};
}

// Joins cells that are neighbours in a list, and counts the groups.
class Groups {
 public:
  explicit Groups(std::size_t size) : parent_(size), count_(size) {
    std::iota(parent_.begin(), parent_.end(), std::size_t{0});
  }
  std::size_t rootOf(std::size_t member) {
    while (parent_[member] != member)
      member = parent_[member] = parent_[parent_[member]];
    return member;
  }
  void join(std::size_t one, std::size_t other) {
    one = rootOf(one);
    other = rootOf(other);
    if (one == other) return;
    parent_[std::max(one, other)] = std::min(one, other);
    --count_;
  }
  std::size_t count() const { return count_; }

 private:
  std::vector<std::size_t> parent_;
  std::size_t count_;
};

// Calls join(index of the cell before) for each cell that a cell hangs together with at its near
// faces.
template <class Join>
void eachJoined(const SplineMesh& mesh, const GridFilling& filling, const SplineCell& cell,
                const Join& join) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::array<int, 3> place = cell.place;
    if (filling.nearFace[axis][indexOf(mesh.count, place)] < kLeastFace) continue;
    if (--place[axis] < 0) continue;
    const std::int32_t before = mesh.cellAt[indexOf(mesh.count, place)];
    if (before >= 0) join(static_cast<std::uint32_t>(before));
  }
}

// Number of groups of cells that hang together by faces.
std::size_t piecesOf(const SplineMesh& mesh, const GridFilling& filling) {
  Groups groups(mesh.cells.size());
  for (std::size_t cell = 0; cell < mesh.cells.size(); ++cell)
    eachJoined(mesh, filling, mesh.cells[cell],
               [&](std::uint32_t before) { groups.join(cell, before); });
  return groups.count();
}

// Makes grids of one surface.
class SplineGridder {
 public:
  explicit SplineGridder(const SurfaceMesh& surface)
      : surface_(surface), axes_(bestAxes(surface)), extent_(extentAlong(surface, axes_)) {
    isInsideOut_ = signedVolume(surface) < 0.0;
    overlaps_ = meanWinding(placed(countFor(extent_.size.maxCoeff() / 8.0))) > 1.0 + kOverlapping;
  }

  const Vec3& size() const { return extent_.size; }

  // Flat bodies get flat cells: bending and twisting vary most across the thin side.
  std::array<int, 3> countFor(double cellSize) const {
    std::array<int, 3> count;
    const double longest = extent_.size.maxCoeff();
    for (int axis = 0; axis < 3; ++axis) {
      const double length = extent_.size[axis];
      const double slender = std::pow(length / longest, kFlattening);
      const double edge = cellSize * std::max(slender, 1.0 / kFlattest);
      count[static_cast<std::size_t>(axis)] =
          static_cast<int>(std::max(1.0, std::round(length / edge)));
    }
    return count;
  }

  // Number of functions that such a grid has, those that are split counted once.
  std::size_t functionsFor(const std::array<int, 3>& count) const {
    const GridFilling filling = fill(placed(count));
    const std::array<int, 3> functions = functionsOf(count);
    std::vector<bool> used(productOf(functions), false);
    for (std::size_t index = 0; index < filling.fraction.size(); ++index) {
      if (filling.fraction[index] < kLeastInside) continue;
      for (std::size_t function = 0; function < kCellFunctions; ++function)
        used[indexOf(functions, functionAt(placeOf(count, index), function))] = true;
    }
    return static_cast<std::size_t>(std::count(used.begin(), used.end(), true));
  }

  // Error: several bodies that do not touch.
  Result<SplineMesh> grid(const std::array<int, 3>& count) const {
    SplineMesh mesh;
    mesh.axes = axes_;
    mesh.origin = axes_ * extent_.low;
    mesh.count = count;
    for (int axis = 0; axis < 3; ++axis)
      mesh.cellSize[axis] = extent_.size[axis] / count[static_cast<std::size_t>(axis)];
    const GridSurface surface = placed(count);
    const GridFilling filling = fill(surface);
    addCells(mesh, surface, filling);
    if (const std::size_t pieces = piecesOf(mesh, filling); pieces != 1)
      return Error{"the surface is of " + std::to_string(pieces) +
                   " bodies that do not touch; expected one body"};
    addNodes(mesh, filling);
    return mesh;
  }

 private:
  GridFilling fill(const GridSurface& surface) const {
    return overlaps_ ? unionFilling(surface) : fillingOf(surface);
  }

  // The surface in cells, its triangles seen from outside.
  GridSurface placed(const std::array<int, 3>& count) const {
    const Vec3 cells(count[0], count[1], count[2]);
    const Vec3 scale = cells.cwiseQuotient(extent_.size);
    GridSurface placed;
    placed.count = count;
    placed.triangles.reserve(surface_.triangles.size());
    const auto at = [&](std::uint32_t vertex) -> Vec3 {
      const Vec3 inFrame = axes_.transpose() * surface_.vertices[vertex] - extent_.low;
      return inFrame.cwiseProduct(scale).cwiseMax(0.0).cwiseMin(cells);
    };
    for (const auto& [a, b, c] : surface_.triangles)
      placed.triangles.push_back({at(a), at(isInsideOut_ ? c : b), at(isInsideOut_ ? b : c)});
    return placed;
  }

  void addCells(SplineMesh& mesh, const GridSurface& surface, const GridFilling& filling) const {
    mesh.cellAt.assign(filling.fraction.size(), -1);
    std::vector<std::int32_t> cut(filling.fraction.size(), -1);
    std::int32_t cuts = 0;
    for (std::size_t index = 0; index < filling.fraction.size(); ++index) {
      const double inside = filling.fraction[index];
      if (inside < kLeastInside) continue;
      if (inside < kWhole) cut[index] = cuts++;
      mesh.cellAt[index] = static_cast<std::int32_t>(mesh.cells.size());
      mesh.cells.push_back({.place = placeOf(mesh.count, index), .moments = cut[index]});
      mesh.volume += inside * mesh.cellSize.prod();
    }
    const auto number = static_cast<std::size_t>(cuts);
    mesh.moments = overlaps_ ? unionMoments(surface, cut, number) : momentsOf(surface, cut, number);
    const CellMoments whole = momentsOf(-Vec3::Ones(), Vec3::Ones());
    for (CellMoments& moments : mesh.moments)
      for (std::size_t index = 0; index < moments.size(); ++index)
        moments[index] += kFill * (whole[index] - moments[index]);
  }

  // Gives each function a node, and one more for each further group of cells under it.
  static void addNodes(SplineMesh& mesh, const GridFilling& filling) {
    const std::array<int, 3> functions = functionsOf(mesh.count);
    std::vector<std::size_t> order(productOf(functions) + 1, 0);
    for (const SplineCell& cell : mesh.cells)
      for (std::size_t function = 0; function < kCellFunctions; ++function)
        ++order[indexOf(functions, functionAt(cell.place, function)) + 1];
    std::partial_sum(order.begin(), order.end(), order.begin());
    struct Under {
      std::uint32_t cell, function;
    };
    std::vector<Under> under(order.back());
    std::vector<std::size_t> next(order.begin(), order.end() - 1);
    for (std::uint32_t cell = 0; cell < mesh.cells.size(); ++cell)
      for (std::uint32_t function = 0; function < kCellFunctions; ++function)
        under[next[indexOf(functions, functionAt(mesh.cells[cell].place, function))]++] = {
            cell, function};
    for (std::size_t function = 0; function + 1 < order.size(); ++function) {
      const auto covered =
          std::span(under).subspan(order[function], order[function + 1] - order[function]);
      if (covered.empty()) continue;
      std::array<std::uint32_t, kCellFunctions> cells{};
      for (std::size_t index = 0; index < covered.size(); ++index)
        cells[index] = covered[index].cell;
      const std::array<int, 3> place = placeOf(functions, function);
      const Vec3 middle(place[0] - 1.0, place[1] - 1.0, place[2] - 1.0);
      const std::array<std::size_t, kCellFunctions> group =
          groupsOf(mesh, filling, std::span(cells).first(covered.size()));
      const auto first = static_cast<std::uint32_t>(mesh.nodes.size());
      for (std::size_t index = 0; index < covered.size(); ++index) {
        const auto node = static_cast<std::uint32_t>(first + group[index]);
        mesh.cells[covered[index].cell].nodes[covered[index].function] = node;
        if (node == mesh.nodes.size())
          mesh.nodes.emplace_back(mesh.origin + mesh.axes * middle.cwiseProduct(mesh.cellSize));
      }
    }
  }

  // Numbers the groups of some cells that hang together by faces, in the order of their first
  // cells.
  static std::array<std::size_t, kCellFunctions> groupsOf(const SplineMesh& mesh,
                                                          const GridFilling& filling,
                                                          std::span<const std::uint32_t> cells) {
    Groups groups(cells.size());
    for (std::size_t one = 0; one < cells.size(); ++one)
      eachJoined(mesh, filling, mesh.cells[cells[one]], [&](std::uint32_t before) {
        const auto found = std::ranges::lower_bound(cells, before);
        if (found != cells.end() && *found == before)
          groups.join(one, static_cast<std::size_t>(found - cells.begin()));
      });
    std::array<std::size_t, kCellFunctions> numbers{};
    std::size_t count = 0;
    for (std::size_t index = 0; index < cells.size(); ++index) {
      const std::size_t root = groups.rootOf(index);
      numbers[index] = root == index ? count++ : numbers[root];
    }
    return numbers;
  }

  const SurfaceMesh& surface_;
  Eigen::Matrix3d axes_;
  Extent extent_;
  bool isInsideOut_ = false;
  bool overlaps_ = false;
};

Status validate(const SurfaceMesh& surface, const GridSettings& settings) {
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
  if (!settings.cellSize && settings.degreesOfFreedom.value_or(kUsualGrid) < kFewestFreedom)
    return Error{std::to_string(*settings.degreesOfFreedom) +
                 " degrees of freedom are too few; one cell has " + std::to_string(kFewestFreedom)};
  return std::monostate{};
}

// Size of cell (m) of the finest grid within the degrees of freedom, by bisection in the logarithm
// of the size.
double sizeFor(const SplineGridder& gridder, std::size_t wanted) {
  double coarse = 2.0 * gridder.size().maxCoeff();
  double fine = coarse / 256.0;
  for (int step = 0; step < 10; ++step) {
    const double middle = std::sqrt(fine * coarse);
    const std::array<int, 3> count = gridder.countFor(middle);
    const bool fits = 3 * productOf(functionsOf(count)) <= wanted ||
                      (static_cast<double>(productOf(count)) <= kMostCells &&
                       3 * gridder.functionsFor(count) <= wanted);
    (fits ? coarse : fine) = middle;
  }
  return coarse;
}

std::string metres(double size) {
  std::string text = std::to_string(1000.0 * size);
  text.resize(text.find('.') + 3);
  return text + " mm";
}

// Squared distance outwards from the cell's faces to a point, in cells.
double outside(const SplineCell& cell, const Vec3& at) {
  Vec3 away;
  for (int axis = 0; axis < 3; ++axis) {
    const double along = at[axis] - cell.place[static_cast<std::size_t>(axis)];
    away[axis] = std::max({0.0, -along, along - 1.0});
  }
  return away.squaredNorm();
}

std::size_t nearestCell(const SplineMesh& mesh, const Vec3& at) {
  std::size_t nearest = 0;
  for (std::size_t cell = 1; cell < mesh.cells.size(); ++cell)
    if (outside(mesh.cells[cell], at) < outside(mesh.cells[nearest], at)) nearest = cell;
  return nearest;
}

}  // namespace

Result<SplineMesh> splineMesh(const SurfaceMesh& surface, const GridSettings& settings) {
  if (const Status valid = validate(surface, settings); !valid) return Error{valid.error().message};
  const SplineGridder gridder(surface);
  const double size = settings.cellSize
                          ? *settings.cellSize
                          : sizeFor(gridder, settings.degreesOfFreedom.value_or(kUsualGrid));
  const Vec3 across = gridder.size() / size;
  if (across.cwiseMax(1.0).prod() > kMostCells)
    return Error{"cells of " + metres(size) + " are too fine for the body: a grid of more than " +
                 std::to_string(std::lround(kMostCells)) + " cells"};
  return gridder.grid(gridder.countFor(size));
}

CellPoint locate(const SplineMesh& mesh, const Vec3& point) {
  const Vec3 at = (mesh.axes.transpose() * (point - mesh.origin)).cwiseQuotient(mesh.cellSize);
  std::array<int, 3> place;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double cell = std::floor(at[static_cast<Eigen::Index>(axis)]);
    place[axis] = static_cast<int>(std::clamp(cell, 0.0, mesh.count[axis] - 1.0));
  }
  const std::int32_t found = mesh.cellAt[indexOf(mesh.count, place)];
  CellPoint result;
  result.cell = found >= 0 ? static_cast<std::size_t>(found) : nearestCell(mesh, at);
  std::array<Eigen::Vector4d, 3> along;
  for (std::size_t axis = 0; axis < 3; ++axis)
    along[axis] =
        splinesAt(at[static_cast<Eigen::Index>(axis)] - mesh.cells[result.cell].place[axis]);
  for (std::size_t function = 0; function < kCellFunctions; ++function)
    result.weights[function] = along[0][static_cast<Eigen::Index>(function % 4)] *
                               along[1][static_cast<Eigen::Index>(function / 4 % 4)] *
                               along[2][static_cast<Eigen::Index>(function / 16)];
  return result;
}

}  // namespace carom::modal
