#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>

#include "bullet_bridge/bodies/body_tracker.h"

namespace carom::bullet {

/// Two bodies that may touch. `other` is the one that cannot be moved, if there is one; in a pair
/// of a sphere and a plane it is the plane.
struct ContactPair {
  const TrackedBody* body = nullptr;
  const TrackedBody* other = nullptr;

  static ContactPair of(const TrackedBody& first, const TrackedBody& second) {
    const auto rank = [](const TrackedBody& one) {
      return std::pair(one.shape == ContactShape::plane,
                       one.kind == BodyKind::fixed || one.kind == BodyKind::kinematic);
    };
    return rank(second) < rank(first) ? ContactPair{&second, &first} : ContactPair{&first, &second};
  }

  /// True for spheres and planes, whose gap, its root and the normal have closed forms.
  bool isClosedForm() const {
    return body->shape == ContactShape::sphere && other->shape != ContactShape::other;
  }
  bool isOnPlane() const { return other->shape == ContactShape::plane; }
  /// Key of the pair, the same for both orders.
  std::uint64_t key() const { return keyOf(body->id, other->id); }
  static std::uint64_t keyOf(BodyId first, BodyId second) {
    const auto [low, high] = std::minmax(first, second);
    return (std::uint64_t{low} << 32) | high;
  }
};

}  // namespace carom::bullet
