#pragma once

#include <limits>

#include <carom/audio/impulse_event.h>
#include <carom/audio/vector.h>

namespace carom {

enum class ContactPhase { begin, during, end };

/// A lasting contact of two bodies (sliding, rolling or resting) over one step of the mechanics.
///
/// There is one state for each pair and step, from the step in which the contact begins to bear
/// load (`begin`) to the one in which it is known to have ended (`end`, without load). The impulse
/// of an impact is in its events and not in these states, so that events and states together hold
/// all that the mechanics applied to the pair.
///
/// The contact point is the mean of all points between the two bodies, weighted by their load. It
/// moves with the centre of curvature of the more curved body, as under a rolling body, or along
/// the body's rim, as under a coin; between two flat sides it moves with `body`.
struct ContactState {
  double time = 0.0;      ///< s, simulation clock, start of the step
  double duration = 0.0;  ///< s, of the step
  ContactPhase phase = ContactPhase::during;
  BodyId body = 0;   ///< the body that `normal` points to
  BodyId other = 0;  ///< the other body: for it, normal, impulse and slip have the opposite sign

  Vec3 normal = Vec3::UnitX();         ///< 1, world frame, unit, from the other body towards `body`
  Vec3 position = Vec3::Zero();        ///< m, world frame, the contact point at `time`
  double normalLoad = 0.0;             ///< N, >= 0, mean over the step
  Vec3 appliedImpulse = Vec3::Zero();  ///< N s, world frame, on `body`, over the step, friction too

  /// m, local radius of curvature of `body` at the contact: infinite where it is flat, 0 at an edge
  /// or corner; as ImpulseEvent::radius.
  double radius = std::numeric_limits<double>::infinity();
  double otherRadius = std::numeric_limits<double>::infinity();  ///< m, the same of the other body

  /// m/s, world frame, tangential: velocity of the surface of `body` at the contact, relative to
  /// the other body's surface.
  Vec3 slipVelocity = Vec3::Zero();
  /// m/s, world frame, tangential: velocity of the contact point, relative to the mean of the two
  /// surfaces. Half the speed of a sliding block; the full speed of a wheel that rolls.
  Vec3 rollingVelocity = Vec3::Zero();

  Vec3 bodyPosition = Vec3::Zero();          ///< m, world frame, centre of mass of `body` at `time`
  Quat bodyOrientation = Quat::Identity();   ///< body to world, at `time`
  Vec3 bodyVelocity = Vec3::Zero();          ///< m/s, world frame, centre of mass, mean over step
  Vec3 otherPosition = Vec3::Zero();         ///< m, as bodyPosition, of the other body
  Quat otherOrientation = Quat::Identity();  ///< other body to world, at `time`
  Vec3 otherVelocity = Vec3::Zero();         ///< m/s, as bodyVelocity, of the other body

  Vec3 pathStart = Vec3::Zero();       ///< m, frame of `body`, the contact point at `time`
  Vec3 pathEnd = Vec3::Zero();         ///< m, frame of `body`, the contact point at time + duration
  Vec3 otherPathStart = Vec3::Zero();  ///< m, frame of the other body, the contact point at `time`
  Vec3 otherPathEnd = Vec3::Zero();    ///< m, frame of the other body, at time + duration
};

// The layout is the same for every host, whatever vector instructions it is compiled with.
static_assert(sizeof(ContactState) == 432 && alignof(ContactState) == alignof(double));

}  // namespace carom
