#pragma once

#include <LinearMath/btVector3.h>

#include "carom/audio/vector.h"

namespace carom {

inline btScalar scalar(double value) {
  return static_cast<btScalar>(value);
}
inline btVector3 bt(const Vec3& v) {
  return {scalar(v.x()), scalar(v.y()), scalar(v.z())};
}
inline Vec3 vec(const btVector3& v) {
  return {double(v.x()), double(v.y()), double(v.z())};
}

}  // namespace carom
