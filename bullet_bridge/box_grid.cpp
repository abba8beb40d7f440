#include "bullet_bridge/box_grid.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace carom {
namespace {

constexpr float kCellPerBox = 1.25F;      // edge of a cell, in largest boxes
constexpr float kSmallestCell = 1e-6F;    // m
constexpr float kFarthestCell = 0x1p19F;  // beyond, rounding would take boxes out of their cells
constexpr std::uint32_t kLoose = std::numeric_limits<std::uint32_t>::max();
constexpr std::uint64_t kFewestCells = 64;
constexpr std::uint64_t kCellsPerBox = 2;      // on the lattice, rounded up to a power of two
constexpr std::uint64_t kMostCellsPerBox = 8;  // with a number each
constexpr std::uint64_t kCostOfRow = 3;        // of looking it up, in boxes

// Steps of a lattice that fills the numbers evenly (powers of the inverse plastic number), for
// cells that are too many to have a number each.
constexpr double kLatticeY = 0.7548776662466927;
constexpr double kLatticeZ = 0.5698402909980532;

constexpr std::uint32_t latticeStep(double part, std::uint64_t cells) {
  return static_cast<std::uint32_t>(part * static_cast<double>(cells)) | 1u;
}

// No two neighbours of a cell, nor it and a neighbour, have one number: no pair is found twice.
constexpr bool neighboursDiffer(std::uint64_t cells) {
  std::array<std::uint64_t, 27> numbers{};
  for (std::uint64_t i = 0; i < numbers.size(); ++i) {
    numbers[i] = (i % 3 + i / 3 % 3 * latticeStep(kLatticeY, cells) +
                  i / 9 * latticeStep(kLatticeZ, cells)) &
                 (cells - 1);
    for (std::uint64_t j = 0; j < i; ++j) {
      if (numbers[j] == numbers[i]) return false;
    }
  }
  return true;
}

constexpr bool neighboursAlwaysDiffer() {
  for (std::uint64_t cells = kFewestCells; cells <= std::uint64_t{1} << 32; cells *= 2) {
    if (!neighboursDiffer(cells)) return false;
  }
  return true;
}
static_assert(neighboursAlwaysDiffer());

void findAmong(std::span<const SweptBox> boxes, const SweptBox& box, PairList& found) {
  found.reserve(boxes.size());
  for (const SweptBox& other : boxes)
    found.addIf(overlap(box, other), box.body, other.body);
}

}  // namespace

BoxGrid::Cell BoxGrid::cellAt(const std::array<float, 3>& place) const {
  return {static_cast<std::int32_t>(place[0] * cellsPerMetre_),
          static_cast<std::int32_t>(place[1] * cellsPerMetre_),
          static_cast<std::int32_t>(place[2] * cellsPerMetre_)};
}

std::uint32_t BoxGrid::numberOf(const Cell& cell) const {
  return (static_cast<std::uint32_t>(cell[0]) + strideY_ * static_cast<std::uint32_t>(cell[1]) +
          strideZ_ * static_cast<std::uint32_t>(cell[2])) &
         mask_;
}

bool BoxGrid::fits(const SweptBox& box) const {
  return std::abs(box.low[0] * cellsPerMetre_) < kFarthestCell &&
         std::abs(box.low[1] * cellsPerMetre_) < kFarthestCell &&
         std::abs(box.low[2] * cellsPerMetre_) < kFarthestCell;
}

void BoxGrid::build(std::span<const SweptBox> boxes, float size) {
  cellsPerMetre_ = 1.0F / std::max(kCellPerBox * size, kSmallestCell);
  measure(boxes);
  setStrides();
  countBoxes(boxes);
  sortBoxes(boxes);
  repeatFirstCells();
}

void BoxGrid::measure(std::span<const SweptBox> boxes) {
  loose_.clear();
  std::array<float, 3> low{}, high{};
  low.fill(std::numeric_limits<float>::max());
  high.fill(std::numeric_limits<float>::lowest());
  for (const SweptBox& box : boxes) {
    if (!fits(box)) {
      loose_.push_back(box);
      continue;
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], box.low[axis]);
      high[axis] = std::max(high[axis], box.low[axis]);
    }
  }
  count_ = static_cast<std::uint32_t>(boxes.size() - loose_.size());
  occupied_ = count_ == 0 ? Range{} : Range{cellAt(low), cellAt(high)};
}

// Rows of at least three cells in planes of at least three rows: then the neighbours of a cell have
// different numbers (as they have on the lattice).
void BoxGrid::setStrides() {
  const auto cells = [this](std::size_t axis) {
    return static_cast<std::uint64_t>(std::max(occupied_.high[axis] - occupied_.low[axis] + 1, 3));
  };
  const std::uint64_t row = cells(0);
  const std::uint64_t plane = row * cells(1);  // at most 2^40
  const std::uint64_t most = std::max(kMostCellsPerBox * count_, kFewestCells);
  const bool each = plane <= most && plane * cells(2) <= most;
  const std::uint64_t wanted = each ? plane * cells(2) : kCellsPerBox * count_;
  const std::uint64_t size = std::bit_ceil(std::max(wanted, kFewestCells));
  mask_ = static_cast<std::uint32_t>(size - 1);
  strideY_ = static_cast<std::uint32_t>(each ? row : latticeStep(kLatticeY, size));
  strideZ_ = static_cast<std::uint32_t>(each ? plane : latticeStep(kLatticeZ, size));
}

