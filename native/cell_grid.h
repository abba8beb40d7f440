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
  /// time.
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
    std::array<int, 3> shifts{};          ///< of each axis in a slot
    std::vector<std::uint32_t> natives;   ///< by slot: the first sphere whose level this is
    std::vector<std::uint32_t> visitors;  ///< by slot: the first of a finer level
    std::vector<std::uint32_t> next;      ///< by sphere, in the same cell
    std::vector<std::uint32_t> previous;  ///< by sphere
  };

  /// Cells [low, high] by axis, where 1 is a sphere's own; and whether with the visitors there.
  struct Range {
    std::array<std::size_t, 3> low = {0, 0, 0};
    std::array<std::size_t, 3> high = {2, 2, 2};
    bool visitors = false;
  };

  static std::size_t slotPart(const Level& level, std::size_t axis, std::int64_t cell);
  static std::size_t slot(const Level& level, const Cell& cell);
  Cell cellAt(std::uint32_t sphere, const Level& level) const;
  void enter(std::uint32_t sphere, std::size_t level, const Cell& cell);
  void leave(std::uint32_t sphere, std::size_t level, const Cell& cell);
  std::vector<std::uint32_t>& heads(std::uint32_t sphere, std::size_t level);

  template <class Visit>
  static void visitAll(std::span<const std::uint32_t> spheres, const Visit& visit);
  template <class Visit>
  void visitCells(std::uint32_t sphere, const Level& level, const Cell& cell, const Range& range,
                  const Probe& probe, const Visit& visit) const;

  std::size_t sphereCount_ = 0;
  std::vector<Level> levels_;          ///< the finest first
  std::vector<std::uint8_t> levelOf_;  ///< by sphere
  std::vector<Cell> cells_;            ///< by sphere, of its own level
};

// ---- Visits are inlined: a stepper spends most of its time in them.

inline std::size_t CellGrid::slotPart(const Level& level, std::size_t axis, std::int64_t cell) {
  const auto mask = (std::uint64_t{1} << level.bits[axis]) - 1;
  return (static_cast<std::uint64_t>(cell) & mask) << level.shifts[axis];
}

inline std::size_t CellGrid::slot(const Level& level, const Cell& cell) {
  return slotPart(level, 0, cell[0]) | slotPart(level, 1, cell[1]) | slotPart(level, 2, cell[2]);
}

inline CellGrid::Cell CellGrid::cellAt(std::uint32_t sphere, const Level& level) const {
  Cell cell = cells_[sphere];
  const int shift = level.shift - levels_[levelOf_[sphere]].shift;
  for (std::int64_t& part : cell)
    part >>= shift;
  return cell;
}

template <class Visit>
void CellGrid::visitAll(std::span<const std::uint32_t> spheres, const Visit& visit) {
  for (const std::uint32_t sphere : spheres)
    visit(sphere);
}

template <class Visit>
void CellGrid::visitCells(std::uint32_t sphere, const Level& level, const Cell& cell,
                          const Range& range, const Probe& probe, const Visit& visit) const {
  // Of the cells before, at and behind its own, by axis: squared distances, and shares of the
  // slots.
  std::array<std::array<double, 3>, 3> squares{};
  std::array<std::array<std::size_t, 3>, 3> slots{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double from = probe.position[static_cast<Eigen::Index>(axis)] -
                        static_cast<double>(cell[axis]) * level.width;
    squares[axis] = {from * from, 0.0, (level.width - from) * (level.width - from)};
    for (std::size_t at = 0; at < 3; ++at)
      slots[axis][at] = slotPart(level, axis, cell[axis] + static_cast<std::int64_t>(at) - 1);
  }
  const double reach = (probe.radius + level.largest + probe.way) * kSurely;
  const double within = reach * reach;
  // First who is there, then what they do: two simple loops are faster than one.
  std::array<std::uint32_t, 128> found;
  std::size_t count = 0;
  const std::uint32_t* const next = level.next.data();
  const auto collect = [&](std::uint32_t first) {
    for (std::uint32_t other = first; other != kNobody; other = next[other]) {
      if (count == found.size()) {
        visitAll(std::span(found.data(), count), visit);
        count = 0;
      }
      if (other == sphere) continue;
      found[count++] = other;
      if constexpr (requires { visit.soon(other); }) visit.soon(other);
    }
  };
  const auto collectRow = [&](double across, std::size_t row, const std::uint32_t* heads) {
    const std::size_t end = range.high[0];
    for (std::size_t x = range.low[0]; x <= end; ++x) {
      if (across + squares[0][x] <= within) collect(heads[row | slots[0][x]]);
    }
  };
  for (std::size_t z = range.low[2]; z <= range.high[2]; ++z) {
    for (std::size_t y = range.low[1]; y <= range.high[1]; ++y) {
      const double across = squares[2][z] + squares[1][y];
      if (across > within) continue;
      const std::size_t row = slots[2][z] | slots[1][y];
      collectRow(across, row, level.natives.data());
      if (range.visitors) collectRow(across, row, level.visitors.data());
    }
  }
  visitAll(std::span(found.data(), count), visit);
}

template <class Visit>
void CellGrid::visitNear(std::uint32_t sphere, const Probe& probe, const Visit& visit) const {
  if (levels_.empty()) {
    for (std::uint32_t other = 0; other < sphereCount_; ++other)
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
    const std::int64_t before =
        (cells_[sphere][crossing.axis] - direction) >> (level.shift - levels_[home].shift);
    if (before == cell[crossing.axis]) continue;
    visitCells(sphere, level, cell, range, probe, visit);
  }
}

}  // namespace carom
