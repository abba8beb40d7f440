#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "carom/audio/vector.h"

namespace carom::native {

/// A hierarchical grid of cells that finds the neighbours of a sphere (Ogarko and Luding 2012,
/// Comput. Phys. Commun. 183, 931). A level has cells at least as wide as the spheres that live
/// there, so that two of them can only touch if their cells are neighbours. Each level's cells are
/// a whole number of the next finer level's cells wide, and every sphere is also a visitor in the
/// cell of each coarser level that contains its own: so a large sphere finds the small ones near it
/// without looking at all the small cells that it covers, and a small one finds the large ones.
///
/// Cells are counted from the middle of the spheres, and share a table that repeats after a power
/// of two of cells. So distant spheres may be looked at in vain, but no near one is missed. Space
/// has no end: the last cells, some 10^6 from the middle, reach to infinity. So no position is too
/// far, and a sphere that has flown away crosses no more; but a crowd out there is looked at as a
/// whole. A world of few spheres has no grid: each sphere is near every other, and never crosses.
///
/// Internal to native/. The constructor allocates, nothing else does.
class CellGrid {
 public:
  static constexpr std::uint32_t kNobody = 0xFFFFFFFF;
  static constexpr double kSurely = 1.0 + 1e-9;  ///< covers the rounding of a distance
  /// Largest number of spheres without a grid: looking at all of them costs less.
  static constexpr std::size_t kFewSpheres = 24;

  /// The crossing of a sphere into the next cell, through the face across `axis`.
  struct Crossing {
    double wait = 0.0;  ///< s from the position given, infinite if it stays
    std::uint8_t axis = 0;
    bool up = false;
  };
  /// The course of a sphere: a straight line or a parabola.
  struct Course {
    Vec3 position;      ///< m
    Vec3 velocity;      ///< m/s
    Vec3 acceleration;  ///< m/s^2
  };

  CellGrid(std::span<const Vec3> positions, std::span<const double> radii);

  Crossing nextCrossing(std::uint32_t sphere, const Course& course) const;
  /// Moves the sphere to the next cell.
  void cross(std::uint32_t sphere, const Crossing& crossing);
  /// Removes the sphere: it is near no other any more. To be called once; no other function may be
  /// called for it afterwards.
  void remove(std::uint32_t sphere);

  /// The position of a sphere and the distance that it may travel soon: cells beyond its reach are
  /// left out.
  struct Probe {
    Vec3 position;                                         ///< m
    double radius = 0.0;                                   ///< m
    double way = std::numeric_limits<double>::infinity();  ///< m
  };

  /// Calls visit(other) for all spheres that may touch this one on its way before either of them
  /// crosses. Some come more than once where the table repeats. If `visit` has such members,
  /// soon(other) is called some time before, and both(one, other) for two at once, which may be the
  /// same.
  template <class Visit>
  void visitNear(std::uint32_t sphere, const Probe& probe, const Visit& visit) const;
  /// Calls `visit` as visitNear does, only for spheres that were not, or may not have been, near
  /// before the sphere crossed.
  template <class Visit>
  void visitNew(std::uint32_t sphere, const Crossing& crossing, const Probe& probe,
                const Visit& visit) const;

  std::size_t levelCount() const { return levels_.size(); }  ///< 0: no grid

  /// True if the sphere is in the lists of its cells, and the position in its cell within
  /// `tolerance` m.
  bool holds(std::uint32_t sphere, const Vec3& position, double tolerance) const;

 private:
  using Cell = std::array<std::int32_t, 3>;
  using Slot = std::uint32_t;  ///< three bit fields side by side, one for each axis

