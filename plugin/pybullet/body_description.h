#pragma once

#include <span>

#include "carom/audio/panel_radiator.h"
#include "carom/audio/sound_body.h"
#include "plugin/pybullet/contact_listener.h"
#include "plugin/pybullet/server_abi.h"

namespace carom::plugin {

/// A body of a physics server, for mechanics and for sound.
struct BodyDescription {
  ContactBody contact;
  SoundBody sound;
};

/// Describes a body by what the server tells of it. The material is guessed from the
/// density, concrete for an immovable body. The body radiates as the sphere of its volume; a single
/// box that is no link by the added mass of its shape, unless that cannot be solved. The volume is
/// that of its shapes together. A mesh, which the server does not tell, counts as half of the solid
/// box with the body's mass and inertia, and a body of no known shape (with useMaximalCoordinates)
/// as that whole box.
///
/// `held`: nothing moves the body, whatever its mass.
BodyDescription describeBody(const b3::DynamicsInfo& dynamics,
                             std::span<const b3::CollisionShape> shapes, bool held, bool isLink,
                             RadiatorCache& radiators);

}  // namespace carom::plugin
