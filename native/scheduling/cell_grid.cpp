#include "native/scheduling/cell_grid.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "native/math/contact_time.h"

namespace carom::native {
namespace {

/// Factor by which cells are wider than necessary: more than the rounding of a position in its
/// cell.
constexpr double kMargin = 1.0 + 1e-9;
/// Least width of cells as a share of the mean spacing: fewer crossings where spheres are far
/// apart.
constexpr double kLeastWidth = 0.5;
constexpr int kLeastBits = 2;    ///< so that three neighbouring cells are different
constexpr int kMostLevels = 20;  ///< for radii 10^6 apart; smaller spheres share the last level
constexpr int kMostTableBits = 30;
constexpr int kMostCellBits = 30;  ///< for the number of a cell
constexpr int kCellBits = 20;      ///< enough: a sphere beyond has left the others behind
constexpr int kRoomBits = 2;       ///< room of 2^2 times the extent of the spheres at first
constexpr double kSlotsPerSphere = 4.0;

struct Extent {
  Vec3 low;
  Vec3 high;
};

Extent extentOf(std::span<const Vec3> positions) {
  Extent extent{positions.front(), positions.front()};
  for (const Vec3& position : positions) {
    extent.low = extent.low.cwiseMin(position);
    extent.high = extent.high.cwiseMax(position);
  }
  return extent;
}

/// Cube root by Newton's method, from a power of two that is no smaller. The order in which spheres
/// are looked at depends on the cells, so these must be the same everywhere, which std::cbrt does
/// not promise.
double cubeRoot(double value) {
  if (!(value > 0.0)) return 0.0;
  double root = std::ldexp(1.0, static_cast<int>(std::floor(std::ilogb(value) / 3.0)) + 1);
  for (;;) {
    const double next = (2.0 * root + value / (root * root)) / 3.0;
    if (!(next < root)) return root;
    root = next;
  }
}

/// Edge in m of the cube that each sphere has to itself on average.
double meanSpacing(const Extent& extent, double diameter, std::size_t count) {
  double volume = 1.0;
  for (int axis = 0; axis < 3; ++axis)
    volume *= extent.high[axis] - extent.low[axis] + diameter;
  return cubeRoot(volume / static_cast<double>(count));
}

/// Bits of a level's table, by axis: enough to tell all cells of `extent` apart, but not more slots
/// than suit the number of spheres.
std::array<int, 3> tableBits(const Extent& extent, double width, std::size_t spheres) {
  std::array<int, 3> bits{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto at = static_cast<Eigen::Index>(axis);
    const double cells = (extent.high[at] - extent.low[at]) / width + 2.0;
    bits[axis] = std::max(kLeastBits, std::ilogb(std::min(cells, 1e9)) + 1);
  }
  const int most =
      std::min(std::ilogb(kSlotsPerSphere * static_cast<double>(spheres)) + 1, kMostTableBits);
  while (bits[0] + bits[1] + bits[2] > std::max(most, 3 * kLeastBits))
    --*std::max_element(bits.begin(), bits.end());
  return bits;
}

/// Bits of the cells of the coarsest level that are told apart, counted from the middle.
int cellBits(const Extent& extent, double width, int halvings) {
  const double cells = (extent.high - extent.low).maxCoeff() / width + 1.0;
  const int needed = std::ilogb(std::min(cells, 0x1p30)) + kRoomBits;
  return std::min(std::max(needed, kCellBits), kMostCellBits - halvings);
}

/// Widths of the cells: halved from level to level, from the widest, which suits the largest
/// sphere, down to one that suits the smallest.
struct Widths {
  double widest = 0.0;  ///< m
  int halvings = 0;

