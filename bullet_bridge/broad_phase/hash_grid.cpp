#include "bullet_bridge/broad_phase/hash_grid.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace carom::bullet {
namespace {

constexpr float kEdge = 1.0625F;     // edge of a cell, relative to the largest box
constexpr float kLeastEdge = 1e-4F;  // m
// Farthest cell that is used: floats still tell 32 places within it, so rounding does not use up
// what kEdge leaves.
constexpr float kFarthestCell = 0x1p18F;
constexpr std::uint32_t kLoose = std::numeric_limits<std::uint32_t>::max();
constexpr std::uint64_t kFewestCells = 64;
constexpr std::uint64_t kCellsPerBox = 2;  // if cells share numbers; rounded up to a power of two
constexpr std::uint64_t kMostCellsPerBox = 8;  // if each cell has its own number
constexpr std::uint64_t kCostOfRow = 3;        // cost of looking a row up, in boxes

constexpr int kPartBits = 10;  // a cell has 2^10 parts
constexpr float kOnePart = 0x1p-10F;

// In a code, the 20 bits of each coordinate have a guard on top, which takes the borrow when two
// codes are subtracted; the bit below it is then the sign of the difference, as all are small.
constexpr int kCodeBits = 21;
constexpr std::uint64_t kGuard = std::uint64_t{1} << (kCodeBits - 1);
constexpr std::uint64_t kGuards = kGuard | kGuard << kCodeBits | kGuard << 2 * kCodeBits;
constexpr std::uint64_t kSigns = kGuards >> 1;

constexpr std::size_t kBlock = 1024;  // candidates tested at a time, which stay in the first cache
constexpr std::uint32_t kChunk = 4;   // boxes of a range that are gathered without a branch

// Steps of a lattice that fills the numbers evenly (powers of the inverse plastic number), for
// cells that are too many to have a number each.
constexpr double kLatticeY = 0.7548776662466927;
constexpr double kLatticeZ = 0.5698402909980532;

constexpr std::uint32_t latticeStep(double part, std::uint64_t cells) {
  return static_cast<std::uint32_t>(part * static_cast<double>(cells)) | 1u;
}

// True if a cell and its neighbours all have different numbers, so that no pair is found twice.
constexpr bool neighboursDiffer(std::uint64_t cells) {
  std::array<std::uint64_t, 27> numbers{};
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    numbers[i] = (i % 3 + i / 3 % 3 * latticeStep(kLatticeY, cells) +
                  i / 9 * latticeStep(kLatticeZ, cells)) &
                 (cells - 1);
    for (std::size_t j = 0; j < i; ++j) {
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

std::uint64_t codeOf(const std::array<std::int32_t, 3>& part) {
  const auto bits = [](std::int32_t value) {
    return static_cast<std::uint64_t>(static_cast<std::uint32_t>(value)) & (kGuard - 1);
  };
  return bits(part[0]) | bits(part[1]) << kCodeBits | bits(part[2]) << 2 * kCodeBits;
}

struct IndexRange {
  std::uint32_t begin = 0, end = 0;
};

// Writes at least kChunk candidates, even if there are fewer: most ranges are short, and the
// processor could not predict how short.
std::uint64_t* gather(std::uint32_t index, const IndexRange& range, std::uint64_t* out) {
  const std::uint64_t first = std::uint64_t{index} << 32 | range.begin;
  const std::uint32_t count = range.end - range.begin;
  for (std::uint32_t i = 0; i < kChunk; ++i)
    out[i] = first + i;
  for (std::uint32_t i = kChunk; i < count; ++i)
    out[i] = first + i;
  return out + count;
}

std::uint32_t firstOf(std::uint64_t candidate) {
  return static_cast<std::uint32_t>(candidate >> 32);
}

std::uint32_t secondOf(std::uint64_t candidate) {
  return static_cast<std::uint32_t>(candidate);
}

void findAmong(std::span<const SweptBox> boxes, const SweptBox& box, PairList& found) {
  found.reserve(boxes.size());
  for (const SweptBox& other : boxes)
    found.addIf(overlap(box, other), box.body, other.body);
}

}  // namespace

// Rounds towards zero, so that the two parts next to zero become one: that is quicker than rounding
// down, and of two places the greater one still has no smaller part.
HashGrid::Cell HashGrid::partAt(const std::array<float, 3>& place) const {
  return {static_cast<std::int32_t>(place[0] * partsPerMetre_),
          static_cast<std::int32_t>(place[1] * partsPerMetre_),
          static_cast<std::int32_t>(place[2] * partsPerMetre_)};
}

HashGrid::Cell HashGrid::cellAt(const std::array<float, 3>& place) const {
  const Cell part = partAt(place);
  return {part[0] >> kPartBits, part[1] >> kPartBits, part[2] >> kPartBits};
}

std::uint32_t HashGrid::numberOf(const Cell& cell) const {
  return (static_cast<std::uint32_t>(cell[0]) + strideY_ * static_cast<std::uint32_t>(cell[1]) +
          strideZ_ * static_cast<std::uint32_t>(cell[2])) &
         mask_;
}

bool HashGrid::fits(const SweptBox& box) const {
  return std::abs(box.low[0] * cellsPerMetre_) < kFarthestCell &&
         std::abs(box.low[1] * cellsPerMetre_) < kFarthestCell &&
         std::abs(box.low[2] * cellsPerMetre_) < kFarthestCell;
}

void HashGrid::build(std::span<const SweptBox> boxes, float size) {
  cellsPerMetre_ = 1.0F / std::max(kEdge * size, kLeastEdge);
  partsPerMetre_ = cellsPerMetre_ * static_cast<float>(1 << kPartBits);
  measure(boxes);
  setStrides();
  countBoxes(boxes);
  sortBoxes(boxes);
  repeatFirstCells();
}

void HashGrid::measure(std::span<const SweptBox> boxes) {
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
  occupied_ = count_ == 0 ? CellRange{} : CellRange{cellAt(low), cellAt(high)};
}

// Makes rows of at least three cells in planes of at least three rows: then the neighbours of a
// cell have different numbers (as they have on the lattice).
void HashGrid::setStrides() {
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

void HashGrid::countBoxes(std::span<const SweptBox> boxes) {
  // Reserves for as many cells as there can be at this count, so that boxes that spread later cost
  // no memory.
  const std::uint64_t most = std::max(kMostCellsPerBox * boxes.size(), kFewestCells);
  starts_.reserve(static_cast<std::size_t>(std::bit_ceil(most)) + 4);
  starts_.assign(std::size_t{mask_} + 4, 0);
  unsorted_.resize(boxes.size());
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    unsorted_[i] = fits(boxes[i]) ? numberOf(cellAt(boxes[i].low)) : kLoose;
    if (unsorted_[i] != kLoose) ++starts_[unsorted_[i]];
  }
}

void HashGrid::sortBoxes(std::span<const SweptBox> boxes) {
  std::uint32_t end = 0;
  for (std::uint32_t& start : starts_)
    start = end += start;
  boxes_.resize(count_);
  codes_.resize(count_);
  cellOf_.resize(count_);
  for (std::size_t i = boxes.size(); i-- > 0;) {
    if (unsorted_[i] == kLoose) continue;
    const std::uint32_t place = --starts_[unsorted_[i]];
    boxes_[place] = boxes[i];
    codes_[place] = {codeOf(partAt(boxes[i].low)), codeOf(partAt(boxes[i].high))};
    cellOf_[place] = unsorted_[i];
  }
}

// Repeats the boxes of the first two cells at the end, so that three cells in a row are one range
// even where the numbers wrap around.
void HashGrid::repeatFirstCells() {
  const std::size_t cells = std::size_t{mask_} + 1;
  const std::uint32_t repeated = starts_[2];
  starts_[cells + 1] = count_ + starts_[1];
  starts_[cells + 2] = count_ + repeated;
  boxes_.reserve(std::size_t{2} * count_);
  codes_.reserve(std::size_t{2} * count_);
  boxes_.resize(count_ + repeated);
  std::copy_n(boxes_.begin(), repeated, boxes_.begin() + static_cast<std::ptrdiff_t>(count_));
  codes_.resize(count_ + repeated);
  std::copy_n(codes_.begin(), repeated, codes_.begin() + static_cast<std::ptrdiff_t>(count_));
}

// Gathers the boxes in the rest of a box's cell, in the next cell, and in three cells of each of
// the four rows that follow; pairs with the boxes before it are gathered at those boxes.
void HashGrid::gatherForward(std::uint32_t index) {
  const std::uint32_t cell = cellOf_[index];
  const auto rowAt = [this, cell](std::uint32_t stride) {
    const std::uint32_t first = (cell + stride - 1) & mask_;
    return IndexRange{starts_[first], starts_[first + 3]};
  };
  const std::array<IndexRange, 5> ranges{IndexRange{index + 1, starts_[cell + 2]}, rowAt(strideY_),
                                         rowAt(strideZ_ - strideY_), rowAt(strideZ_),
                                         rowAt(strideZ_ + strideY_)};
  std::size_t most = candidateCount_ + kChunk;
  for (const IndexRange& range : ranges)
    most += range.end - range.begin;
  if (candidates_.size() < most) candidates_.resize(2 * most);
  Candidate* out = candidates_.data() + candidateCount_;
  for (const IndexRange& range : ranges)
    out = gather(index, range, out);
  candidateCount_ = most - kChunk;
}

// Compares candidates by their codes: keeps those that overlap, and a few that only nearly do.
void HashGrid::dropApart() {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < candidateCount_; ++i) {
    const Candidate candidate = candidates_[i];
    const Code& a = codes_[firstOf(candidate)];
    const Code& b = codes_[secondOf(candidate)];
    const std::uint64_t apart = ((a.high | kGuards) - b.low) | ((b.high | kGuards) - a.low);
    candidates_[kept] = candidate;
    kept += (apart & kSigns) == 0 ? 1 : 0;
  }
  candidateCount_ = kept;
}

void HashGrid::confirm(PairList& found) {
  dropApart();
  found.reserve(candidateCount_);
  for (std::size_t i = 0; i < candidateCount_; ++i) {
    const SweptBox& a = boxes_[firstOf(candidates_[i])];
    const SweptBox& b = boxes_[secondOf(candidates_[i])];
    found.addIf(overlap(a, b), a.body, b.body);
  }
  candidateCount_ = 0;
}

void HashGrid::findWithin(PairList& found) {
  for (std::uint32_t index = 0; index < count_; ++index) {
    gatherForward(index);
    if (candidateCount_ >= kBlock) confirm(found);
  }
  confirm(found);
  for (std::size_t i = 0; i < loose_.size(); ++i) {
    findAmong({boxes_.data(), count_}, loose_[i], found);
    findAmong(std::span(loose_).subspan(i + 1), loose_[i], found);
  }
}

// Returns the cells where lowest corners of boxes that overlap `box` may lie. A part is added
// because corners just below zero count as zero.
HashGrid::CellRange HashGrid::reachOf(const SweptBox& box) const {
  CellRange reach;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto low = static_cast<float>(occupied_.low[axis]);
    const auto high = static_cast<float>(occupied_.high[axis]);
    const float from = std::clamp(box.low[axis] * cellsPerMetre_ - 1.0F, low - 1.0F, high + 1.0F);
    const float to =
        std::clamp(box.high[axis] * cellsPerMetre_ + kOnePart, low - 1.0F, high + 1.0F);
    reach.low[axis] = std::max(static_cast<std::int32_t>(std::floor(from)), occupied_.low[axis]);
    reach.high[axis] = std::min(static_cast<std::int32_t>(std::floor(to)), occupied_.high[axis]);
  }
  return reach;
}

