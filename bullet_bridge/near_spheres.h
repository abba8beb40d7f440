#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "bullet_bridge/body_tracker.h"

namespace carom {

/// Pairs of spheres that may touch within the substep that has just ended: those whose bounding
/// boxes over the way that they went overlap, found by a sweep along one axis in strips across
/// another. Bullet's own list of near pairs holds many times more, because its boxes are some
/// centimetres too large. A sphere that is not at a finite place has no pairs.
class NearSpheres {
 public:
  using Pair = std::pair<std::size_t, std::size_t>;

  /// By index into `bodies`; valid until the next call.
  const std::vector<Pair>& find(const std::vector<TrackedBody>& bodies, double dt);

 private:
  // In single precision, rounded outwards: small, and read in order.
  struct Box {
    std::array<float, 3> low{};  // m, world frame
    std::array<float, 3> high{};
    std::uint32_t body = 0;
    bool movable = false;
  };

  void fillBoxes(const std::vector<TrackedBody>& bodies, double dt);
  void chooseAxes();
  std::size_t stripOf(float place) const;
  void visit(std::uint32_t box, std::size_t strip);

  std::vector<Box> boxes_;
  std::size_t sweep_ = 0;    // axis along which the boxes are visited
  std::size_t across_ = 1;   // axis that the strips divide
  float firstStrip_ = 0.0F;  // m, where it begins
  std::size_t stripCount_ = 1;
  float stripWidth_ = 1.0F;                         // m
  std::vector<std::vector<std::uint32_t>> strips_;  // boxes that the sweep has not passed yet
  std::vector<Pair> pairs_;
};

}  // namespace carom
