#pragma once

#include <string>
#include <vector>

#include "scenes/format/scene.h"

namespace carom::scenes {

struct LeftOut {
  std::string stage;
  std::string why;
};

/// The stages that a scene needs, and those left out, decided before the run from the scene alone.
/// Stage names are stable; docs/cli.md lists them.
struct Plan {
  std::vector<std::string> needed;  ///< in the order of the data flow
  std::vector<LeftOut> leftOut;
};

Plan makePlan(const Scene& scene);

}  // namespace carom::scenes
