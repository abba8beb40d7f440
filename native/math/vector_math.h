#pragma once

#include <cmath>

#include "carom/audio/vector.h"

namespace carom::native {

// Products of vectors in a fixed order of operations. Eigen may add in another order when it
// vectorises, so the last bit would depend on the compiler's target. Internal to native/. [any
// thread]

/// The dot product x x' + y y' + z z', added from left to right.
inline double dotInOrder(const Vec3& left, const Vec3& right) noexcept {
  return left.x() * right.x() + left.y() * right.y() + left.z() * right.z();
}

inline double lengthOf(const Vec3& vector) noexcept {
  return std::sqrt(dotInOrder(vector, vector));
}

inline Vec3 cross(const Vec3& left, const Vec3& right) noexcept {
  return {left.y() * right.z() - left.z() * right.y(), left.z() * right.x() - left.x() * right.z(),
          left.x() * right.y() - left.y() * right.x()};
}

}  // namespace carom::native
