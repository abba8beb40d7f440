#pragma once

#include <filesystem>

#include "carom/audio/modal_model.h"
#include "carom/audio/result.h"

namespace carom::scenes {

// Files of modal models, by their extension: .glb and .gltf are glTF with KHR_audio_rigid_bodies
// (modal/gltf_modal_model.h says what that loses of a model), all others are Carom's own format.

/// Reads a model: of a glTF file the first one, with a metre to the unit, and with steel as its
/// material if the file does not name one. [any thread but the audio thread]
Result<ModalModel> loadModel(const std::filesystem::path& file);

/// Writes a model; a file that has the name is replaced at
/// the end. [any thread but the audio thread]
Status writeModel(const std::filesystem::path& file, const ModalModel& model);

}  // namespace carom::scenes
