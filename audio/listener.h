#pragma once

#include <string>

#include "audio/vector.h"

namespace carom {

/// A point in the air where pressure is heard: one omnidirectional microphone, one channel.
struct Listener {
  std::string name;
  Vec3 position = Vec3::Zero();  ///< m, world frame
};

}  // namespace carom
