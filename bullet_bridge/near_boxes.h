#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "bullet_bridge/box_grid.h"

namespace carom::bullet {

/// Pairs of boxes that overlap or touch, at least one of which is active: what may meet within a
/// substep. Every pair once, its lower body first. The order of the pairs, though not sorted,
/// depends on nothing but the boxes and their order. A box that is not finite has no pairs.
///
/// Boxes of similar size share a level, which has a grid for the active ones and one for the
/// others; between levels the boxes of the one are looked up in the grid of the other. Memory is
/// kept, so that nothing is allocated once the scene has been as crowded as it gets.
class NearBoxes {
 public:
  using Pair = PairList::Pair;

  /// Valid until the next call.
  std::span<const Pair> find(std::span<const SweptBox> boxes);

 private:
  // Boxes of one level, all active or none.
  struct Group {
    std::vector<SweptBox> boxes;
    BoxGrid grid;
    bool built = false;
  };
  struct Level {
    float size = 0.0F;  // m, of its largest box
    Group active;
    Group inactive;
  };

  // What the boxes of one power of two have in common.
  struct Octave {
    std::size_t count = 0;
    float size = 0.0F;      // m, largest
    std::size_t level = 0;  // where they belong
  };

  void measure(std::span<const SweptBox> boxes);
  void setLevels();
  void distribute(std::span<const SweptBox> boxes);
  BoxGrid& gridOf(const Level& level, Group& group);
  void findBetween(const Level& large, Group& largeBoxes, const Level& small, Group& smallBoxes);
  void findAcross(const Group& group, const BoxGrid& grid);

  std::array<Octave, 256> octaves_{};  // by the exponent of a float
  SweptBox reach_;                     // around all active boxes
  std::vector<Level> levels_;          // from large to small; those after the count are spare
  std::size_t levelCount_ = 0;
  PairList found_;
};

}  // namespace carom::bullet
