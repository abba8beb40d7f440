#pragma once

#include <vector>

#include "carom/audio/vector.h"
#include "scenes/values/camera_key.h"

namespace carom::lab {

/// Where a camera is: it looks along its -Z, with +Y up and +X to its right, as a listener does.
struct CameraPose {
  Vec3 position = Vec3::Zero();         ///< m, world frame
  Quat orientation = Quat::Identity();  ///< camera to world, unit
  double fieldOfView = 36.0;            ///< degrees, along the shorter side of the picture
};

/// The way of a camera through its key frames: exactly through each of them, without overshoot, and
/// at rest at the first and the last.
///
/// Model. Each number (position, the point that is looked at, up, the field of view, the parts of
/// the quaternion, of unit length afterwards) is a cubic Hermite curve in time, whose slope at a
/// key frame is the harmonic mean of the slopes on both sides, weighted by the lengths of the
/// stretches (Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5, 1984, 300-304), and 0 where they
/// differ in sign, and at both ends: so a number that has one value in two key frames keeps it
/// between them. Between two key frames that both look at a point, the point moves, and the camera
/// looks at it; otherwise its orientation turns. Velocities are continuous, but where the one
/// changes to the other. Immutable. [any thread]
class CameraPath {
 public:
  /// Requires at least one key frame; times ascend.
  explicit CameraPath(std::vector<scenes::CameraKey> keys);

  CameraPose at(double time) const;
  bool moves() const { return keys_.size() > 1; }

 private:
  struct Curve {
    std::vector<double> values;  // at the key frames
    std::vector<double> slopes;
  };
  Curve curveThrough(std::vector<double> values) const;
  template <class Part>
  std::vector<Curve> curvesOf(std::size_t count, const Part& part) const;
  double on(const Curve& curve, std::size_t key, double time) const;
  Vec3 vectorOn(const std::vector<Curve>& curves, std::size_t key, double time) const;

  std::vector<scenes::CameraKey> keys_;
  std::vector<Curve> position_;
  std::vector<Curve> target_;
  std::vector<Curve> up_;
  std::vector<Curve> turn_;
  Curve fieldOfView_;
};

}  // namespace carom::lab