  struct Level {
    double width = 0.0;           ///< m, of a cell
    double largest = 0.0;         ///< m, the radius of its largest sphere
    int shift = 0;                ///< 2^shift cells of the finest level make one of these
    std::int32_t end = 0;         ///< the last cells are -end and end - 1
    std::array<int, 3> shifts{};  ///< position of each axis's bits in a slot
    /// Bits of each axis in a slot: the table repeats after them.
    std::array<Slot, 3> masks{};
    std::vector<std::uint32_t> natives;   ///< by slot: the first sphere that lives on this level
    std::vector<std::uint32_t> visitors;  ///< by slot: the first sphere of a finer level
    std::vector<std::uint32_t> next;      ///< by sphere: the next one in the same cell
    std::vector<std::uint32_t> previous;  ///< by sphere: the previous one in the same cell
  };

  /// Range [low, high] of cells by axis, where 1 is the sphere's own, and whether to look at
  /// visitors there too.
  struct Range {
    std::array<std::size_t, 3> low = {0, 0, 0};
    std::array<std::size_t, 3> high = {2, 2, 2};
    bool visitors = false;
  };

  static Slot slotPart(const Level& level, std::size_t axis, std::int32_t cell);
  static Slot slot(const Level& level, const Cell& cell);
  void addLevel(Level level, const std::array<int, 3>& bits, std::size_t spheres);
  void addSphere(const Vec3& position, std::size_t home);
  Cell cellOf(const Vec3& position, const Level& level) const;
  Cell cellAt(std::uint32_t sphere, const Level& level) const;
  void enter(std::uint32_t sphere, std::size_t level, const Cell& cell);
  void leave(std::uint32_t sphere, std::size_t level, const Cell& cell);
  std::vector<std::uint32_t>& heads(std::uint32_t sphere, std::size_t level);

  template <class Visit>
  void visitCells(std::uint32_t sphere, const Level& level, const Cell& cell, const Range& range,
                  const Probe& probe, const Visit& visit) const;
  template <class Visit>
  static void visitLists(std::uint32_t sphere, const std::vector<std::uint32_t>& heads,
                         const std::vector<std::uint32_t>& next, std::span<const Slot> cells,
                         const Visit& visit);

  std::vector<std::uint32_t> few_;     ///< all spheres, where there is no grid
  Vec3 middle_ = Vec3::Zero();         ///< m, the corner of the cells 0
  std::vector<Level> levels_;          ///< the finest first
  std::vector<std::uint8_t> levelOf_;  ///< by sphere
  std::vector<Cell> cells_;            ///< by sphere: its cell on its own level
};

// ---- Visits are inlined: a stepper spends most of its time in them.

inline CellGrid::Slot CellGrid::slotPart(const Level& level, std::size_t axis, std::int32_t cell) {
  return (static_cast<Slot>(cell) << level.shifts[axis]) & level.masks[axis];
}

inline CellGrid::Slot CellGrid::slot(const Level& level, const Cell& cell) {
  return slotPart(level, 0, cell[0]) | slotPart(level, 1, cell[1]) | slotPart(level, 2, cell[2]);
}

inline CellGrid::Cell CellGrid::cellAt(std::uint32_t sphere, const Level& level) const {
  Cell cell = cells_[sphere];
  const int shift = level.shift - levels_[levelOf_[sphere]].shift;
  for (std::int32_t& part : cell)
    part >>= shift;
  return cell;
}

template <class Visit>
void CellGrid::visitCells(std::uint32_t sphere, const Level& level, const Cell& cell,
                          const Range& range, const Probe& probe, const Visit& visit) const {
  // Squared distances and slot parts of the cells before, at and behind its own, by axis.
  std::array<std::array<double, 3>, 3> squares;
  std::array<std::array<Slot, 3>, 3> slots;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto at = static_cast<Eigen::Index>(axis);
    const double before =
        probe.position[at] - middle_[at] - static_cast<double>(cell[axis]) * level.width;
    const double behind = level.width - before;
    squares[axis] = {before * before, 0.0, behind * behind};
    const Slot own = slotPart(level, axis, cell[axis]);
    const Slot step = level.masks[axis] & (~level.masks[axis] + 1);  // its lowest bit
    slots[axis] = {(own - step) & level.masks[axis], own, (own + step) & level.masks[axis]};
  }
  const double reach = (probe.radius + level.largest + probe.way) * kSurely;
  const double within = reach * reach;
  // First the cells, then their spheres, then the visits: simple loops are faster than a single
  // nested one.
  std::array<Slot, 27> cells;
  std::size_t cellCount = 0;
  for (std::size_t z = range.low[2]; z <= range.high[2]; ++z) {
    for (std::size_t y = range.low[1]; y <= range.high[1]; ++y) {
      const double across = squares[2][z] + squares[1][y];
      const Slot row = slots[2][z] | slots[1][y];
      for (std::size_t x = range.low[0]; x <= range.high[0]; ++x) {
        cells[cellCount] = row | slots[0][x];
        cellCount += across + squares[0][x] <= within ? 1U : 0U;
      }
    }
  }
  const std::span<const Slot> near(cells.data(), cellCount);
  visitLists(sphere, level.natives, level.next, near, visit);
  if (range.visitors) visitLists(sphere, level.visitors, level.next, near, visit);
}

