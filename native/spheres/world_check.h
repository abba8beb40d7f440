#pragma once

#include "carom/audio/result.h"
#include "carom/native/sphere_stepper.h"

namespace carom::native {

/// Largest overlap at time 0 that counts as touching, relative to the smaller radius: above the
/// rounding of coordinates that were computed to touch, far below anything visible.
inline constexpr double kTouchingOverlap = 1e-9;

/// Returns the world with its normals and orientations scaled to length 1 within rounding. An error
/// says what is wrong: which body by id, spring or rod by its place in the list, which value, and
/// what would be accepted. Internal to native/.
Result<SphereWorld> checkedWorld(SphereWorld world);

}  // namespace carom::native