  double at(int level) const { return std::ldexp(widest, level - halvings); }  ///< m
  int levelFor(double radius) const {
    int level = 0;
    while (at(level) < 2.0 * radius * kMargin)
      ++level;
    return level;
  }
};

Widths widthsFor(const Extent& extent, std::span<const double> radii) {
  const auto [least, largest] = std::ranges::minmax(radii);
  const double spacing = kLeastWidth * meanSpacing(extent, 2.0 * largest, radii.size());
  const double widest = std::max(2.0 * largest * kMargin, spacing);
  const double finest = std::max(2.0 * least * kMargin, spacing);
  return {widest, std::clamp(std::ilogb(widest / finest), 0, kMostLevels)};
}

}  // namespace

CellGrid::CellGrid(std::span<const Vec3> positions, std::span<const double> radii) {
  if (radii.size() <= kFewSpheres) {
    few_.resize(radii.size());
    std::iota(few_.begin(), few_.end(), 0U);
    return;
  }
  const Extent extent = extentOf(positions);
  middle_ = 0.5 * extent.low + 0.5 * extent.high;
  const Widths widths = widthsFor(extent, radii);
  std::array<std::size_t, kMostLevels + 1> populations{};
  for (const double radius : radii)
    ++populations[static_cast<std::size_t>(widths.levelFor(radius))];
  const int coarsestBits = cellBits(extent, widths.widest, widths.halvings);
  std::array<std::uint8_t, kMostLevels + 1> place{};
  std::size_t natives = 0;
  for (int level = 0; level <= widths.halvings; ++level) {
    const auto index = static_cast<std::size_t>(level);
    place[index] = static_cast<std::uint8_t>(levels_.size());
    natives += populations[index];
    if (populations[index] == 0) continue;
    Level added;
    added.width = widths.at(level);
    added.shift = level;
    added.end = std::int32_t{1} << (coarsestBits + widths.halvings - level);
    const std::array<int, 3> bits = tableBits(extent, added.width, natives);
    addLevel(std::move(added), bits, radii.size());
  }
  for (std::uint32_t sphere = 0; sphere < radii.size(); ++sphere) {
    const std::size_t home = place[static_cast<std::size_t>(widths.levelFor(radii[sphere]))];
    levels_[home].largest = std::max(levels_[home].largest, radii[sphere]);
    addSphere(positions[sphere], home);
  }
}

/// Adds a level with a table of these bits by axis, empty, for `spheres` spheres.
void CellGrid::addLevel(Level level, const std::array<int, 3>& bits, std::size_t spheres) {
  level.shifts = {0, bits[0], bits[0] + bits[1]};
  for (std::size_t axis = 0; axis < 3; ++axis)
    level.masks[axis] = ((Slot{1} << bits[axis]) - 1) << level.shifts[axis];
  const std::size_t slots = std::size_t{1} << (bits[0] + bits[1] + bits[2]);
  level.natives.assign(slots, kNobody);
  if (!levels_.empty()) level.visitors.assign(slots, kNobody);
  level.next.assign(spheres, kNobody);
  level.previous.assign(spheres, kNobody);
  levels_.push_back(std::move(level));
}

/// Adds the next sphere, which lives on level `home`.
void CellGrid::addSphere(const Vec3& position, std::size_t home) {
  const auto sphere = static_cast<std::uint32_t>(cells_.size());
  levelOf_.push_back(static_cast<std::uint8_t>(home));
  cells_.push_back(cellOf(position, levels_[home]));
  for (std::size_t level = home; level < levels_.size(); ++level)
    enter(sphere, level, cellAt(sphere, levels_[level]));
}

CellGrid::Cell CellGrid::cellOf(const Vec3& position, const Level& level) const {
  Cell cell;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto at = static_cast<Eigen::Index>(axis);
    const double place = std::floor((position[at] - middle_[at]) / level.width);
    cell[axis] = static_cast<std::int32_t>(
        std::clamp(place, -static_cast<double>(level.end), static_cast<double>(level.end - 1)));
  }
  return cell;
}

std::vector<std::uint32_t>& CellGrid::heads(std::uint32_t sphere, std::size_t level) {
  return level == levelOf_[sphere] ? levels_[level].natives : levels_[level].visitors;
}

