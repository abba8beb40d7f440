#include "plugin/bullet/assigned_sound.h"

#include <string>
#include <utility>

#include "carom/audio/sound_body.h"

namespace carom {

MaterialChoice::MaterialChoice(const char* name)
    : MaterialChoice(std::string(name == nullptr ? "" : name)) {}
MaterialChoice::MaterialChoice(std::string_view name) : choice_(std::string(name)) {}
MaterialChoice::MaterialChoice(std::string name) : choice_(std::move(name)) {}
MaterialChoice::MaterialChoice(Material material) : choice_(std::move(material)) {}

Result<Material> MaterialChoice::material() const {
  if (const auto* material = std::get_if<Material>(&choice_)) return *material;
  const std::string& name = *std::get_if<std::string>(&choice_);
  if (const Material* const found = findMaterial(name)) return *found;
  std::string names;
  for (const Material& material : builtInMaterials())
    names += (names.empty() ? "" : ", ") + material.name;
  return Error{"there is no material '" + name + "'; there are " + names};
}

namespace plugin {
namespace {

template <class Part>
void mergePart(std::optional<Part>& earlier, const std::optional<Part>& later) {
  if (later) earlier = later;
}

Status validateMaterial(const Material& material) {
  SoundBody body;
  body.material = material;
  return validate(body);
}

}  // namespace

Result<BodySound> resolved(const BodySound& sound) {
  BodySound checked = sound;
  if (sound.material) {
    Result<Material> material = sound.material->material();
    if (!material) return Error{"sound: " + material.error().message};
    if (const Status valid = validateMaterial(*material); !valid)
      return Error{"sound: " + valid.error().message};
    checked.material = *std::move(material);
  }
  if (sound.modes && *sound.modes != nullptr)
    if (const Status valid = validate(**sound.modes); !valid)
      return Error{"sound: modal model: " + valid.error().message};
  return checked;
}

void merge(BodySound& earlier, const BodySound& later) {
  const auto& [material, modes, texture, textureCoordinates, silent] = later;  // all there are
  mergePart(earlier.material, material);
  mergePart(earlier.modes, modes);
  mergePart(earlier.texture, texture);
  mergePart(earlier.textureCoordinates, textureCoordinates);
  mergePart(earlier.silent, silent);
}

Material materialOf(const ModalModel& modes) {
  Material material = modes.material;
  if (const Material* known = findMaterial(material.name)) material.roughness = known->roughness;
  return material;
}

void apply(const BodySound& sound, SoundBody& body) {
  body.modal = sound.modes.value_or(nullptr);
  if (sound.material)
    body.material = *sound.material->material();
  else if (body.modal != nullptr)
    body.material = materialOf(*body.modal);
  body.texture = sound.texture.value_or(nullptr);
  body.textureCoordinates = sound.textureCoordinates.value_or(nullptr);
}

}  // namespace plugin
}  // namespace carom
