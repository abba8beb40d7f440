#pragma once

#include <filesystem>

#include "carom/audio/modal_model.h"
#include "carom/audio/result.h"

namespace carom::scenes {

// Modal models by the extension of their file: .glb and .gltf are glTF with KHR_audio_rigid_bodies
// (modal/gltf_modal_model.h says what of a model that loses), all else is Carom's own format.

/// The first model of a glTF file, one unit of which is a metre; what it is made of, if the file
/// does not say, is steel. [any thread but the audio thread]
Result<ModalModel> loadModel(const std::filesystem::path& file);

/// Replaces what has the name, at the end. [any thread but the audio thread]
Status writeModel(const std::filesystem::path& file, const ModalModel& model);

}  // namespace carom::scenes
