#pragma once

#include <span>
#include <vector>

#include "bullet_bridge/body_tracker.h"
#include "bullet_bridge/near_boxes.h"

namespace carom {

/// The boxes of all bodies over the substep that has just ended: of the way that they went, and,
/// where Bullet's solver may act on a gap, of the way on which it would have. `body` is the index
/// into the tracker's bodies. Planes and bodies that touch nothing have none.
class SweptBoxes {
 public:
  /// Valid until the next call.
  std::span<const SweptBox> of(const BodyTracker& tracker, double dt);

 private:
  std::vector<SweptBox> boxes_;
};

}  // namespace carom
