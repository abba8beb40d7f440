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
#include "modal/mesh/mesh_edges.h"

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
constexpr double kLeastCells = 0.35;    // of the body: the largest cells with smaller ones beside
constexpr double kFinest = 1.0 / 32.0;  // size of cells beside an inner edge, of the others
constexpr double kFineAnyway = 0.25;    // the same, beside thick walls
constexpr double kClosestLines = 0.02;  // of a cell: planes that are closer to others do not count
constexpr double kAlignedCosine = 1.0 - 1e-9;  // of a normal to the axis
constexpr double kSamePlane = 1e-4;   // distance of planes that are one, of the body's size
constexpr double kOnPlane = 1e-6;     // distance from it, of the body's size
constexpr double kLeastEdges = 0.03;  // m of edges in a plane, of the body's size
constexpr double kOpenStep = 0.5;     // of the smallest cell, along an edge that is looked up

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

using GridAxes = std::array<GridAxis, 3>;

std::array<int, 3> countOf(const GridAxes& along) {
  return {along[0].cells(), along[1].cells(), along[2].cells()};
}

// Functions along each axis.
std::array<int, 3> functionsOf(const GridAxes& along) {
  return {along[0].functions(), along[1].functions(), along[2].functions()};
}

// The place of one of a cell's functions among all of the grid.
std::array<int, 3> functionAt(const GridAxes& along, const std::array<int, 3>& cell,
                              std::size_t function) {
  return {along[0][cell[0]].first + static_cast<int>(function % 4),
          along[1][cell[1]].first + static_cast<int>(function / 4 % 4),
          along[2][cell[2]].first + static_cast<int>(function / 16)};
}

// ---- Cells that are smaller beside inner edges

struct Plane {
  double at = 0.0;      // m along an axis
  double length = 0.0;  // m, of the edges in it
};

// Cells between two lines, as large as h at most, and growing from a size at each end by their
// distance from it: places in m, by the number of cells from the lower end on.
class GrowingCells {
 public:
  GrowingCells(double width, double h, double first, double last)
      : width_(width), h_(h), first_(first), last_(last) {
    low_ = std::clamp(std::min(h - first, 0.5 * (width + last - first)), 0.0, width);
    high_ = std::clamp(std::min(h - last, 0.5 * (width + first - last)), 0.0, width - low_);
    fromLow_ = std::log1p(low_ / first);
    fromHigh_ = std::log1p(high_ / last);
  }
  double count() const { return fromLow_ + (width_ - low_ - high_) / h_ + fromHigh_; }
  double placeOf(double cells) const {
    if (cells < fromLow_) return first_ * std::expm1(cells);
    const double left = count() - cells;
    if (left < fromHigh_) return width_ - last_ * std::expm1(left);
    return low_ + (cells - fromLow_) * h_;
  }

 private:
  double width_;
  double h_;
  double first_;
  double last_;
  double low_ = 0.0;      // m, in which they grow from the lower end
  double high_ = 0.0;     // m, in which they do from the other one
  double fromLow_ = 0.0;  // cells there
  double fromHigh_ = 0.0;
};

