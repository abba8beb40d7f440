#include "bullet_bridge/near_spheres.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace carom {
namespace {

// Doubles become floats with a relative error of 2^-24.
constexpr float kOutwards = std::numeric_limits<float>::epsilon();

constexpr float kBoxesPerStrip = 2.0F;  // width of a strip, in boxes

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
    Box box;
    box.body = static_cast<std::uint32_t>(i);
    box.movable = body.inverseMass > 0.0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto component = static_cast<Eigen::Index>(axis);
      const double start = motion.start[component];
      const double end = start + dt * motion.velocityAfter[component];
      // Between its ends a parabola leaves their range by up to a dt^2 / 8.
      const double reach = body.radius + 0.125 * dt * dt * std::abs(motion.acceleration[component]);
      box.low[axis] = roundedDown(std::min(start, end) - reach);
      box.high[axis] = roundedUp(std::max(start, end) + reach);
    }
    const auto finite = [](float value) { return std::isfinite(value); };
    if (std::all_of(box.low.begin(), box.low.end(), finite) &&
        std::all_of(box.high.begin(), box.high.end(), finite)) {
      boxes_.push_back(box);
    }
  }
}

// The sweep goes where the spheres are spread the most, so that the fewest of them share a place;
// the strips lie across the next axis, each wide enough that few boxes reach into two.
void NearSpheres::chooseAxes() {
  std::array<float, 3> least{};
  std::array<float, 3> range{};
  std::array<float, 3> extent{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto [low, high] = std::minmax_element(
        boxes_.begin(), boxes_.end(),
        [axis](const Box& a, const Box& b) { return a.low[axis] < b.low[axis]; });
    least[axis] = low->low[axis];
    range[axis] = high->low[axis] - low->low[axis];
    for (const Box& box : boxes_)
      extent[axis] += box.high[axis] - box.low[axis];
  }
  sweep_ = static_cast<std::size_t>(std::max_element(range.begin(), range.end()) - range.begin());
  across_ = range[(sweep_ + 1) % 3] > range[(sweep_ + 2) % 3] ? (sweep_ + 1) % 3 : (sweep_ + 2) % 3;

  const auto count = static_cast<float>(boxes_.size());
  const float wanted = range[across_] * count / (kBoxesPerStrip * extent[across_]);
  // Where all boxes are points in one place, `wanted` is not a number: then one strip, too.
  const auto strips = static_cast<std::size_t>(wanted > 1.0F ? std::min(wanted, count) : 1.0F);
  firstStrip_ = least[across_];
  stripWidth_ = range[across_] / static_cast<float>(strips);
  if (strips_.size() < strips) strips_.resize(strips);
  stripCount_ = strips;
  for (std::size_t strip = 0; strip < strips; ++strip)
    strips_[strip].clear();
}

std::size_t NearSpheres::stripOf(float place) const {
  if (!(stripWidth_ > 0.0F)) return 0;
  const float strip =
      std::clamp((place - firstStrip_) / stripWidth_, 0.0F, static_cast<float>(stripCount_ - 1));
  return static_cast<std::size_t>(strip);
}

// Against what the sweep has reached and not passed in this strip.
void NearSpheres::visit(std::uint32_t index, std::size_t strip) {
  const Box& box = boxes_[index];
  const std::size_t third = 3 - sweep_ - across_;
  std::vector<std::uint32_t>& open = strips_[strip];
  for (std::size_t i = 0; i < open.size();) {
    const Box& other = boxes_[open[i]];
    if (other.high[sweep_] < box.low[sweep_]) {
      open[i] = open.back();
      open.pop_back();
      continue;
    }
    ++i;
    if (box.low[across_] > other.high[across_] || other.low[across_] > box.high[across_]) continue;
    if (box.low[third] > other.high[third] || other.low[third] > box.high[third]) continue;
    if (!box.movable && !other.movable) continue;
    // Two boxes may share several strips; the pair counts in the first.
    if (stripOf(std::max(box.low[across_], other.low[across_])) != strip) continue;
    pairs_.emplace_back(other.body, box.body);
  }
  open.push_back(index);
}

const std::vector<NearSpheres::Pair>& NearSpheres::find(const std::vector<TrackedBody>& bodies,
                                                        double dt) {
  pairs_.clear();
  fillBoxes(bodies, dt);
  if (boxes_.size() < 2) return pairs_;
  chooseAxes();
  std::sort(boxes_.begin(), boxes_.end(), [this](const Box& a, const Box& b) {
    return a.low[sweep_] != b.low[sweep_] ? a.low[sweep_] < b.low[sweep_] : a.body < b.body;
  });
  for (std::uint32_t index = 0; index < boxes_.size(); ++index) {
    const std::size_t last = stripOf(boxes_[index].high[across_]);
    for (std::size_t strip = stripOf(boxes_[index].low[across_]); strip <= last; ++strip) {
      visit(index, strip);
    }
  }
  return pairs_;
}

}  // namespace carom
