#include "lab/video/camera_path.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "scenes/values/aim.h"

namespace carom::lab {

using scenes::CameraKey;

CameraPath::CameraPath(std::vector<CameraKey> keys) : keys_(std::move(keys)) {
  assert(!keys_.empty());
  // A quaternion and its negative are one orientation: the nearer to the last one counts.
  for (std::size_t key = 1; key < keys_.size(); ++key)
    if (keys_[key].orientation.dot(keys_[key - 1].orientation) < 0.0)
      keys_[key].orientation.coeffs() *= -1.0;
  const auto axis = [](const Vec3& vector, std::size_t part) {
    return vector[static_cast<Eigen::Index>(part)];
  };
  position_ =
      curvesOf(3, [&](const CameraKey& key, std::size_t part) { return axis(key.position, part); });
  target_ = curvesOf(3, [&](const CameraKey& key, std::size_t part) {
    return axis(key.hasTarget ? key.target : key.position, part);
  });
  up_ = curvesOf(
      3, [&](const CameraKey& key, std::size_t part) { return axis(key.up.normalized(), part); });
  turn_ = curvesOf(4, [](const CameraKey& key, std::size_t part) {
    return key.orientation.coeffs()[static_cast<Eigen::Index>(part)];
  });
  fieldOfView_ = std::move(
      curvesOf(1, [](const CameraKey& key, std::size_t) { return key.fieldOfView; }).front());
}

template <class Part>
std::vector<CameraPath::Curve> CameraPath::curvesOf(std::size_t count, const Part& part) const {
  std::vector<Curve> curves;
  for (std::size_t index = 0; index < count; ++index) {
    std::vector<double> values;
    for (const CameraKey& key : keys_)
      values.push_back(part(key, index));
    curves.push_back(curveThrough(std::move(values)));
  }
  return curves;
}

CameraPath::Curve CameraPath::curveThrough(std::vector<double> values) const {
  Curve curve{std::move(values), std::vector<double>(keys_.size(), 0.0)};
  for (std::size_t key = 1; key + 1 < keys_.size(); ++key) {
    const double before = keys_[key].time - keys_[key - 1].time;
    const double after = keys_[key + 1].time - keys_[key].time;
    const double slopeBefore = (curve.values[key] - curve.values[key - 1]) / before;
    const double slopeAfter = (curve.values[key + 1] - curve.values[key]) / after;
    if (!(slopeBefore * slopeAfter > 0.0)) continue;
    const double share = (before + 2.0 * after) / (3.0 * (before + after));
    curve.slopes[key] =
        slopeBefore * slopeAfter / (share * slopeAfter + (1.0 - share) * slopeBefore);
  }
  return curve;
}

/// Returns a curve's value between a key frame and the next.
double CameraPath::on(const Curve& curve, std::size_t key, double time) const {
  if (key + 1 >= keys_.size()) return curve.values.back();
  const double span = keys_[key + 1].time - keys_[key].time;
  const double s = (time - keys_[key].time) / span;
  const double rise = s * s * (3.0 - 2.0 * s);
  return (1.0 - rise) * curve.values[key] + rise * curve.values[key + 1] +
         span * s * (1.0 - s) * ((1.0 - s) * curve.slopes[key] - s * curve.slopes[key + 1]);
}

Vec3 CameraPath::vectorOn(const std::vector<Curve>& curves, std::size_t key, double time) const {
  return {on(curves[0], key, time), on(curves[1], key, time), on(curves[2], key, time)};
}

CameraPose CameraPath::at(double time) const {
  const double clamped = std::clamp(time, keys_.front().time, keys_.back().time);
  const auto after = std::ranges::upper_bound(keys_, clamped, {}, &CameraKey::time);
  const auto key = static_cast<std::size_t>(after - keys_.begin() - 1);
  CameraPose pose;
  pose.position = vectorOn(position_, key, clamped);
  pose.fieldOfView = on(fieldOfView_, key, clamped);
  const bool isLast = key + 1 >= keys_.size();
  if (!isLast && keys_[key].hasTarget && keys_[key + 1].hasTarget) {
    const auto aimed = scenes::orientationTowards(vectorOn(target_, key, clamped) - pose.position,
                                                  vectorOn(up_, key, clamped));
    if (aimed) {
      pose.orientation = *aimed;
      return pose;
    }
  }
  pose.orientation = Quat(on(turn_[3], key, clamped), on(turn_[0], key, clamped),
                          on(turn_[1], key, clamped), on(turn_[2], key, clamped))
                         .normalized();
  return pose;
}

}  // namespace carom::lab
