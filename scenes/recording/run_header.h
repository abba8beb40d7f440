#pragma once

#include <string>
#include <string_view>

#include "audio/run/run_tables.h"
#include "scenes/format/scene.h"

namespace carom::scenes {

/// The beginning of the file of a scene's run: a JSON object, in a part of kind 'h'.
struct RunHeader {
  std::string sceneFile;         ///< its name, which files that the scene names are relative to
  std::string sceneText;         ///< JSON
  std::string stepper;           ///< "native" or "bullet"; "host" of a host's run, without a scene
  double duration = 0.0;         ///< s, > 0
  double deformationStep = 0.0;  ///< s, see SceneStepper::hearDeformations; 0: nothing deforms
  audio::RunShape shape;
};

inline constexpr char kHeaderPart = 'h';  ///< its kind; see RunEncoder

/// Returns the object as a text. [any thread]
std::string headerText(const RunHeader& header);

/// Returns the sizes that the numbers of the scene's run are read with. [any thread]
audio::RunShape runShape(const Scene& scene);

/// Returns the header of a run of a scene, whose file has this text and name. `deformationStep` is
/// what SceneStepper::hearDeformations has returned. [any thread]
RunHeader runHeader(const Scene& scene, std::string_view text, std::string_view name,
                    double deformationStep);

}  // namespace carom::scenes
