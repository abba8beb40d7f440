#include "scenes/format/model_file.h"

#include "carom/audio/material.h"
#include "carom/audio/modal_model_file.h"
#include "carom/modal/gltf_audio.h"

namespace carom::scenes {
namespace {

bool isGltf(const std::filesystem::path& file) {
  return file.extension() == ".glb" || file.extension() == ".gltf";
}

}  // namespace

Result<ModalModel> loadModel(const std::filesystem::path& file) {
  if (!isGltf(file)) return readModalModel(file);
  const Result<GltfAudio> audio = readGltfAudio(file);
  if (!audio) return audio.error();
  Result<ModalModel> model = toModalModel(*audio, 0, 1.0, *findMaterial("steel"));
  if (!model) return Error{file.string() + ": " + model.error().message};
  return model;
}

Status writeModel(const std::filesystem::path& file, const ModalModel& model) {
  if (!isGltf(file)) return writeModalModel(file, model);
  GltfAudio audio;
  addModalModel(audio, model);
  return writeGltfAudio(file, audio);
}

}  // namespace carom::scenes
