#include "scenes/recording/run_header.h"

#include <cstddef>
#include <cstdint>

#include <nlohmann/json.hpp>

namespace carom::scenes {

using nlohmann::json;

std::string headerText(const RunHeader& header) {
  const json object = {{"scene_file", header.sceneFile},
                       {"scene", header.sceneText},
                       {"stepper", header.stepper},
                       {"duration_s", header.duration},
                       {"deformation_step_s", header.deformationStep},
                       {"bodies", header.shape.bodies},
                       {"points", header.shape.points}};
  // Names of files need not be UTF-8.
  return object.dump(-1, ' ', false, json::error_handler_t::replace);
}

audio::RunShape runShape(const Scene& scene) {
  const JelloShape* const jello = jelloOf(scene);
  const std::size_t points = jello == nullptr ? 0 : jello->positions.size();
  return {static_cast<std::uint32_t>(scene.bodies.size()), static_cast<std::uint32_t>(points)};
}

RunHeader runHeader(const Scene& scene, std::string_view text, std::string_view name,
                    double deformationStep) {
  return {.sceneFile = std::string(name),
          .sceneText = std::string(text),
          .stepper = scene.stepper.type == StepperType::bullet ? "bullet" : "native",
          .duration = scene.duration,
          .deformationStep = deformationStep,
          .shape = runShape(scene)};
}

}  // namespace carom::scenes
