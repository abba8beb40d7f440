#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "carom/audio/modal_model.h"
#include "carom/audio/sound_body.h"
#include "carom/audio/surface_texture.h"
#include "plugin/pybullet/body_motion.h"
#include "plugin/pybullet/contact_impact.h"

namespace carom::plugin {

inline constexpr int kBaseLink = -1;  ///< number of a base among the links of its body

/// The assignments of a host to a body or to one link of it. A part that is not set says nothing.
struct AssignedParts {
  std::optional<std::string> material{};  ///< one of builtInMaterials
  std::optional<std::shared_ptr<const ModalModel>> modes{};
  std::optional<std::shared_ptr<const SurfaceTexture>> texture{};
};

/// A base or a link of a body, as the sound knows it.
struct ServerPart {
  BodyId id = 0;
  bool isKnown = false;      ///< it has an id
  bool isDescribed = false;  ///< as its dynamics are now
  bool rings = false;        ///< it has modes
  bool isHeld = false;       ///< it has a mass, but hung in the air at rest when it was described
  SoundBody sound{};         ///< with the material that was guessed
  ContactBody contact{};     ///< for mechanics
  AssignedParts assigned{};
};

/// A body of the server.
struct ServerBody {
  bool isThere = false;
  bool mayMove = true;  ///< any part of it
  bool isSoft = false;  ///< no rigid body: it is silent
  BodyMotion motion{};
  AssignedParts assigned{};         ///< to the base and all links
  std::vector<ServerPart> parts{};  ///< the base, then the links, as far as they are known

  /// Returns the part of a link, -1 for the base.
  ServerPart& part(int link) {
    const auto at = static_cast<std::size_t>(static_cast<std::ptrdiff_t>(link) + 1);
    if (at >= parts.size()) parts.resize(at + 1);
    return parts[at];
  }
};

/// Returns how a part sounds: as it was described, with what is assigned to it, or else to the
/// whole body. The restitution stays that of the server. A part that rings is of its modes' own
/// material unless another is assigned.
SoundBody soundOf(const ServerPart& part, const AssignedParts& whole);

}  // namespace carom::plugin
