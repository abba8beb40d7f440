#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "bullet_bridge/broad_phase/pair_list.h"
#include "bullet_bridge/broad_phase/swept_box.h"

namespace carom::bullet {

/// A grid of boxes of similar size, sorted into cubic cells no smaller than they are: each lies in
/// the cell of its lowest corner, so two that overlap lie in neighbouring cells.
///
/// Cells are numbered x + strideY y + strideZ z, modulo a power of two. If all cells fit below it,
/// each has its own number; otherwise some that are far from each other share one, so that the cost
/// does not depend on how far the boxes are spread.
///
/// Branches that the processor cannot predict cost the most time, so the pairs of neighbours are
/// first written down and then tested, both without branches; and the first test, which most of
/// them fail, takes four instructions on words that hold three coordinates.
class HashGrid {
 public:
  /// No box may be larger than `size`, in m, along an axis.
  void build(std::span<const SweptBox> boxes, float size);
  /// Adds all pairs of boxes of the grid that overlap. Not const only because of the memory that it
  /// uses.
  void findWithin(PairList& found);
  /// Adds all pairs of a box of the grid with `box`, which may be of any size.
  void findAround(const SweptBox& box, PairList& found) const;
  /// Estimates how many boxes `findAround` looks at, or work that costs as much.
  std::size_t costAround(const SweptBox& box) const;

 private:
  using Cell = std::array<std::int32_t, 3>;
  // Both corners of a box, each in one word: three coordinates in parts of a cell, modulo 2^20.
  struct Code {
    std::uint64_t low = 0, high = 0;
  };
  // Two indices into `boxes_`, in one word.
  using Candidate = std::uint64_t;
  struct CellRange {
    Cell low{}, high{};
  };

  // True if the box's cell has a number, and rounding leaves the box within that cell and the next.
  bool fits(const SweptBox& box) const;
  Cell partAt(const std::array<float, 3>& place) const;
  Cell cellAt(const std::array<float, 3>& place) const;
  std::uint32_t numberOf(const Cell& cell) const;
  void measure(std::span<const SweptBox> boxes);
  void setStrides();
  void countBoxes(std::span<const SweptBox> boxes);
  void sortBoxes(std::span<const SweptBox> boxes);
  void repeatFirstCells();
  void gatherForward(std::uint32_t index);
  void dropApart();
  void confirm(PairList& found);
  void findInRow(const CellRange& reach, Cell row, const SweptBox& box, PairList& found) const;
  void findInCells(std::uint32_t first, std::uint32_t end, Cell row, const SweptBox& box,
                   PairList& found) const;
  CellRange reachOf(const SweptBox& box) const;
  std::size_t costOf(const CellRange& reach) const;

  float cellsPerMetre_ = 0.0F;
  float partsPerMetre_ = 0.0F;
  std::uint32_t strideY_ = 0;
  std::uint32_t strideZ_ = 0;
  std::uint32_t mask_ = 0;               // number of cells - 1
  CellRange occupied_;                   // cells that hold lowest corners
  std::uint32_t count_ = 0;              // boxes in cells
  std::vector<SweptBox> boxes_;          // sorted by cell, then as they came; cells 0 and 1 again
  std::vector<Code> codes_;              // one for each of `boxes_`
  std::vector<std::uint32_t> cellOf_;    // cell number of each of `boxes_`
  std::vector<std::uint32_t> starts_;    // first of `boxes_` in each cell; three more at the end
  std::vector<std::uint32_t> unsorted_;  // cell number of each box, as they came
  std::vector<SweptBox> loose_;          // boxes that do not fit
  std::vector<Candidate> candidates_;    // pairs of neighbours that are yet to be tested
  std::size_t candidateCount_ = 0;
};

}  // namespace carom::bullet
