#pragma once

#include <string>
#include <vector>

#include "scenes/format/scene.h"
#include "scenes/run/render.h"

namespace carom::command {

/// Prints warnings on stderr as they come, and keeps them for the JSON output. [one thread]
class Warnings {
 public:
  void add(const std::string& text);
  void add(const std::vector<std::string>& texts);
  const std::vector<std::string>& all() const { return texts_; }

 private:
  std::vector<std::string> texts_;
};

/// Returns what in a scene is a mistake more often than not: bodies that can move and are lighter
/// than all but foams, listeners behind a wall of the room. [any thread]
std::vector<std::string> sceneWarnings(const scenes::Scene& scene);

/// Returns what befell the sound without being asked for: peaks above full scale, contacts that
/// lost their beginning. Each names the options that help. [any thread]
std::vector<std::string> renderWarnings(const scenes::RenderReport& report,
                                        const scenes::RenderOptions& options);

}  // namespace carom::command
