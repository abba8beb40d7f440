#pragma once

#include <unordered_map>

#include "carom/audio/modal_model.h"
#include "carom/audio/result.h"
#include "carom/audio/sound_body.h"
#include "carom/sound.h"

namespace carom::plugin {

/// Checks what a host assigns and resolves the name of its material. Refuses what Sound::assign
/// says but for the target.
Result<BodySound> resolved(const BodySound& sound);

/// Replaces in `earlier` the parts that are set in `later`.
void merge(BodySound& earlier, const BodySound& later);

/// Merges into `sound` what is assigned to `key`, if anything.
template <class Key>
void mergeFrom(const std::unordered_map<Key, BodySound>& assigned, const Key& key,
               BodySound& sound) {
  if (const auto found = assigned.find(key); found != assigned.end()) merge(sound, found->second);
}

/// Returns a model's material. The model does not know its surface: the roughness is that of the
/// built-in material of the same name.
Material materialOf(const ModalModel& modes);

/// Applies all parts but `silent` to a body as it was read, with its guessed material.
void apply(const BodySound& sound, SoundBody& body);

}  // namespace carom::plugin
