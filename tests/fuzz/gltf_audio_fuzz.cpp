#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <string_view>

#include "carom/modal/gltf_audio.h"

namespace {

void require(bool promise) {
  if (!promise) std::abort();
}

/// Requires that accepted audio is allowed by the draft, and that each of its models can be used or
/// is refused.
void use(const carom::GltfAudio& audio) {
  require(static_cast<bool>(carom::validate(audio)));
  for (std::size_t index = 0; index < audio.models.size(); ++index) {
    const auto model = carom::toModalModel(audio, index, 1.0, *carom::findMaterial("glass"));
    if (!model) {
      require(std::string_view(model.error().message).starts_with("modal model "));
      continue;
    }
    require(static_cast<bool>(carom::validate(*model)));
    carom::GltfAudio again;
    carom::addModalModel(again, *model);
    // Floats hold the positions, which come from floats in the file; the modes may all be gone.
    if (!model->modes.empty()) require(static_cast<bool>(carom::validate(again)));
  }
  for (const carom::GltfAudioNode& node : audio.nodes)
    if (const auto scale = carom::uniformScale(node)) require(*scale > 0.0);
}

}  // namespace

/// Requires that any bytes give either audio that the draft allows or an error with a message. No
/// other file is opened.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto audio = carom::parseGltfAudio(std::as_bytes(std::span(data, size)), "fuzz");
  if (audio)
    use(*audio);
  else
    require(std::string_view(audio.error().message).starts_with("fuzz: "));
  return 0;
}
