#pragma once

#include <LinearMath/btVector3.h>

#include "carom/audio/vector.h"

namespace carom::bullet {

inline Vec3 toVec3(const btVector3& v) {
  return {static_cast<double>(v.x()), static_cast<double>(v.y()), static_cast<double>(v.z())};
}

}  // namespace carom::bullet