void BoxGrid::countBoxes(std::span<const SweptBox> boxes) {
  starts_.assign(std::size_t{mask_} + 4, 0);
  unsorted_.resize(boxes.size());
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    unsorted_[i] = fits(boxes[i]) ? numberOf(cellAt(boxes[i].low)) : kLoose;
    if (unsorted_[i] != kLoose) ++starts_[unsorted_[i]];
  }
}

void BoxGrid::sortBoxes(std::span<const SweptBox> boxes) {
  std::uint32_t end = 0;
  for (std::uint32_t& start : starts_)
    start = end += start;
  boxes_.resize(count_);
  cellOf_.resize(count_);
  for (std::size_t i = boxes.size(); i-- > 0;) {
    if (unsorted_[i] == kLoose) continue;
    const std::uint32_t place = --starts_[unsorted_[i]];
    boxes_[place] = boxes[i];
    cellOf_[place] = unsorted_[i];
  }
}

// So that three cells in a row are one range even where the numbers wrap around.
void BoxGrid::repeatFirstCells() {
  const std::size_t cells = std::size_t{mask_} + 1;
  const std::uint32_t repeated = starts_[2];
  starts_[cells + 1] = count_ + starts_[1];
  starts_[cells + 2] = count_ + repeated;
  boxes_.resize(count_ + repeated);
  std::copy_n(boxes_.begin(), repeated, boxes_.begin() + count_);
}

// The rest of its cell, the next cell, and three cells in each of the four rows that follow; the
// others' turn found, or finds, what lies before.
void BoxGrid::findForward(std::uint32_t index, PairList& found) const {
  const SweptBox box = boxes_[index];
  const std::uint32_t cell = cellOf_[index];
  const auto findFrom = [&](std::uint32_t begin, std::uint32_t end) {
    findAmong({boxes_.data() + begin, boxes_.data() + end}, box, found);
  };
  findFrom(index + 1, starts_[cell + 2]);
  for (const std::uint32_t stride :
       {strideY_, strideZ_ - strideY_, strideZ_, strideZ_ + strideY_}) {
    const std::uint32_t first = (cell + stride - 1) & mask_;
    findFrom(starts_[first], starts_[first + 3]);
  }
}

void BoxGrid::findWithin(PairList& found) const {
  for (std::uint32_t index = 0; index < count_; ++index)
    findForward(index, found);
  for (std::size_t i = 0; i < loose_.size(); ++i) {
    findAmong({boxes_.data(), count_}, loose_[i], found);
    findAmong(std::span(loose_).subspan(i + 1), loose_[i], found);
  }
}

// The cells where lowest corners of boxes that overlap `box` may lie.
BoxGrid::Range BoxGrid::reachOf(const SweptBox& box) const {
  Range reach;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto low = static_cast<float>(occupied_.low[axis]);
    const auto high = static_cast<float>(occupied_.high[axis]);
    const float from = std::clamp(box.low[axis] * cellsPerMetre_ - 1.0F, low - 1.0F, high + 1.0F);
    const float to = std::clamp(box.high[axis] * cellsPerMetre_, low - 1.0F, high + 1.0F);
    reach.low[axis] = std::max(static_cast<std::int32_t>(from), occupied_.low[axis]);
    reach.high[axis] = std::min(static_cast<std::int32_t>(to), occupied_.high[axis]);
  }
  return reach;
}

std::size_t BoxGrid::costAround(const SweptBox& box) const {
  return costOf(reachOf(box)) + loose_.size();
}

std::size_t BoxGrid::costOf(const Range& reach) const {
  const auto cells = [&](std::size_t axis) {
    return static_cast<std::uint64_t>(std::max(reach.high[axis] - reach.low[axis] + 1, 0));
  };
  if (cells(0) == 0) return 0;
  const std::uint64_t rows = cells(1) * cells(2);  // at most 2^40
  return std::min<std::uint64_t>(rows * (kCostOfRow + cells(0)), count_);
}

void BoxGrid::findAround(const SweptBox& box, PairList& found) const {
  findAmong(loose_, box, found);
  const Range reach = reachOf(box);
  const std::size_t cost = costOf(reach);
  if (cost == 0) return;
  if (cost == count_) return findAmong({boxes_.data(), count_}, box, found);
  for (std::int32_t z = reach.low[2]; z <= reach.high[2]; ++z) {
    for (std::int32_t y = reach.low[1]; y <= reach.high[1]; ++y)
      findInRow(reach, {reach.low[0], y, z}, box, found);
  }
}

// The numbers of a row may wrap around once: it has fewer cells than there are boxes.
void BoxGrid::findInRow(const Range& reach, Cell row, const SweptBox& box, PairList& found) const {
  const std::uint32_t length = static_cast<std::uint32_t>(reach.high[0] - reach.low[0] + 1);
  const std::uint32_t first = numberOf(row);
  const std::uint32_t beforeWrap = std::min(length, mask_ + 1 - first);
  findInCells(first, first + beforeWrap, row, box, found);
  if (beforeWrap < length) findInCells(0, length - beforeWrap, row, box, found);
}

// Leaves out what is there only because its cell shares the number: it has its turn in its own row.
void BoxGrid::findInCells(std::uint32_t first, std::uint32_t end, Cell row, const SweptBox& box,
                          PairList& found) const {
  const std::uint32_t last = starts_[end];
  found.reserve(last - starts_[first]);
  for (std::uint32_t i = starts_[first]; i < last; ++i) {
    if (!overlap(box, boxes_[i])) continue;
    const Cell cell = cellAt(boxes_[i].low);
    found.addIf(cell[1] == row[1] && cell[2] == row[2], box.body, boxes_[i].body);
  }
}

}  // namespace carom
