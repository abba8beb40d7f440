#include "bullet_bridge/broad_phase/hierarchical_grid.h"

#include <algorithm>
#include <bit>
#include <limits>

namespace carom::bullet {
namespace {

constexpr float kMostSpread = 4.0F;     // largest ratio of sizes within a level
constexpr std::size_t kOutweighs = 16;  // small boxes, more than this times the larger, get a level
constexpr std::size_t kCostOfLookUp = 20;  // per box in a grid of larger ones, in overlap tests

bool isFinite(const SweptBox& box) {
  // The sum is zero, or not a number if a coordinate is not finite.
  return 0.0F * box.low[0] + 0.0F * box.low[1] + 0.0F * box.low[2] + 0.0F * box.high[0] +
             0.0F * box.high[1] + 0.0F * box.high[2] ==
         0.0F;
}

float sizeOf(const SweptBox& box) {
  return std::max(
      {box.high[0] - box.low[0], box.high[1] - box.low[1], box.high[2] - box.low[2], 0.0F});
}

std::size_t octaveOf(float size) {
  return std::bit_cast<std::uint32_t>(size) >> 23;
}

}  // namespace

void HierarchicalGrid::measure(std::span<const SweptBox> boxes) {
  octaves_.fill({});
  reach_.low.fill(std::numeric_limits<float>::max());
  reach_.high.fill(std::numeric_limits<float>::lowest());
  for (const SweptBox& box : boxes) {
    if (!isFinite(box)) continue;
    const float size = sizeOf(box);
    Octave& octave = octaves_[octaveOf(size)];
    ++octave.count;
    octave.size = std::max(octave.size, size);
    if (!box.active) continue;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      reach_.low[axis] = std::min(reach_.low[axis], box.low[axis]);
      reach_.high[axis] = std::max(reach_.high[axis], box.high[axis]);
    }
  }
}

// Cells are as large as the largest box of the level, so a few large boxes would crowd the cells of
// many small ones.
void HierarchicalGrid::setLevels() {
  levelCount_ = 0;
  std::size_t shared = 0;  // boxes in the level so far
  for (std::size_t i = octaves_.size(); i-- > 0;) {
    Octave& octave = octaves_[i];
    if (octave.count == 0) continue;
    if (levelCount_ == 0 || kMostSpread * octave.size < levels_[levelCount_ - 1].size ||
        octave.count > kOutweighs * shared) {
      if (levels_.size() == levelCount_) levels_.emplace_back();
      levels_[levelCount_++].size = octave.size;
      shared = 0;
    }
    octave.level = levelCount_ - 1;
    shared += octave.count;
  }
}

void HierarchicalGrid::distribute(std::span<const SweptBox> boxes) {
  for (Level& level : levels_) {
    level.active.boxes.clear();
    level.active.built = false;
    level.inactive.boxes.clear();
    level.inactive.built = false;
  }
  for (const SweptBox& box : boxes) {
    if (!isFinite(box) || !overlap(box, reach_)) continue;
    Level& level = levels_[octaves_[octaveOf(sizeOf(box))].level];
    std::vector<SweptBox>& group = (box.active ? level.active : level.inactive).boxes;
    if (group.empty()) group.reserve(boxes.size());
    group.push_back(box);
  }
}

HashGrid& HierarchicalGrid::gridOf(const Level& level, Group& group) {
  if (!group.built) group.grid.build(group.boxes, level.size);
  group.built = true;
  return group.grid;
}

void HierarchicalGrid::findAcross(const Group& group, const HashGrid& grid) {
  for (const SweptBox& box : group.boxes)
    grid.findAround(box, found_);
}

// Looks up each small box in the grid of the large ones, or each large one in the grid of the small
// ones, where it may cover many cells: whichever costs less.
void HierarchicalGrid::findBetween(const Level& large, Group& largeBoxes, const Level& small,
                                   Group& smallBoxes) {
  if (largeBoxes.boxes.empty() || smallBoxes.boxes.empty()) return;
  const HashGrid& grid = gridOf(small, smallBoxes);
  const std::size_t limit = kCostOfLookUp * smallBoxes.boxes.size();
  std::size_t cost = 0;
  for (const SweptBox& box : largeBoxes.boxes) {
    cost += grid.costAround(box);
    if (cost > limit) return findAcross(smallBoxes, gridOf(large, largeBoxes));
  }
  findAcross(largeBoxes, grid);
}

std::span<const HierarchicalGrid::Pair> HierarchicalGrid::find(std::span<const SweptBox> boxes) {
  found_.clear();
  measure(boxes);
  setLevels();
  distribute(boxes);
  for (std::size_t i = 0; i < levelCount_; ++i) {
    Level& large = levels_[i];
    if (!large.active.boxes.empty()) gridOf(large, large.active).findWithin(found_);
    findBetween(large, large.active, large, large.inactive);
    for (std::size_t j = i + 1; j < levelCount_; ++j) {
      Level& small = levels_[j];
      findBetween(large, large.active, small, small.active);
      findBetween(large, large.active, small, small.inactive);
      findBetween(large, large.inactive, small, small.active);
    }
  }
  return found_.pairs();
}

}  // namespace carom::bullet
