#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "audio/vector.h"

namespace carom {

/// Which spheres are near which: a hierarchical grid of cells (Ogarko and Luding 2012, Comput.
/// Phys. Commun. 183, 931). A level has cells at least as wide as the spheres that live there, so
/// that two of them can only touch if their cells are neighbours. Each level's cells are a whole
/// number of the next finer level's cells wide, and every sphere is also a visitor in the cells
/// around it of each coarser level: so a large sphere finds the small ones near it without looking
/// at all the small cells that it covers, and a small one finds the large ones.
///
/// Space has no end: cells are counted from the origin in all directions, and share a table that
/// repeats after a power of two of cells. What is far away may so be looked at in vain, but nothing
/// near is missed. Few spheres have no grid at all: each is near every other, and never crosses.
///
/// Internal to native/. Construction allocates, nothing else does.
class CellGrid {
 public:
  static constexpr std::uint32_t kNobody = 0xFFFFFFFF;
  static constexpr double kSurely = 1.0 + 1e-9;  ///< covers the rounding of a distance
  /// A grid of cells costs more than looking at so many spheres.
  static constexpr std::size_t kFewSpheres = 24;

  /// What becomes of a sphere on its way: it leaves its cell through the face across `axis`.
  struct Crossing {
    double wait = 0.0;  ///< s from the position given, infinite when it stays
    std::uint8_t axis = 0;
    bool up = false;
  };
  /// Straight ahead or along a parabola.
  struct Course {
    Vec3 position;      ///< m
    Vec3 velocity;      ///< m/s
    Vec3 acceleration;  ///< m/s^2
  };

  CellGrid(std::span<const Vec3> positions, std::span<const double> radii);

  Crossing nextCrossing(std::uint32_t sphere, const Course& course) const;
  /// Moves the sphere to the next cell.
  void cross(std::uint32_t sphere, const Crossing& crossing);

  /// Where a sphere is, and how far it may be soon: what is farther away is left out, a cell at a
  /// time. `way` may shrink while others are visited.
  struct Probe {
    Vec3 position;                                         ///< m
    double radius = 0.0;                                   ///< m
    double way = std::numeric_limits<double>::infinity();  ///< m
  };

  /// Calls visit(other) for all spheres that may touch this one on its way before either of them
  /// crosses. Some come more than once where the table repeats.
  template <class Visit>
  void visitNear(std::uint32_t sphere, const Probe& probe, const Visit& visit) const;
  /// Those among them that were not, or may not have been, before the sphere crossed.
  template <class Visit>
  void visitNew(std::uint32_t sphere, const Crossing& crossing, const Probe& probe,
                const Visit& visit) const;

  std::size_t levelCount() const { return levels_.size(); }  ///< 0: no grid

  /// Whether each sphere is in the lists of its cells, and the position in its cell but for
  /// `tolerance` m.
  bool holds(std::uint32_t sphere, const Vec3& position, double tolerance) const;

 private:
  using Cell = std::array<std::int64_t, 3>;

  struct Level {
    double width = 0.0;                   ///< m, of a cell
    double largest = 0.0;                 ///< m, the radius of its largest sphere
    int shift = 0;                        ///< 2^shift cells of the finest level make one of this
    std::array<int, 3> bits{};            ///< the table repeats after 2^bits cells
    std::vector<std::uint32_t> natives;   ///< by slot: the first sphere whose level this is
    std::vector<std::uint32_t> visitors;  ///< by slot: the first of a finer level
    std::vector<std::uint32_t> next;      ///< by sphere, in the same cell
    std::vector<std::uint32_t> previous;  ///< by sphere
  };

  /// Cells [low, high] around a cell, and whether with the visitors there.
  struct Range {
    std::array<int, 3> low = {-1, -1, -1};
    std::array<int, 3> high = {1, 1, 1};
    bool visitors = false;
  };

  static std::size_t slot(const Level& level, const Cell& cell);
  Cell cellAt(std::uint32_t sphere, const Level& level) const;
  void enter(std::uint32_t sphere, std::size_t level, const Cell& cell);
  void leave(std::uint32_t sphere, std::size_t level, const Cell& cell);
  std::vector<std::uint32_t>& heads(std::uint32_t sphere, std::size_t level);

  template <class Visit>
  void visitList(const Level& level, std::uint32_t first, const Visit& visit) const;
  template <class Visit>
  void visitCells(const Level& level, const Cell& cell, const Range& range, const Probe& probe,
                  const Visit& visit) const;

