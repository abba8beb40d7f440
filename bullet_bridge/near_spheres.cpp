#include "bullet_bridge/near_spheres.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace carom {
namespace {

// Doubles become floats with a relative error of 2^-24.
constexpr float kOutwards = std::numeric_limits<float>::epsilon();

float roundedDown(double value) {
  const auto nearest = static_cast<float>(value);
  return nearest - kOutwards * std::abs(nearest);
}

float roundedUp(double value) {
  const auto nearest = static_cast<float>(value);
  return nearest + kOutwards * std::abs(nearest);
}

}  // namespace

void NearSpheres::fillBoxes(const std::vector<TrackedBody>& bodies, double dt) {
  boxes_.clear();
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const TrackedBody& body = bodies[i];
    const SubstepMotion& motion = body.current;
    if (body.shape != ContactShape::sphere || !motion.known) continue;
    Box& box = boxes_.emplace_back();
    box.body = static_cast<std::uint32_t>(i);
    box.movable = body.inverseMass > 0.0;
    for (int axis = 0; axis < 3; ++axis) {
      const double start = motion.start[axis];
      const double end = start + dt * motion.velocityAfter[axis];
      // Between its ends a parabola leaves their range by up to a dt^2 / 8.
      const double reach = body.radius + 0.125 * dt * dt * std::abs(motion.acceleration[axis]);
      box.low[axis] = roundedDown(std::min(start, end) - reach);
      box.high[axis] = roundedUp(std::max(start, end) + reach);
    }
  }
}

// Along which the spheres are spread the most, so that the fewest of them share a place.
int NearSpheres::widestAxis() const {
  int widest = 0;
  float widestRange = -1.0F;
  for (int axis = 0; axis < 3; ++axis) {
    const auto [least, most] = std::minmax_element(
        boxes_.begin(), boxes_.end(),
        [axis](const Box& a, const Box& b) { return a.low[axis] < b.low[axis]; });
    const float range = most->low[axis] - least->low[axis];
    if (range <= widestRange) continue;
    widest = axis;
    widestRange = range;
  }
  return widest;
}

const std::vector<NearSpheres::Pair>& NearSpheres::find(const std::vector<TrackedBody>& bodies,
                                                        double dt) {
  pairs_.clear();
  fillBoxes(bodies, dt);
  if (boxes_.size() < 2) return pairs_;
  const int axis = widestAxis();
  const int second = (axis + 1) % 3;
  const int third = (axis + 2) % 3;
  std::sort(boxes_.begin(), boxes_.end(), [axis](const Box& a, const Box& b) {
    return a.low[axis] != b.low[axis] ? a.low[axis] < b.low[axis] : a.body < b.body;
  });
  for (auto box = boxes_.begin(); box != boxes_.end(); ++box) {
    for (auto other = box + 1; other != boxes_.end() && other->low[axis] <= box->high[axis];
         ++other) {
      if (box->low[second] > other->high[second] || other->low[second] > box->high[second])
        continue;
      if (box->low[third] > other->high[third] || other->low[third] > box->high[third]) continue;
      if (box->movable || other->movable) pairs_.emplace_back(box->body, other->body);
    }
  }
  return pairs_;
}

}  // namespace carom
