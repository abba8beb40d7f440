#include "audio/contact_drive.h"

#include <algorithm>
#include <cmath>

namespace carom {
namespace {

/// Nodes while a contact passes over its own width.
constexpr double kNodesPerWidth = 8.0;
/// Samples between two nodes, at most.
constexpr double kSparsest = 16.0;
/// By how much another axis must be nearer to the normal to be looked along instead.
constexpr double kTurned = 1.2;
/// m: they part no further, so that they can meet again.
constexpr double kFarthest = 1.0;

int axisOf(const Vec3& normal, int before) {
  Eigen::Index nearest = 0;
  normal.cwiseAbs().maxCoeff(&nearest);
  if (before >= 0 && std::abs(normal[nearest]) < kTurned * std::abs(normal[before])) return before;
  return static_cast<int>(nearest);
}

Eigen::Vector2d projected(const Vec3& point, int axis) {
  return {point[(axis + 1) % 3], point[(axis + 2) % 3]};
}

}  // namespace

/// m/s, at which the bumps push the bodies apart, that share of the step after its begin.
double ContactDrive::slopeSpeed(const Step& step, double share) const {
  double speed = 0.0;
  for (std::size_t side = 0; side < step.surfaces.size(); ++side) {
    const ScannedSurface& surface = step.surfaces[side];
    if (surface.texture == nullptr) continue;
    const Eigen::Vector2d from = projected(surface.from, axes_[side]);
    const Eigen::Vector2d along = projected(surface.to, axes_[side]) - from;
    const double perSample = along.norm() / (step.duration * step.sampleRate);
    speed +=
        surface.texture->slope(from + share * along, std::max(step.width, perSample)).dot(along) /
        step.duration;
  }
  return speed;
}

/// The bodies' relative speed after dt in which the bumps push at `pushed`.
double ContactDrive::follow(const Step& step, double pushed, double dt) {
  const double fall = step.load / step.mass * dt;
  if (!parted_ && pushed >= speed_ - fall) return pushed;
  parted_ = true;
  const double speed = speed_ - fall;
  gap_ = std::min(gap_ + (speed - pushed) * dt, kFarthest);
  if (gap_ > 0.0) return speed;
  gap_ = 0.0;
  const double rebound = step.restitution * std::max(0.0, pushed - speed);
  parted_ = rebound > fall;
  return parted_ ? pushed + rebound : pushed;
}

void ContactDrive::advance(const Step& step, std::vector<PulseNode>& nodes) {
  nodes.clear();
  double farthest = 0.0;
  for (const ScannedSurface& surface : step.surfaces)
    if (surface.texture != nullptr)
      farthest = std::max(farthest, (surface.to - surface.from).norm());
  const double fastest = farthest / step.duration;
  if (!(fastest >= (sounds_ ? 0.5 : 1.0) * kSlowest) || fastest > kFastest) return restart();
  for (std::size_t side = 0; side < axes_.size(); ++side)
    axes_[side] = axisOf(step.surfaces[side].normal, axes_[side]);
  const double samples = step.duration * step.sampleRate;
  const double wanted =
      std::clamp(kNodesPerWidth * farthest / step.width, samples / kSparsest, samples);
  const auto count = static_cast<std::size_t>(std::ceil(wanted));
  const double dt = step.duration / static_cast<double>(count);
  if (!sounds_) speed_ = slopeSpeed(step, 0.5 / static_cast<double>(count));
  sounds_ = true;
  nodes.reserve(count + Pulse::kRulePadding);
  for (std::size_t index = 0; index < count; ++index) {
    const double share = static_cast<double>(index) / static_cast<double>(count);
    const double before = speed_;
    speed_ = follow(step, slopeSpeed(step, share + 0.5 / static_cast<double>(count)), dt);
    nodes.push_back({share, step.mass * (speed_ - before)});
  }
  nodes.resize(count + Pulse::kRulePadding, {1.0, 0.0});
}

}  // namespace carom
