#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace carom {

/// Box around the way of a body over a substep; low <= high.
struct SweptBox {
  std::array<float, 3> low{};   ///< m, world frame, rounded down
  std::array<float, 3> high{};  ///< m, world frame, rounded up
  std::uint32_t body = 0;       ///< number by which pairs name it
  bool active = false;          ///< false: immovable or asleep
};

/// Whether the boxes overlap or touch.
inline bool overlap(const SweptBox& a, const SweptBox& b) {
  // Without branches, which no processor could foretell here.
  const auto apart = [&](std::size_t axis) {
    return static_cast<unsigned>(a.low[axis] > b.high[axis]) |
           static_cast<unsigned>(b.low[axis] > a.high[axis]);
  };
  return (apart(0) | apart(1) | apart(2)) == 0;
}

/// Pairs found so far; its memory stays for the next substep.
class PairList {
 public:
  using Pair = std::pair<std::uint32_t, std::uint32_t>;  ///< the lower number first

  void clear() { count_ = 0; }
  /// Room for so many calls of `addIf`.
  void reserve(std::size_t more) {
    if (pairs_.size() < count_ + more) pairs_.resize(2 * (count_ + more));
  }
  void addIf(bool wanted, std::uint32_t a, std::uint32_t b) {
    pairs_[count_] = a < b ? Pair{a, b} : Pair{b, a};
    count_ += wanted ? 1 : 0;
  }
  std::span<const Pair> pairs() const { return {pairs_.data(), count_}; }

 private:
  std::vector<Pair> pairs_;
  std::size_t count_ = 0;
};

/// Boxes of similar size, sorted into cubic cells no smaller than they are: each lies in the cell
/// of its lowest corner, so two that overlap lie in neighbouring cells.
///
/// Cells are numbered x + strideY y + strideZ z, modulo a power of two: where they fit in there
/// each has its own number, and elsewhere some that are far from each other share one, so that the
/// cost does not depend on how far the boxes are spread.
class BoxGrid {
 public:
  /// No box may be larger than `size`, in m, along an axis.
  void build(std::span<const SweptBox> boxes, float size);
  /// All pairs among them.
  void findWithin(PairList& found) const;
  /// All pairs of one of them with `box`, which may be of any size.
  void findAround(const SweptBox& box, PairList& found) const;
  /// About how many boxes `findAround` looks at, or what costs as much.
  std::size_t costAround(const SweptBox& box) const;

 private:
  using Cell = std::array<std::int32_t, 3>;
  struct Range {
    Cell low{}, high{};
  };

  // Whether rounding leaves it within reach of the cells next to its own.
  bool fits(const SweptBox& box) const;
  Cell cellAt(const std::array<float, 3>& place) const;
  std::uint32_t numberOf(const Cell& cell) const;
  void measure(std::span<const SweptBox> boxes);
  void setStrides();
  void countBoxes(std::span<const SweptBox> boxes);
  void sortBoxes(std::span<const SweptBox> boxes);
  void repeatFirstCells();
  void findForward(std::uint32_t index, PairList& found) const;
  void findInRow(const Range& reach, Cell first, const SweptBox& box, PairList& found) const;
  void findInCells(std::uint32_t first, std::uint32_t end, Cell row, const SweptBox& box,
                   PairList& found) const;
  Range reachOf(const SweptBox& box) const;
  std::size_t costOf(const Range& reach) const;

  float cellsPerMetre_ = 0.0F;
  std::uint32_t strideY_ = 0;
  std::uint32_t strideZ_ = 0;
  std::uint32_t mask_ = 0;               // number of cells - 1
  Range occupied_;                       // by lowest corners
  std::uint32_t count_ = 0;              // boxes in cells
  std::vector<SweptBox> boxes_;          // by cell, then as they came; the first two cells' again
  std::vector<std::uint32_t> cellOf_;    // number, of each of `boxes_`
  std::vector<std::uint32_t> starts_;    // of each cell in `boxes_`, and of three more
  std::vector<std::uint32_t> unsorted_;  // number of the cell of each box as it came
  std::vector<SweptBox> loose_;          // too far out for the numbers of cells
};

}  // namespace carom