void CellGrid::enter(std::uint32_t sphere, std::size_t level, const Cell& cell) {
  Level& there = levels_[level];
  std::uint32_t& head = heads(sphere, level)[slot(there, cell)];
  there.next[sphere] = head;
  there.previous[sphere] = kNobody;
  if (head != kNobody) there.previous[head] = sphere;
  head = sphere;
}

void CellGrid::leave(std::uint32_t sphere, std::size_t level, const Cell& cell) {
  Level& there = levels_[level];
  const std::uint32_t next = there.next[sphere];
  const std::uint32_t previous = there.previous[sphere];
  if (next != kNobody) there.previous[next] = previous;
  if (previous != kNobody) {
    there.next[previous] = next;
  } else {
    heads(sphere, level)[slot(there, cell)] = next;
  }
}

CellGrid::Crossing CellGrid::nextCrossing(std::uint32_t sphere, const Course& course) const {
  Crossing crossing{kNever, 0, false};
  if (levels_.empty()) return crossing;
  const Level& level = levels_[levelOf_[sphere]];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto at = static_cast<Eigen::Index>(axis);
    const std::int32_t cell = cells_[sphere][axis];
    const double low = course.position[at] - middle_[at] - static_cast<double>(cell) * level.width;
    const double high = level.width - low;
    const double velocity = course.velocity[at];
    const double acceleration = course.acceleration[at];
    const bool first = cell == -level.end;
    const bool last = cell == level.end - 1;
    const auto consider = [&](double wait, bool up) {
      if (wait < crossing.wait) crossing = {wait, static_cast<std::uint8_t>(axis), up};
    };
    if (acceleration == 0.0) {
      if (velocity > 0.0 && !last) consider(std::max(high, 0.0) / velocity, true);
      if (velocity < 0.0 && !first) consider(std::max(low, 0.0) / -velocity, false);
    } else {
      if (!first) consider(planeContactTime(low, velocity, acceleration), false);
      if (!last) consider(planeContactTime(high, -velocity, -acceleration), true);
    }
  }
  return crossing;
}

void CellGrid::cross(std::uint32_t sphere, const Crossing& crossing) {
  const Cell before = cells_[sphere];
  cells_[sphere][crossing.axis] += crossing.up ? 1 : -1;
  const std::size_t home = levelOf_[sphere];
  for (std::size_t level = home; level < levels_.size(); ++level) {
    const int shift = levels_[level].shift - levels_[home].shift;
    Cell from = before;
    for (std::int32_t& part : from)
      part >>= shift;
    const Cell to = cellAt(sphere, levels_[level]);
    if (from == to) break;
    leave(sphere, level, from);
    enter(sphere, level, to);
  }
}

void CellGrid::remove(std::uint32_t sphere) {
  std::erase(few_, sphere);
  if (levels_.empty()) return;
  for (std::size_t level = levelOf_[sphere]; level < levels_.size(); ++level)
    leave(sphere, level, cellAt(sphere, levels_[level]));
}

bool CellGrid::holds(std::uint32_t sphere, const Vec3& position, double tolerance) const {
  if (levels_.empty()) return true;
  const std::size_t home = levelOf_[sphere];
  const Level& own = levels_[home];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto at = static_cast<Eigen::Index>(axis);
    const std::int32_t cell = cells_[sphere][axis];
    const double from = position[at] - middle_[at] - static_cast<double>(cell) * own.width;
    if (cell != -own.end && !(from >= -tolerance)) return false;
    if (cell != own.end - 1 && !(from <= own.width + tolerance)) return false;
  }
  for (std::size_t level = home; level < levels_.size(); ++level) {
    const Level& there = levels_[level];
    const auto& lists = level == home ? there.natives : there.visitors;
    std::uint32_t at = lists[slot(there, cellAt(sphere, there))];
    while (at != kNobody && at != sphere)
      at = there.next[at];
    if (at != sphere) return false;
  }
  return true;
}

}  // namespace carom::native
