#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "bullet_bridge/broad_phase/hash_grid.h"

namespace carom::bullet {

/// Finds pairs of boxes that overlap or touch, at least one of which is active: the bodies that may
/// meet within a substep. Every pair is found once, its lower body first. The order of the pairs,
/// though not sorted, depends on nothing but the boxes and their order. A box that is not finite
/// has no pairs.
///
/// Boxes of similar size share a level, which has a grid for the active ones and one for the
/// others; between levels the boxes of the one are looked up in the grid of the other. Memory is
/// kept, so that nothing is allocated once the scene has been as crowded as it gets.
class HierarchicalGrid {
 public:
  using Pair = PairList::Pair;

  /// The result is valid until the next call.
  std::span<const Pair> find(std::span<const SweptBox> boxes);

 private:
  // The boxes of one level, all active or none.
  struct Group {
    std::vector<SweptBox> boxes;
    HashGrid grid;
    bool built = false;
  };
  struct Level {
    float size = 0.0F;  // m, of its largest box
    Group active;
    Group inactive;
  };

  // The boxes whose sizes share a power of two.
  struct Octave {
    std::size_t count = 0;
    float size = 0.0F;      // m, largest
    std::size_t level = 0;  // index of the level that they belong to
  };

  void measure(std::span<const SweptBox> boxes);
  void setLevels();
  void distribute(std::span<const SweptBox> boxes);
  HashGrid& gridOf(const Level& level, Group& group);
  void findBetween(const Level& large, Group& largeBoxes, const Level& small, Group& smallBoxes);
  void findAcross(const Group& group, const HashGrid& grid);

  std::array<Octave, 256> octaves_{};  // indexed by the exponent of a float
  SweptBox reach_;                     // around all active boxes
  std::vector<Level> levels_;  // sorted from large to small; those after levelCount_ are spare
  std::size_t levelCount_ = 0;
  PairList found_;
};

}  // namespace carom::bullet