  std::size_t sphereCount_ = 0;
  std::vector<Level> levels_;          ///< the finest first
  std::vector<std::uint8_t> levelOf_;  ///< by sphere
  std::vector<Cell> cells_;            ///< by sphere, of its own level
};

// ---- Visits are inlined: a stepper spends most of its time in them.

inline std::size_t CellGrid::slot(const Level& level, const Cell& cell) {
  const auto part = [&](std::size_t axis) {
    const auto mask = (std::uint64_t{1} << level.bits[axis]) - 1;
    return static_cast<std::uint64_t>(cell[axis]) & mask;
  };
  return ((part(2) << level.bits[1] | part(1)) << level.bits[0]) | part(0);
}

inline CellGrid::Cell CellGrid::cellAt(std::uint32_t sphere, const Level& level) const {
  Cell cell = cells_[sphere];
  const int shift = level.shift - levels_[levelOf_[sphere]].shift;
  for (std::int64_t& part : cell)
    part >>= shift;
  return cell;
}

template <class Visit>
void CellGrid::visitList(const Level& level, std::uint32_t first, const Visit& visit) const {
  for (std::uint32_t other = first; other != kNobody; other = level.next[other])
    visit(other);
}

template <class Visit>
void CellGrid::visitCells(const Level& level, const Cell& cell, const Range& range,
                          const Probe& probe, const Visit& visit) const {
  // Squared distances to the cells before, at and behind its own, by axis.
  std::array<std::array<double, 3>, 3> squares{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double from = probe.position[static_cast<Eigen::Index>(axis)] -
                        static_cast<double>(cell[axis]) * level.width;
    squares[axis] = {from * from, 0.0, (level.width - from) * (level.width - from)};
  }
  // Its own cell is in the middle of the range, and nearer ones are not sorted: a short way is
  // found soon, as hops are with whom it met last.
  for (int z = range.low[2]; z <= range.high[2]; ++z) {
    for (int y = range.low[1]; y <= range.high[1]; ++y) {
      const double across =
          squares[2][static_cast<std::size_t>(z + 1)] + squares[1][static_cast<std::size_t>(y + 1)];
      for (int x = range.low[0]; x <= range.high[0]; ++x) {
        const double reach = (probe.radius + level.largest + probe.way) * kSurely;
        if (across + squares[0][static_cast<std::size_t>(x + 1)] > reach * reach) continue;
        const std::size_t at = slot(level, {cell[0] + x, cell[1] + y, cell[2] + z});
        visitList(level, level.natives[at], visit);
        if (!range.visitors) continue;
        visitList(level, level.visitors[at], visit);
      }
    }
  }
}

template <class Visit>
void CellGrid::visitNear(std::uint32_t sphere, const Probe& probe, const Visit& visit) const {
  const auto others = [&](std::uint32_t other) {
    if (other != sphere) visit(other);
  };
  if (levels_.empty()) {
    for (std::uint32_t other = 0; other < sphereCount_; ++other)
      others(other);
    return;
  }
  const std::size_t home = levelOf_[sphere];
  Range range;
  range.visitors = home > 0;
  visitCells(levels_[home], cells_[sphere], range, probe, others);
  range.visitors = false;
  for (std::size_t coarser = home + 1; coarser < levels_.size(); ++coarser)
    visitCells(levels_[coarser], cellAt(sphere, levels_[coarser]), range, probe, others);
}

template <class Visit>
void CellGrid::visitNew(std::uint32_t sphere, const Crossing& crossing, const Probe& probe,
                        const Visit& visit) const {
  const std::size_t home = levelOf_[sphere];
  const int direction = crossing.up ? 1 : -1;
  Range range;
  range.low[crossing.axis] = range.high[crossing.axis] = direction;
  range.visitors = home > 0;
  visitCells(levels_[home], cells_[sphere], range, probe, visit);
  range.visitors = false;
  for (std::size_t coarser = home + 1; coarser < levels_.size(); ++coarser) {
    const Level& level = levels_[coarser];
    const Cell cell = cellAt(sphere, level);
    const std::int64_t before =
        (cells_[sphere][crossing.axis] - direction) >> (level.shift - levels_[home].shift);
    if (before == cell[crossing.axis]) continue;
    visitCells(level, cell, range, probe, visit);
  }
}

}  // namespace carom
