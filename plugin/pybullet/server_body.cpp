#include "plugin/pybullet/server_body.h"

#include "carom/audio/material.h"

namespace carom::plugin {
namespace {

/// Returns what is assigned to the part itself, or else to the whole body.
template <class Part>
const std::optional<Part>& chosen(const std::optional<Part>& own,
                                  const std::optional<Part>& whole) {
  return own ? own : whole;
}

}  // namespace

SoundBody soundOf(const ServerPart& part, const AssignedParts& whole) {
  SoundBody body = part.sound;
  const auto& modes = chosen(part.assigned.modes, whole.modes);
  const auto& texture = chosen(part.assigned.texture, whole.texture);
  const auto& material = chosen(part.assigned.material, whole.material);
  if (modes) body.modal = *modes;
  if (texture) body.texture = *texture;
  const double restitution = body.material.restitution;
  if (material)
    body.material = *findMaterial(*material);
  else if (body.modal != nullptr)
    body.material = body.modal->material;
  body.material.restitution = restitution;
  return body;
}

}  // namespace carom::plugin
