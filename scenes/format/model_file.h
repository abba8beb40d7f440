#pragma once

#include <compare>
#include <filesystem>
#include <string>

#include "carom/audio/modal_model.h"
#include "carom/audio/result.h"

namespace carom::scenes {

// Files of modal models, by their extension: .glb and .gltf are glTF with KHR_audio_rigid_bodies
// (carom/modal/gltf_audio.h says what that loses of a model), all others are Carom's own format.

/// A model in a file that can be opened.
struct ModelFile {
  std::filesystem::path path;
  std::string node;  ///< of a glTF file: the name of a node; empty: the only model that is there

  bool empty() const { return path.empty(); }
  auto operator<=>(const ModelFile&) const = default;
};

/// Reads a model: of a glTF file that of the node, at the size that the node has in its scene, and
/// of steel where the file names no material. Refused besides what the formats refuse: a file that
/// has no such model, or several and `node` does not say which.
/// [any thread but the audio thread]
Result<ModalModel> loadModel(const ModelFile& file);

/// Writes a model; a file that has the name is replaced at
/// the end. [any thread but the audio thread]
Status writeModel(const std::filesystem::path& file, const ModalModel& model);

}  // namespace carom::scenes
