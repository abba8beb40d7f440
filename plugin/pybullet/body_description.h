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

/// Out of what the server says. The material is the one whose density is nearest, concrete for an
/// immovable body. Radiates as the sphere of its volume; a single box that is no link by the added
/// mass of its shape, unless that cannot be solved. The volume is that of its shapes together; of a
/// mesh, which the server does not tell, half of the solid box with the body's mass and inertia,
/// and that whole box where it tells no shape at all (bodies with useMaximalCoordinates).
///
/// `held`: nothing moves it, whatever its mass.
BodyDescription describeBody(const b3::DynamicsInfo& dynamics,
                             std::span<const b3::CollisionShape> shapes, bool held, bool isLink,
                             RadiatorCache& radiators);

}  // namespace carom::plugin