template <class Visit>
void CellGrid::visitLists(std::uint32_t sphere, const std::vector<std::uint32_t>& heads,
                          const std::vector<std::uint32_t>& next, std::span<const Slot> cells,
                          const Visit& visit) {
  std::array<std::uint32_t, 128> found;
  std::size_t count = 0;
  const auto visitFound = [&] {
    if constexpr (requires { visit.both(0U, 0U); }) {
      if (count % 2 == 1) found[count] = found[count - 1];
      for (std::size_t at = 0; at < count; at += 2)
        visit.both(found[at], found[at + 1]);
    } else {
      for (std::size_t at = 0; at < count; ++at)
        visit(found[at]);
    }
    count = 0;
  };
  for (const Slot cell : cells) {
    for (std::uint32_t other = heads[cell]; other != kNobody; other = next[other]) {
      if constexpr (requires { visit.soon(other); }) visit.soon(other);
      found[count] = other;
      count += other != sphere ? 1U : 0U;
      if (count == found.size()) visitFound();
    }
  }
  visitFound();
}

template <class Visit>
void CellGrid::visitNear(std::uint32_t sphere, const Probe& probe, const Visit& visit) const {
  if (levels_.empty()) {
    for (const std::uint32_t other : few_)
      if (other != sphere) visit(other);
    return;
  }
  const std::size_t home = levelOf_[sphere];
  Range range;
  range.visitors = home > 0;
  visitCells(sphere, levels_[home], cells_[sphere], range, probe, visit);
  range.visitors = false;
  for (std::size_t coarser = home + 1; coarser < levels_.size(); ++coarser)
    visitCells(sphere, levels_[coarser], cellAt(sphere, levels_[coarser]), range, probe, visit);
}

template <class Visit>
void CellGrid::visitNew(std::uint32_t sphere, const Crossing& crossing, const Probe& probe,
                        const Visit& visit) const {
  const std::size_t home = levelOf_[sphere];
  const int direction = crossing.up ? 1 : -1;
  Range range;
  range.low[crossing.axis] = range.high[crossing.axis] = crossing.up ? 2 : 0;
  range.visitors = home > 0;
  visitCells(sphere, levels_[home], cells_[sphere], range, probe, visit);
  range.visitors = false;
  for (std::size_t coarser = home + 1; coarser < levels_.size(); ++coarser) {
    const Level& level = levels_[coarser];
    const Cell cell = cellAt(sphere, level);
    const std::int32_t before =
        (cells_[sphere][crossing.axis] - direction) >> (level.shift - levels_[home].shift);
    if (before == cell[crossing.axis]) continue;
    visitCells(sphere, level, cell, range, probe, visit);
  }
}

}  // namespace carom::native