std::size_t HashGrid::costAround(const SweptBox& box) const {
  return costOf(reachOf(box)) + loose_.size();
}

std::size_t HashGrid::costOf(const CellRange& reach) const {
  const auto cells = [&](std::size_t axis) {
    return static_cast<std::uint64_t>(std::max(reach.high[axis] - reach.low[axis] + 1, 0));
  };
  if (cells(0) == 0) return 0;
  const std::uint64_t rows = cells(1) * cells(2);  // at most 2^40
  const std::uint64_t cost = rows * (kCostOfRow + cells(0));
  return static_cast<std::size_t>(std::min<std::uint64_t>(cost, count_));
}

void HashGrid::findAround(const SweptBox& box, PairList& found) const {
  findAmong(loose_, box, found);
  const CellRange reach = reachOf(box);
  const std::size_t cost = costOf(reach);
  if (cost == 0) return;
  if (cost == count_) return findAmong({boxes_.data(), count_}, box, found);
  for (std::int32_t z = reach.low[2]; z <= reach.high[2]; ++z) {
    for (std::int32_t y = reach.low[1]; y <= reach.high[1]; ++y)
      findInRow(reach, {reach.low[0], y, z}, box, found);
  }
}

// The numbers of a row may wrap around once: the row has fewer cells than there are boxes.
void HashGrid::findInRow(const CellRange& reach, Cell row, const SweptBox& box,
                         PairList& found) const {
  const std::uint32_t length = static_cast<std::uint32_t>(reach.high[0] - reach.low[0] + 1);
  const std::uint32_t first = numberOf(row);
  const std::uint32_t beforeWrap = std::min(length, mask_ + 1 - first);
  findInCells(first, first + beforeWrap, row, box, found);
  if (beforeWrap < length) findInCells(0, length - beforeWrap, row, box, found);
}

// Leaves out boxes that are there only because their cell shares the number: they are found in
// their own row.
void HashGrid::findInCells(std::uint32_t first, std::uint32_t end, Cell row, const SweptBox& box,
                           PairList& found) const {
  const std::uint32_t last = starts_[end];
  found.reserve(last - starts_[first]);
  for (std::uint32_t i = starts_[first]; i < last; ++i) {
    if (!overlap(box, boxes_[i])) continue;
    const Cell cell = cellAt(boxes_[i].low);
    found.addIf(cell[1] == row[1] && cell[2] == row[2], box.body, boxes_[i].body);
  }
}

}  // namespace carom::bullet
