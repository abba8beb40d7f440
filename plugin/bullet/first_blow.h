#pragma once

#include <span>

#include "carom/audio/listener.h"
#include "carom/audio/sound_body.h"
#include "carom/sound_settings.h"

namespace carom::plugin {

/// A body that will hit something.
struct FallingBody {
  SoundBody sound;
  Vec3 position = Vec3::Zero();  ///< m, world frame
  double speed = 0.0;            ///< m/s, when it hits
};

/// Returns the peak (Pa) of the loudest click that one of the bodies makes at the listener when it
/// lands on concrete; 0 if none is heard. It is an upper bound as the scheduler has it. [any
/// thread]
double peakOfFirstBlow(const SoundSettings& settings, const ListenerPose& listener, const Vec3& up,
                       std::span<const FallingBody> bodies);

}  // namespace carom::plugin
