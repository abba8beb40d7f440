#pragma once

#include <optional>

#include "carom/audio/vector.h"
#include "modal/json/json_reader.h"

namespace carom::scenes {

/// The direction in which a listener or a camera looks. A pose keeps the values that it does not
/// give from the pose before.
struct Aim {
  std::optional<Vec3> target;     ///< m, world frame: a point to look at
  Vec3 forward = -Vec3::UnitZ();  ///< used without a target; any length
  Vec3 up = Vec3::UnitY();        ///< any length
};

/// Reads "looks_at", "forward" and "up" into `aim`; records an error if both of the first are
/// there. [any thread]
void readAim(const modal::JsonNode& node, Aim& aim);

/// Returns the orientation of what stands at `position`; records an error at `node` if there is
/// none. [any thread]
Quat orientationOf(const Aim& aim, const Vec3& position, const modal::JsonNode& node);

/// Returns the orientation that looks along `forward`, both of any length; nothing if `forward` is
/// zero or along `up`. [any thread]
std::optional<Quat> orientationTowards(const Vec3& forward, const Vec3& up);

}  // namespace carom::scenes
