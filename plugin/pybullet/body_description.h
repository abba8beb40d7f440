#pragma once

#include "carom/audio/panel_radiator.h"
#include "carom/audio/sound_body.h"
#include "plugin/pybullet/body_shape.h"
#include "plugin/pybullet/contact_listener.h"
#include "plugin/pybullet/server_abi.h"

namespace carom::plugin {

/// A body of a physics server, for mechanics and for sound.
struct BodyDescription {
  ContactBody contact;
  SoundBody sound;
};

/// Describes a body by what the server tells of it (shapeOf). The material is guessed from the
/// density, concrete for an immovable body. The body radiates as the sphere of its volume; a box
/// that is no link by the added mass of its shape, unless that cannot be solved.
///
/// `held`: nothing moves the body, whatever its mass.
BodyDescription describeBody(const ShapeSigns& signs, bool held, bool isLink,
                             RadiatorCache& radiators);

}  // namespace carom::plugin
