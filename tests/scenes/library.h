#pragma once

#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <string>
#include <string_view>

#include "carom/audio/material.h"
#include "scenes/format/scene.h"
#include "scenes/format/scene_loader.h"

namespace carom::test {

inline constexpr std::string_view kLibrary[] = {
    "bouncing_ball",     "two_balls", "newtons_cradle",  "billiard_break",  "marbles_in_a_box",
    "marbles_in_a_room", "fly_by",    "swinging_cradle", "nine_ball_break", "marble_steps"};

/// Scenes of the library that only Bullet can run and in which bodies ring.
inline constexpr std::string_view kRingingLibrary[] = {"dropped_wrench", "glass_and_plate",
                                                       "wood_blocks"};

inline std::filesystem::path libraryFile(std::string_view name) {
  return std::filesystem::path(CAROM_SOURCE_DIR) / "scenes" / "library" /
         (std::string(name) + ".json");
}

/// Returns a scene that the test needs; ends the program if there is an error.
inline scenes::Scene orAbort(Result<scenes::Scene> scene) {
  if (!scene) {
    std::cerr << scene.error().message << '\n';
    std::abort();
  }
  return *std::move(scene);
}

inline scenes::Scene libraryScene(std::string_view name) {
  return orAbort(scenes::loadScene(libraryFile(name)));
}

inline scenes::Scene onStepper(scenes::Scene scene, scenes::StepperType type,
                               double step = 1.0 / 240.0) {
  scene.stepper.type = type;
  scene.stepper.step = step;
  return scene;
}

/// Twelve marbles of two materials in a box, for a third of a second, in stereo.
inline scenes::Scene fewMarbles() {
  return orAbort(scenes::parseScene(R"({
    "duration": 0.35,
    "seed": 5,
    "bodies": [
      {"type": "box", "name": "box", "min": [-0.06, 0, -0.06], "max": [0.06, 1, 0.06],
       "material": "wood"},
      {"type": "spheres", "name": "marbles", "count": 12, "radius": [0.006, 0.009],
       "material": ["glass", "steel"], "min": [-0.05, 0.02, -0.05], "max": [0.05, 0.12, 0.05],
       "speed": [0, 1]}
    ],
    "listeners": [{"name": "left", "position": [-0.1, 0.4, 0.3]},
                  {"name": "right", "position": [0.1, 0.4, 0.3]}]
  })",
                                    "few_marbles.json"));
}

/// The scene with the plain equations of the hand-out, sampled without a filter: sound that a test
/// can compute again in a line.
inline scenes::Scene asInTheHandOut(scenes::Scene scene) {
  scene.sound.comparison.pulse = PulseShape::courseGaussian;
  scene.sound.comparison.sampling = Sampling::naive;
  scene.sound.comparison.radiation = Radiation::compact;
  scene.sound.doppler = false;
  scene.sound.airAbsorption = false;
  return scene;
}

/// fewMarbles() with balls of rubber: their contacts last milliseconds, and their sound begins
/// before it could have arrived from the touch itself (Synth::leadTime).
inline scenes::Scene fewRubberBalls() {
  scenes::Scene scene = fewMarbles();
  for (scenes::SceneBody& body : scene.bodies)
    body.material = *findMaterial("rubber");
  return scene;
}

}  // namespace carom::test
