#pragma once

#include <limits>

#include <carom/audio/impulse_event.h>
#include <carom/audio/vector.h>

namespace carom {

enum class ContactPhase { begin, during, end };

/// A lasting contact of two bodies, over one step of the mechanics: what slides, rolls or rests.
///
/// One for each pair and step, from the step in which the contact begins to bear load (`begin`) to
/// the one in which it is known to have ended (`end`, without load). The impulse of an impact is
/// in its events and not in here, so that events and states together hold all that the mechanics
/// applied to the pair.
///
/// The contact point is the mean of all points between the two bodies, weighted by their load. It
/// moves with the centre of curvature of the more curved body, which is what a rolling body does,
/// or along its rim, which is what a coin does; two flat sides move it with `body`.
struct ContactState {
  double time = 0.0;      ///< s, simulation clock, start of the step
  double duration = 0.0;  ///< s, of the step
  ContactPhase phase = ContactPhase::during;
  BodyId body = 0;   ///< the one that `normal` points to
  BodyId other = 0;  ///< what is said of it is this with the opposite sign

  Vec3 normal = Vec3::UnitX();         ///< 1, world frame, unit, from the other body towards `body`
  Vec3 position = Vec3::Zero();        ///< m, world frame, the contact point at `time`
  double normalLoad = 0.0;             ///< N, >= 0, mean over the step
  Vec3 appliedImpulse = Vec3::Zero();  ///< N s, world frame, on `body`, over the step, friction too

  /// m, local radius of curvature of `body` at the contact: infinite where it is flat, 0 at an edge
  /// or corner; as ImpulseEvent::radius.
  double radius = std::numeric_limits<double>::infinity();
  double otherRadius = std::numeric_limits<double>::infinity();  ///< m, of the other body

  /// m/s, world frame, tangential: the surface of `body` at the contact, seen from the other's.
  Vec3 slipVelocity = Vec3::Zero();
  /// m/s, world frame, tangential: the contact point, seen from the mean of the two surfaces. Half
  /// the speed of a sliding block; the full speed of a wheel that rolls.
  Vec3 rollingVelocity = Vec3::Zero();

  Vec3 bodyPosition = Vec3::Zero();         ///< m, world frame, centre of mass of `body` at `time`
  Quat bodyOrientation = Quat::Identity();  ///< body to world, at `time`
  Vec3 bodyVelocity = Vec3::Zero();         ///< m/s, world frame, of its centre, mean over the step
  Vec3 otherPosition = Vec3::Zero();        ///< likewise of the other body
  Quat otherOrientation = Quat::Identity();
  Vec3 otherVelocity = Vec3::Zero();

  Vec3 pathStart = Vec3::Zero();       ///< m, frame of `body`, the contact point at `time`
  Vec3 pathEnd = Vec3::Zero();         ///< m, frame of `body`, at time + duration
  Vec3 otherPathStart = Vec3::Zero();  ///< m, frame of the other body
  Vec3 otherPathEnd = Vec3::Zero();
};

// One layout for every host, whatever its compiler may vectorise with.
static_assert(sizeof(ContactState) == 432 && alignof(ContactState) == alignof(double));

}  // namespace carom
