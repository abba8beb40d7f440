#pragma once

#include <array>

#include "carom/audio/impulse_event.h"
#include "native/math/contact_time.h"

namespace carom::native {

/// A collision as its first body sees it, before the velocities change.
struct Impact {
  Vec3 normal;                 ///< unit, towards the first body
  double approachSpeed = 0.0;  ///< m/s
  double effectiveMass = 0.0;  ///< kg
  double impulse = 0.0;        ///< N s, on the first body along the normal
};

/// One of the two bodies of an impact.
struct Side {
  BodyId id = 0;
  double radius = kNever;               ///< m, infinite for a plane or face
  Vec3 position;                        ///< m, world frame
  Vec3 velocity;                        ///< m/s, world frame
  Quat orientation = Quat::Identity();  ///< body to world
  Vec3 spin = Vec3::Zero();             ///< rad/s, world frame
};

/// Returns the two events, at `time` s, of a collision of `first`, which is a sphere, with
/// `second`. The stepper that reports it and a recording that rebuilds it get the same bits.
/// Internal to native/. [any thread]
inline std::array<ImpulseEvent, 2> eventsOf(const Side& first, const Side& second,
                                            const Impact& impact, double time) {
  const Vec3 point = first.position - first.radius * impact.normal;
  const auto shareOf = [&](const Side& body, const Side& other, double sign) {
    ImpulseEvent event;
    event.time = time;
    event.body = body.id;
    event.other = other.id;
    event.impulse = (sign * impact.impulse) * impact.normal;
    event.position = point;
    event.normal = sign * impact.normal;
    event.approachSpeed = impact.approachSpeed;
    event.effectiveMass = impact.effectiveMass;
    event.radius = body.radius;
    event.otherRadius = other.radius;
    event.bodyPosition = body.position;
    event.bodyOrientation = body.orientation;
    event.bodyVelocity = body.velocity;
    event.bodyAngularVelocity = body.spin;
    return event;
  };
  std::array shares = {shareOf(first, second, 1.0), shareOf(second, first, -1.0)};
  exchangePoses(shares[0], shares[1]);
  return shares;
}

}  // namespace carom::native
