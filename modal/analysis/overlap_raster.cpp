#include "modal/analysis/overlap_raster.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

namespace carom::modal {
namespace {

constexpr int kRows = 8;         // of rays across a cell, each way
constexpr int kFewestRays = 60;  // across the body, where windings are counted
constexpr double kSnap = 1e-9;   // share of a cell; surfaces nearer to a face lie on it
// Shift of the rays, in rows, so that they pass beside the vertices and edges of grids and boxes.
constexpr double kGridShift = 1.37e-6;

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

// A part of a cell, from 0 to 1 along each of its edges.
struct CellBox {
  Vec3 low = Vec3::Zero();
  Vec3 high = Vec3::Ones();
};

// A grid over the box of the body, and the crossings of its rays with the surface.
class Raster {
 public:
  Raster(const GridSurface& surface, int rows) : count_(surface.count), rows_(rows) {
    for (const auto& [a, b, c] : surface.triangles)
      cross(a, b, c);
    std::sort(crossings_.begin(), crossings_.end(), [](const Crossing& one, const Crossing& other) {
      return std::tie(one.row, one.x, one.turn) < std::tie(other.row, other.x, other.turn);
    });
  }

  // Calls add(cell's place, box, winding) for each piece of a row in a cell, by row, ascending in
  // x.
  template <class Add>
  void forEachBox(const Add& add) const {
    forEachInterval([&](std::size_t row, double from, double to, int winding) {
      addInterval(row, from, to, [&](const std::array<int, 3>& place, const CellBox& box) {
        add(place, box, winding);
      });
    });
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
                              normal.x() > 0.0 ? -1 : 1});
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
  std::vector<Crossing> crossings_;
};

// Sums over the pieces of the rows: each piece once, and as often as the surface winds about it
// beyond once.
template <class Sums>
struct Wound {
  Sums once;
  Sums beyond;
};

Wound<GridFilling> rasterFilling(const GridSurface& surface) {
  GridFilling none;
  none.fraction.assign(indexOf(surface.count, {0, 0, surface.count[2]}), 0.0);
  for (std::vector<double>& near : none.nearFace)
    near.assign(none.fraction.size(), 0.0);
  Wound<GridFilling> filling{none, none};
  const auto add = [&](const std::array<int, 3>& place, const CellBox& box, int winding) {
    const std::size_t cell = indexOf(surface.count, place);
    const Vec3 size = box.high - box.low;
    const auto beyond = static_cast<double>(winding - 1);
    filling.once.fraction[cell] += size.prod();
    filling.beyond.fraction[cell] += beyond * size.prod();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto along = static_cast<Eigen::Index>(axis);
      if (box.low[along] > kSnap) continue;
      const double area = size[(along + 1) % 3] * size[(along + 2) % 3];
      filling.once.nearFace[axis][cell] += area;
      filling.beyond.nearFace[axis][cell] += beyond * area;
    }
  };
  Raster(surface, kRows).forEachBox(add);
  return filling;
}

Wound<std::vector<CellMoments>> rasterMoments(const GridSurface& surface,
                                              const std::vector<std::int32_t>& wanted,
                                              std::size_t number) {
  const std::vector<CellMoments> none(number, CellMoments{});
  Wound<std::vector<CellMoments>> moments{none, none};
  const auto add = [&](const std::array<int, 3>& place, const CellBox& box, int winding) {
    const std::int32_t wantedAt = wanted[indexOf(surface.count, place)];
    if (wantedAt < 0) return;
    const auto at = static_cast<std::size_t>(wantedAt);
    const CellMoments part = momentsOf(2.0 * box.low - Vec3::Ones(), 2.0 * box.high - Vec3::Ones());
    for (std::size_t index = 0; index < part.size(); ++index) {
      moments.once[at][index] += part[index];
      moments.beyond[at][index] += static_cast<double>(winding - 1) * part[index];
    }
  };
  Raster(surface, kRows).forEachBox(add);
  return moments;
}

// True for a cell of which so little is inside that the rows of an overlap, which are too wide by
// up to half a row, could take more than there is: it is taken from the rows alone.
bool isThinOverlap(double wound, double beyondOnce) {
  constexpr double kThin = 0.5;  // share of the cell
  return wound - beyondOnce < kThin;
}

}  // namespace

double meanWinding(const GridSurface& surface) {
  const int fewest = std::min(surface.count[1], surface.count[2]);
  return Raster(surface, (kFewestRays + fewest - 1) / fewest).overlap();
}

GridFilling unionFilling(const GridSurface& surface) {
  GridFilling filling = fillingOf(surface);  // as often as the surface winds about it
  const auto [once, extra] = rasterFilling(surface);
  for (std::size_t cell = 0; cell < filling.fraction.size(); ++cell) {
    if (!(extra.fraction[cell] > 0.0)) continue;
    const bool isThin = isThinOverlap(filling.fraction[cell], extra.fraction[cell]);
    filling.fraction[cell] =
        isThin ? once.fraction[cell] : std::min(filling.fraction[cell] - extra.fraction[cell], 1.0);
  }
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::size_t cell = 0; cell < filling.fraction.size(); ++cell)
      if (extra.nearFace[axis][cell] > 0.0)
        filling.nearFace[axis][cell] = once.nearFace[axis][cell];
  return filling;
}

std::vector<CellMoments> unionMoments(const GridSurface& surface,
                                      const std::vector<std::int32_t>& wanted, std::size_t number) {
  const GridFilling whole = fillingOf(surface);
  const GridFilling beyond = rasterFilling(surface).beyond;
  std::vector<CellMoments> moments = momentsOf(surface, wanted, number);
  const auto [once, extra] = rasterMoments(surface, wanted, number);
  for (std::size_t cell = 0; cell < wanted.size(); ++cell) {
    if (wanted[cell] < 0 || !(beyond.fraction[cell] > 0.0)) continue;
    const auto at = static_cast<std::size_t>(wanted[cell]);
    if (isThinOverlap(whole.fraction[cell], beyond.fraction[cell])) {
      moments[at] = once[at];
    } else {
      for (std::size_t index = 0; index < moments[at].size(); ++index)
        moments[at][index] -= extra[at][index];
    }
  }
  return moments;
}

}  // namespace carom::modal
