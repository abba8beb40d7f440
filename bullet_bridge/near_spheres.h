#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "bullet_bridge/body_tracker.h"

namespace carom {

/// Pairs of spheres that may touch within the substep that has just ended: those whose bounding
/// boxes over the way that they went overlap, found by sort and sweep along one axis. Bullet's own
/// list of near pairs holds many times more, because its boxes are some centimetres too large.
class NearSpheres {
 public:
  using Pair = std::pair<std::size_t, std::size_t>;

  /// By index into `bodies`; valid until the next call.
  const std::vector<Pair>& find(const std::vector<TrackedBody>& bodies, double dt);

 private:
  // In single precision, rounded outwards: small, and read in order.
  struct Box {
    float low[3];  // m, world frame
    float high[3];
    std::uint32_t body = 0;
    bool movable = false;
  };

  void fillBoxes(const std::vector<TrackedBody>& bodies, double dt);
  int widestAxis() const;

  std::vector<Box> boxes_;
  std::vector<Pair> pairs_;
};

}  // namespace carom
