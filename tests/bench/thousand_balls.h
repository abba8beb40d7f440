#pragma once

#include <string>

#include "scenes/format/scene_loader.h"

namespace carom::bench {

/// A thousand steel balls of 5 cm radius fall together for so many seconds.
inline Result<scenes::Scene> thousandBalls(double duration) {
  return scenes::parseScene(R"({
    "duration": )" + std::to_string(duration) +
                                R"(,
    "bodies": [
      {"type": "box", "min": [-1, 0, -1], "max": [1, 4, 1], "material": "steel"},
      {"type": "spheres", "count": 1000, "radius": 0.05, "material": "steel",
       "min": [-1, 0, -1], "max": [1, 1.2, 1], "speed": [0, 2]}
    ],
    "listeners": [{"position": [0, 2, 2]}]
  })",
                            "thousand_balls");
}

}  // namespace carom::bench
