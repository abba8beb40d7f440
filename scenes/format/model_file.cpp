#include "scenes/format/model_file.h"

#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

#include "carom/audio/material.h"
#include "carom/audio/modal_model_file.h"
#include "carom/modal/gltf_audio.h"
#include "modal/json/json_reader.h"

namespace carom::scenes {
namespace {

bool isGltf(const std::filesystem::path& file) {
  return file.extension() == ".glb" || file.extension() == ".gltf";
}

/// A model of a glTF file, as one of its nodes has it.
struct PlacedModel {
  std::size_t model = 0;
  double scale = 1.0;

  bool operator==(const PlacedModel&) const = default;
};

/// Returns the names of all nodes that have a model, as a list.
std::string ringingNodes(const GltfAudio& audio) {
  std::vector<std::string_view> names;
  for (const GltfAudioNode& node : audio.nodes)
    if (node.modalModel) names.push_back(node.name);
  return modal::quotedList(names);
}

/// Returns the model that the node of that name has, or any node if `name` is empty: there must be
/// one, whatever the number of nodes that have it.
Result<PlacedModel> modelOf(const GltfAudio& audio, const std::string& name) {
  std::optional<PlacedModel> found;
  for (const GltfAudioNode& node : audio.nodes) {
    if (!node.modalModel || (!name.empty() && node.name != name)) continue;
    const Result<double> scale = uniformScale(node);
    if (!scale) return scale.error();
    const PlacedModel placed{*node.modalModel, *scale};
    if (found && *found != placed)
      return Error{"there are several modal models" +
                   (name.empty() ? std::string() : " of nodes called " + modal::inQuotes(name)) +
                   "; expected the name of one of the nodes " + ringingNodes(audio)};
    found = placed;
  }
  if (found) return *found;
  if (audio.models.empty()) return Error{"there is no modal model (KHR_audio_rigid_bodies) in it"};
  if (!name.empty())
    return Error{"no node that has a modal model is called " + modal::inQuotes(name) +
                 "; expected one of " + ringingNodes(audio)};
  if (audio.models.size() > 1)
    return Error{"there are " + std::to_string(audio.models.size()) +
                 " modal models in it, and no node has one of them"};
  return PlacedModel{};
}

Result<ModalModel> loadGltf(const ModelFile& file) {
  const Result<GltfAudio> audio = readGltfAudio(file.path);
  if (!audio) return audio.error();
  const Result<PlacedModel> placed = modelOf(*audio, file.node);
  Result<ModalModel> model =
      placed ? toModalModel(*audio, placed->model, placed->scale, *findMaterial("steel"))
             : placed.error();
  if (!model) return Error{file.path.string() + ": " + model.error().message};
  return model;
}

}  // namespace

Result<ModalModel> loadModel(const ModelFile& file) {
  if (isGltf(file.path)) return loadGltf(file);
  if (!file.node.empty())
    return Error{file.path.string() + ": a node, " + modal::inQuotes(file.node) +
                 ", is named; expected a glTF file, .glb or .gltf, for only these have nodes"};
  return readModalModel(file.path);
}

Status writeModel(const std::filesystem::path& file, const ModalModel& model) {
  if (!isGltf(file)) return writeModalModel(file, model);
  GltfAudio audio;
  addModalModel(audio, model);
  return writeGltfAudio(file, audio);
}

}  // namespace carom::scenes
