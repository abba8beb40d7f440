#pragma once

#include <memory>

#include "carom/audio/listener.h"
#include "carom/audio/modal_model.h"
#include "carom/audio/surface_texture.h"
#include "carom/audio/texture_coordinates.h"
#include "carom/carom.h"

// The objects that the handles of resources point to. Each shares what it holds, so that freeing a
// handle takes it from nobody.

struct carom_modes {
  std::shared_ptr<const carom::ModalModel> model;
};

struct carom_head {
  std::shared_ptr<const carom::HrtfSet> set;
};

struct carom_texture {
  std::shared_ptr<const carom::SurfaceTexture> texture;
};

struct carom_texture_coordinates {
  std::shared_ptr<const carom::TextureCoordinates> coordinates;
};

namespace carom::plugin {

inline std::shared_ptr<const ModalModel> sharedFrom(const carom_modes* modes) {
  return modes == nullptr ? nullptr : modes->model;
}

inline std::shared_ptr<const SurfaceTexture> sharedFrom(const carom_texture* texture) {
  return texture == nullptr ? nullptr : texture->texture;
}

inline std::shared_ptr<const TextureCoordinates> sharedFrom(
    const carom_texture_coordinates* coordinates) {
  return coordinates == nullptr ? nullptr : coordinates->coordinates;
}

}  // namespace carom::plugin
