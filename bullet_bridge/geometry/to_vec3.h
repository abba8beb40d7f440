#pragma once

#include <LinearMath/btTransform.h>
#include <LinearMath/btVector3.h>

#include "carom/audio/vector.h"

namespace carom::bullet {

inline Vec3 toVec3(const btVector3& v) {
  return {static_cast<double>(v.x()), static_cast<double>(v.y()), static_cast<double>(v.z())};
}

inline Quat toQuat(const btMatrix3x3& basis) {
  btQuaternion q;
  basis.getRotation(q);
  return Quat(static_cast<double>(q.w()), static_cast<double>(q.x()), static_cast<double>(q.y()),
              static_cast<double>(q.z()))
      .normalized();
}
inline Quat toQuat(const btTransform& pose) {
  return toQuat(pose.getBasis());
}

}  // namespace carom::bullet
