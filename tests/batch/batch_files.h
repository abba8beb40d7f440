#pragma once

#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/temporary_folder.h"

namespace carom::test {

using nlohmann::json;

/// A scene of one ball that falls on a floor for half a second: 2 ms to render.
inline json ballScene() {
  return {{"name", "ball"},
          {"duration", 0.5},
          {"bodies",
           {{{"type", "plane"},
             {"name", "floor"},
             {"normal", {0, 1, 0}},
             {"offset", 0},
             {"material", "concrete"}},
            {{"type", "sphere"},
             {"name", "ball"},
             {"radius", 0.01},
             {"material", "steel"},
             {"position", {0, 0.2, 0}}}}},
          {"listeners", {{{"position", {0.6, 0.7, 0.37}}}}}};
}

inline void write(const std::filesystem::path& file, const std::string& text) {
  std::ofstream(file, std::ios::binary) << text;
}

/// Writes the scene "ball.json" and the batch "batch.json" into a folder; returns the batch's path.
inline std::filesystem::path writeBatch(const TemporaryFolder& folder, json batch,
                                        const json& scene = ballScene()) {
  write(folder / "ball.json", scene.dump());
  if (!batch.contains("scene")) batch["scene"] = "ball.json";
  write(folder / "batch.json", batch.dump());
  return folder / "batch.json";
}

/// A batch of balls that fall from random heights.
inline json ballBatch(int count) {
  return {{"count", count},
          {"seed", 5},
          {"parameters",
           {{{"name", "height"}, {"uniform", {0.05, 0.3}}, {"at", "/bodies/1/position/1"}}}}};
}

}  // namespace carom::test
