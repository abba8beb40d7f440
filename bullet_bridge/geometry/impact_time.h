#pragma once

#include <limits>

#include "bullet_bridge/geometry/motion.h"

namespace carom::bullet {

inline constexpr double kNever = std::numeric_limits<double>::infinity();  ///< s

/// Times of first contact within [0, horizon], in seconds after the motion's start; infinity where
/// there is none. A pair that already overlaps at 0 touches at 0 if it approaches, otherwise never.
/// Closed form but for spheres whose accelerations differ (an application force on one of them),
/// which take a bracketed root. [any thread]

/// `relative` is the motion of one centre seen from the other; touching is |position| = distance.
double sphereImpactTime(const Motion& relative, double distance, double horizon);

/// `height` (m) above contact, its rate and acceleration along the plane's normal.
double planeImpactTime(double height, double rate, double acceleration, double horizon);

}  // namespace carom::bullet