// Returns the lines of cells of about size h, which get smaller towards a plane and have a line on
// it: there they are as large as a wall is thick that the plane is one face of, or smaller.
std::vector<AxisLine> linesBetween(double length, double h, const std::vector<Plane>& planes) {
  std::vector<double> ends = {0.0};
  for (const Plane& plane : planes)
    if (plane.at - ends.back() > kClosestLines * h && length - plane.at > kClosestLines * h)
      ends.push_back(plane.at);
  ends.push_back(length);
  // Sizes of the cells beside an end.
  const auto finestAt = [&](std::size_t end) {
    if (end == 0 || end + 1 == ends.size()) return h;
    const double wall = std::min(ends[end] - ends[end - 1], ends[end + 1] - ends[end]);
    return std::clamp(wall, kFinest * h, kFineAnyway * h);
  };
  std::vector<AxisLine> lines = {{.at = 0.0}};
  for (std::size_t end = 1; end < ends.size(); ++end) {
    const GrowingCells cells(ends[end] - ends[end - 1], h, finestAt(end - 1), finestAt(end));
    const int count = std::max(1, static_cast<int>(std::lround(cells.count())));
    for (int line = 1; line < count; ++line)
      lines.push_back({.at = ends[end - 1] + cells.placeOf(cells.count() * line / count)});
    lines.push_back({.at = ends[end], .kinks = end + 1 < ends.size()});
  }
  return lines;
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
    overlaps_ = meanWinding(placed(axesFor(extent_.size.maxCoeff() / 8.0))) > 1.0 + kOverlapping;
    findPlanes();
  }

  const Vec3& size() const { return extent_.size; }

  // Gives up the smaller cells beside inner edges, and the lines on them.
  void takeEqualCells() {
    openEdges_ = innerEdges_;
    open_.insert(open_.end(), fitted_.begin(), fitted_.end());
    fitted_.clear();
    planes_ = {};
  }
  bool hasEqualCells() const {
    return std::ranges::all_of(planes_, [](const auto& one) { return one.empty(); });
  }

  // Flat bodies get flat cells: bending and twisting vary most across the thin side.
  GridAxes axesFor(double cellSize) const {
    GridAxes along;
    const double longest = extent_.size.maxCoeff();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double length = extent_.size[static_cast<Eigen::Index>(axis)];
      const double slender = std::pow(length / longest, kFlattening);
      const double edge = cellSize * std::max(slender, 1.0 / kFlattest);
      const double cells = std::max(1.0, std::round(length / edge));
      along[axis] = planes_[axis].empty()
                        ? GridAxis::equal(length, static_cast<int>(cells))
                        : GridAxis(linesBetween(length, length / cells, planes_[axis]));
    }
    return along;
  }

  // Number of functions that such a grid has, those that are split counted once.
  std::size_t functionsFor(const GridAxes& along) const {
    const GridFilling filling = fill(placed(along));
    const std::array<int, 3> count = countOf(along);
    const std::array<int, 3> functions = functionsOf(along);
    std::vector<bool> used(productOf(functions), false);
    for (std::size_t index = 0; index < filling.fraction.size(); ++index) {
      if (filling.fraction[index] < kLeastInside) continue;
      for (std::size_t function = 0; function < kCellFunctions; ++function)
        used[indexOf(functions, functionAt(along, placeOf(count, index), function))] = true;
    }
    return static_cast<std::size_t>(std::count(used.begin(), used.end(), true));
  }

  // Error: several bodies that do not touch.
  Result<SplineMesh> grid(const GridAxes& along) const {
    SplineMesh mesh;
    mesh.axes = axes_;
    mesh.origin = axes_ * extent_.low;
    mesh.along = along;
    mesh.count = countOf(along);
    mesh.innerEdges = innerEdges_;
    mesh.openEdges = openEdges_;
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (int cell = 0; cell < mesh.count[axis]; ++cell)
        mesh.cellSize[static_cast<Eigen::Index>(axis)] =
            std::max(mesh.cellSize[static_cast<Eigen::Index>(axis)], along[axis][cell].size);
    const GridSurface surface = placed(along);
    const GridFilling filling = fill(surface);
    addCells(mesh, surface, filling);
    if (const std::size_t pieces = piecesOf(mesh, filling); pieces != 1)
      return Error{"the surface is of " + std::to_string(pieces) +
                   " bodies that do not touch; expected one body"};
    addNodes(mesh, filling);
    addOpenCells(mesh);
    return mesh;
  }

 private:
  GridFilling fill(const GridSurface& surface) const {
    return overlaps_ ? unionFilling(surface) : fillingOf(surface);
  }

  // Finds the planes across the grid's axes on which one side of a sharp inner edge lies.
  void findPlanes() {
    SurfaceMesh outwards = surface_;
    if (isInsideOut_)
      for (auto& [a, b, c] : outwards.triangles)
        std::swap(b, c);
    for (const InnerEdge& edge : sharpInnerEdges(outwards)) {
      const double length = edge.length();
      bool isFitted = true;
      for (const Vec3& normal : edge.normals) {
        const Vec3 turned = axes_.transpose() * normal;
        Eigen::Index along = 0;
        if (turned.cwiseAbs().maxCoeff(&along) < kAlignedCosine) {
          isFitted = false;
          continue;
        }
        planes_[static_cast<std::size_t>(along)].push_back(
            {(axes_.transpose() * edge.from)[along] - extent_.low[along], length});
      }
      innerEdges_ += length;
      if (!isFitted) openEdges_ += length;
      (isFitted ? fitted_ : open_).push_back(edge);
    }
    if (overlaps_) return takeEqualCells();
    for (std::vector<Plane>& planes : planes_) {
      std::ranges::sort(planes, {}, &Plane::at);
      std::vector<Plane> joined;
      for (const Plane& plane : planes) {
        if (!joined.empty() && plane.at - joined.back().at < kSamePlane * extent_.size.maxCoeff())
          joined.back().length += plane.length;
        else
          joined.push_back(plane);
      }
      std::erase_if(joined, [this](const Plane& plane) {
        const bool isShort = plane.length < kLeastEdges * extent_.size.maxCoeff();
        if (isShort) openEdges_ += plane.length;
        return isShort;
      });
      planes = std::move(joined);
    }
  }

  void addOpenCells(SplineMesh& mesh) const {
    double smallest = std::numeric_limits<double>::infinity();
    for (const GridAxis& axis : mesh.along)
      for (int cell = 0; cell < axis.cells(); ++cell)
        smallest = std::min(smallest, axis[cell].size);
    for (const InnerEdge& edge : open_) {
      const double parts = std::ceil(edge.length() / (kOpenStep * smallest));
      for (double part = 0.0; part < parts; ++part) {
        const Vec3 place = edge.from + (part + 0.5) / parts * (edge.to - edge.from);
        mesh.openCells.push_back(static_cast<std::uint32_t>(locate(mesh, place).cell));
      }
    }
    std::ranges::sort(mesh.openCells);
    mesh.openCells.erase(std::unique(mesh.openCells.begin(), mesh.openCells.end()),
                         mesh.openCells.end());
  }

  // The surface on a grid, its triangles seen from outside: in cells, where all are equal.
  GridSurface placed(const GridAxes& along) const {
    GridSurface placed;
    placed.count = countOf(along);
    const bool areEqual = hasEqualCells();
    Vec3 cells = extent_.size;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (areEqual) {
        cells[static_cast<Eigen::Index>(axis)] = placed.count[axis];
        continue;
      }
      for (int cell = 0; cell < placed.count[axis]; ++cell)
        placed.lines[axis].push_back(along[axis][cell].begin);
      placed.lines[axis].push_back(extent_.size[static_cast<Eigen::Index>(axis)]);
    }
    const Vec3 scale = cells.cwiseQuotient(extent_.size);
    // Coordinates of single precision are not quite on the planes that they are meant to be on.
    const double near = areEqual ? 0.0 : kOnPlane * extent_.size.maxCoeff();
    const auto snapped = [&](double place, std::size_t axis) {
      const double length = extent_.size[static_cast<Eigen::Index>(axis)];
      for (const double end : {0.0, length})
        if (std::abs(place - end) < near) return end;
      for (const Plane& plane : planes_[axis])
        if (std::abs(place - plane.at) < near) return plane.at;
      return place;
    };
    placed.triangles.reserve(surface_.triangles.size());
    const auto at = [&](std::uint32_t vertex) -> Vec3 {
      Vec3 inFrame = axes_.transpose() * surface_.vertices[vertex] - extent_.low;
      for (std::size_t axis = 0; axis < 3 && !areEqual; ++axis)
        inFrame[static_cast<Eigen::Index>(axis)] =
            snapped(inFrame[static_cast<Eigen::Index>(axis)], axis);
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
      const CellAxes sides = sidesOf(mesh, mesh.cells.back());
      mesh.volume += inside * sides[0]->size * sides[1]->size * sides[2]->size;
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
    const std::array<int, 3> functions = functionsOf(mesh.along);
    std::vector<std::size_t> order(productOf(functions) + 1, 0);
    for (const SplineCell& cell : mesh.cells)
      for (std::size_t function = 0; function < kCellFunctions; ++function)
        ++order[indexOf(functions, functionAt(mesh.along, cell.place, function)) + 1];
    std::partial_sum(order.begin(), order.end(), order.begin());
    struct Under {
      std::uint32_t cell, function;
    };
    std::vector<Under> under(order.back());
    std::vector<std::size_t> next(order.begin(), order.end() - 1);
    for (std::uint32_t cell = 0; cell < mesh.cells.size(); ++cell)
      for (std::uint32_t function = 0; function < kCellFunctions; ++function)
        under[next[indexOf(functions, functionAt(mesh.along, mesh.cells[cell].place,
                                                 function))]++] = {cell, function};
    for (std::size_t function = 0; function + 1 < order.size(); ++function) {
      const auto covered =
          std::span(under).subspan(order[function], order[function + 1] - order[function]);
      if (covered.empty()) continue;
      std::array<std::uint32_t, kCellFunctions> cells{};
      for (std::size_t index = 0; index < covered.size(); ++index)
        cells[index] = covered[index].cell;
      const std::array<int, 3> place = placeOf(functions, function);
      const Vec3 middle(mesh.along[0].middle(place[0]), mesh.along[1].middle(place[1]),
                        mesh.along[2].middle(place[2]));
      const std::array<std::size_t, kCellFunctions> group =
          groupsOf(mesh, filling, std::span(cells).first(covered.size()));
      const auto first = static_cast<std::uint32_t>(mesh.nodes.size());
      for (std::size_t index = 0; index < covered.size(); ++index) {
        const auto node = static_cast<std::uint32_t>(first + group[index]);
        mesh.cells[covered[index].cell].nodes[covered[index].function] = node;
        if (node < mesh.nodes.size()) continue;
        mesh.nodes.emplace_back(mesh.origin + mesh.axes * middle);
        mesh.functions.push_back(place);
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
  std::array<std::vector<Plane>, 3> planes_;  // by axis, ascending
  double innerEdges_ = 0.0;                   // m, sharp ones
  double openEdges_ = 0.0;                    // m: SplineMesh::openEdges
  std::vector<InnerEdge> open_;               // those edges
  std::vector<InnerEdge> fitted_;             // the others
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
// of the size. Cells beside inner edges are not smaller if that takes too many even so.
double sizeFor(SplineGridder& gridder, std::size_t wanted) {
  const auto fits = [&](double size) {
    const GridAxes along = gridder.axesFor(size);
    return 3 * productOf(functionsOf(along)) <= wanted ||
           (static_cast<double>(productOf(countOf(along))) <= kMostCells &&
            3 * gridder.functionsFor(along) <= wanted);
  };
  double coarse = 2.0 * gridder.size().maxCoeff();
  double fine = coarse / 256.0;
  if (!gridder.hasEqualCells() && !fits(kLeastCells * gridder.size().maxCoeff()))
    gridder.takeEqualCells();
  for (int step = 0; step < 10; ++step) {
    const double middle = std::sqrt(fine * coarse);
    (fits(middle) ? coarse : fine) = middle;
  }
  return coarse;
}

std::string metres(double size) {
  std::string text = std::to_string(1000.0 * size);
  text.resize(text.find('.') + 3);
  return text + " mm";
}

// Squared distance outwards from the cell's faces to a point, in the largest cells.
double outside(const SplineMesh& mesh, const SplineCell& cell, const Vec3& at) {
  const CellAxes sides = sidesOf(mesh, cell);
  Vec3 away;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto index = static_cast<Eigen::Index>(axis);
    const double along = at[index] - sides[axis]->begin;
    away[index] = std::max({0.0, -along, along - sides[axis]->size}) / mesh.cellSize[index];
  }
  return away.squaredNorm();
}

std::size_t nearestCell(const SplineMesh& mesh, const Vec3& at) {
  std::size_t nearest = 0;
  for (std::size_t cell = 1; cell < mesh.cells.size(); ++cell)
    if (outside(mesh, mesh.cells[cell], at) < outside(mesh, mesh.cells[nearest], at))
      nearest = cell;
  return nearest;
}

}  // namespace

Result<SplineMesh> splineMesh(const SurfaceMesh& surface, const GridSettings& settings) {
  if (const Status valid = validate(surface, settings); !valid) return Error{valid.error().message};
  SplineGridder gridder(surface);
  const double size = settings.cellSize
                          ? *settings.cellSize
                          : sizeFor(gridder, settings.degreesOfFreedom.value_or(kUsualGrid));
  const Vec3 across = gridder.size() / size;
  if (across.cwiseMax(1.0).prod() > kMostCells)
    return Error{"cells of " + metres(size) + " are too fine for the body: a grid of more than " +
                 std::to_string(std::lround(kMostCells)) + " cells"};
  if (static_cast<double>(productOf(countOf(gridder.axesFor(size)))) > kMostCells)
    gridder.takeEqualCells();
  return gridder.grid(gridder.axesFor(size));
}

CellPoint locate(const SplineMesh& mesh, const Vec3& point) {
  const Vec3 at = mesh.axes.transpose() * (point - mesh.origin);
  std::array<int, 3> place;
  for (std::size_t axis = 0; axis < 3; ++axis)
    place[axis] = mesh.along[axis].cellAt(at[static_cast<Eigen::Index>(axis)]);
  const std::int32_t found = mesh.cellAt[indexOf(mesh.count, place)];
  CellPoint result;
  result.cell = found >= 0 ? static_cast<std::size_t>(found) : nearestCell(mesh, at);
  std::array<Eigen::Vector4d, 3> along;
  const CellAxes sides = sidesOf(mesh, mesh.cells[result.cell]);
  for (std::size_t axis = 0; axis < 3; ++axis)
    along[axis] = sides[axis]->at((at[static_cast<Eigen::Index>(axis)] - sides[axis]->begin) /
                                  sides[axis]->size);
  for (std::size_t function = 0; function < kCellFunctions; ++function)
    result.weights[function] = along[0][static_cast<Eigen::Index>(function % 4)] *
                               along[1][static_cast<Eigen::Index>(function / 4 % 4)] *
                               along[2][static_cast<Eigen::Index>(function / 16)];
  return result;
}

}  // namespace carom::modal
