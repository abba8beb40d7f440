#pragma once

#include <array>
#include <cstddef>

#include "carom/native/motion.h"
#include "native/math/contact_time.h"

namespace carom::native {

/// The quick reject of the search for contacts: tells for two candidates at once whether a sphere
/// may meet them soon, so that only the few that pass are looked at closely. It has no branches,
/// and uses vector instructions that every processor has. A rejected candidate has no contact by
/// sphereContactTime, which rejects it by the same numbers, or certainly a later one.
///
/// All spheres are under the same acceleration; kPulled: it is not zero. kFresh: no candidate's
/// motion began later than that of the sphere. Internal to native/.
template <bool kPulled, bool kFresh>
class QuickReject {
 public:
  /// Two numbers side by side, one for each candidate. GCC and Clang both know such types.
  using Two = double __attribute__((vector_size(16)));

  QuickReject(const Motion& motion, const Vec3& acceleration)
      : since_(both(motion.since.seconds)), rest_(both(motion.since.rest)) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto at = static_cast<Eigen::Index>(axis);
      position_[axis] = both(motion.position[at]);
      velocity_[axis] = both(motion.velocity[at]);
      acceleration_[axis] = both(acceleration[at]);
    }
  }

  /// Returns bit 0 if the sphere may meet the first candidate in less than `horizon` s after its
  /// motion began, bit 1 if the second.
  unsigned mayMeet(const Motion& first, const Motion& second, const Two& radiusSum,
                   double horizon) const {
    const Two lag = (since_ - Two{first.since.seconds, second.since.seconds}) +
                    (rest_ - Two{first.since.rest, second.since.rest});
    const auto later = lag >= both(0.0);
    const Two half = 0.5 * (kFresh || !kPulled ? lag : (later ? lag : -lag));
    Two closing = both(0.0);
    Two squared = both(0.0);
    Two speed = both(0.0);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto at = static_cast<Eigen::Index>(axis);
      const Two velocity{first.velocity[at], second.velocity[at]};
      Two flown = velocity;
      if constexpr (!kFresh) flown = later ? velocity : velocity_[axis];
      if constexpr (kPulled) flown += half * acceleration_[axis];
      const Two apart =
          position_[axis] - Two{first.position[at], second.position[at]} - lag * flown;
      Two faster = velocity_[axis] - velocity;
      if constexpr (kPulled) faster -= lag * acceleration_[axis];
      closing -= apart * faster;
      squared += apart * apart;
      speed += faster * faster;
    }
    const Two gap = squared - radiusSum * radiusSum;
    // The contact is after gap / (closing + sqrt(D)), where D is at most closing^2 but for its
    // rounding, kRounding^2 of squared * speed. A product is at most half the sum of the squares.
    const Two soonest = gap - kRounding * squared;
    const Two reached = horizon * (2.0 * closing + kRounding * horizon * speed);
    const auto meets = (closing > both(0.0)) & (soonest <= reached) &
                       ((gap <= both(0.0)) | (closing * closing >= speed * (gap - 1e-9 * squared)));
    return (meets[0] != 0 ? 1U : 0U) | (meets[1] != 0 ? 2U : 0U);
  }

 private:
  static constexpr double kRounding = 1e-6;

  static Two both(double value) { return Two{value, value}; }

  Two since_;
  Two rest_;
  std::array<Two, 3> position_;
  std::array<Two, 3> velocity_;
  std::array<Two, 3> acceleration_;
};

}  // namespace carom::native
