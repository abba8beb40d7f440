#pragma once

#include "audio/vector.h"
#include "native/instant.h"

namespace carom {

/// A parabola, or a straight line: where a sphere was when its motion last changed, from which its
/// present follows. One cache line. Internal to native/.
struct alignas(64) Motion {
  Vec3 position = Vec3::Zero();  ///< m, world frame, at `since`
  Vec3 velocity = Vec3::Zero();  ///< m/s, world frame, at `since`
  Instant since;

  Motion at(const Instant& instant, const Vec3& acceleration) const {
    const double flight = elapsed(since, instant);
    const Vec3 gained = flight * acceleration;
    return {position + flight * (velocity + 0.5 * gained), velocity + gained, instant};
  }
};

}  // namespace carom
