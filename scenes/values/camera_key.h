#pragma once

#include "carom/audio/vector.h"

namespace carom::scenes {

/// A key frame of the camera of a film. It looks along its -Z with +Y up, as a listener does.
struct CameraKey {
  double time = 0.0;                    ///< s, of the scene; ascending
  Vec3 position = Vec3::Zero();         ///< m, world frame
  Quat orientation = Quat::Identity();  ///< camera to world, unit
  bool hasTarget = false;               ///< it looks at a point
  Vec3 target = Vec3::Zero();           ///< m, world frame; that point, if it looks at one
  Vec3 up = Vec3::UnitY();              ///< world frame, of any length; counts with a target
  double fieldOfView = 36.0;            ///< degrees, along the shorter side of the picture
};

}  // namespace carom::scenes
