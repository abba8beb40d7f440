#pragma once

#include <cstdint>
#include <limits>

#include <carom/audio/vector.h>

namespace carom {

/// Names a body for as long as its world exists; never used again for another body.
using BodyId = std::uint32_t;

/// One body's share of one collision: the vocabulary between mechanics and sound. A collision
/// gives two events, one per body, with the same time and opposite impulses; an immovable body
/// gets its share too, because it may ring.
///
/// Not included: friction (the impulse is along the normal), and the duration of the contact, which
/// follows from the bodies' materials (see hertzDuration).
struct ImpulseEvent {
  double time = 0.0;  ///< s, simulation clock: the instant of first touch
  BodyId body = 0;    ///< the body that this share belongs to
  BodyId other = 0;   ///< the body it hit

  /// N s, world frame, on `body`; the other body's share is its negative. It is the physical
  /// impulse: restitution acts on the approach along the normal, j = (1 + e) m |vn|.
  Vec3 impulse = Vec3::Zero();
  /// N s, world frame, on `body`: the impulse that the mechanics itself applied for this impact, if
  /// that is not exact (a time-stepping solver adds support load, friction, correction of
  /// penetration, and loses some of the bounce). Meaningful only if `hasAppliedImpulse`.
  Vec3 appliedImpulse = Vec3::Zero();
  bool hasAppliedImpulse = false;  ///< `appliedImpulse` is known and differs from `impulse`
  bool hasOtherPose = false;       ///< `otherPosition` and `otherOrientation` are known
  Vec3 position = Vec3::Zero();    ///< m, world frame, the contact point at `time`
  Vec3 normal = Vec3::UnitX();     ///< 1, world frame, unit, from the other body towards `body`

  double approachSpeed = 0.0;  ///< m/s, > 0, relative normal speed just before touching
  double effectiveMass = 0.0;  ///< kg, of the pair along the normal: 1/m = 1/m1 + 1/m2 + rotation

  /// m, local radius of curvature of `body` at the contact: infinite where it is flat, 0 at an edge
  /// or corner. Where the two principal curvatures differ it is the inverse of their mean, so that
  /// the sum over both bodies is twice Hertz's A + B (Johnson 1985, eq. 4.3).
  double radius = std::numeric_limits<double>::infinity();
  /// m, the same of the other body.
  double otherRadius = std::numeric_limits<double>::infinity();

  Vec3 bodyPosition = Vec3::Zero();         ///< m, world frame, centre of mass of `body` at `time`
  Quat bodyOrientation = Quat::Identity();  ///< body to world, at `time`
  Vec3 bodyVelocity = Vec3::Zero();         ///< m/s, world frame, centre of mass, just before touch
  Vec3 bodyAngularVelocity = Vec3::Zero();  ///< rad/s, world frame, just before touch

  /// m, world frame, centre of mass of the other body at `time`. With its orientation it tells
  /// where on the other body the contact is, so that the modes of both take part in the contact.
  /// Without it, those of the other body do not. Meaningful only if `hasOtherPose`.
  Vec3 otherPosition = Vec3::Zero();
  Quat otherOrientation = Quat::Identity();  ///< other body to world, at `time`
};

/// Sets the pose of the other body in both shares of a collision, each from the other share.
inline void exchangePoses(ImpulseEvent& share, ImpulseEvent& reaction) {
  const auto take = [](ImpulseEvent& event, const ImpulseEvent& from) {
    event.hasOtherPose = true;
    event.otherPosition = from.bodyPosition;
    event.otherOrientation = from.bodyOrientation;
  };
  take(share, reaction);
  take(reaction, share);
}

// The layout is the same for every host, whatever vector instructions it is compiled with.
static_assert(sizeof(ImpulseEvent) == 312 && alignof(ImpulseEvent) == alignof(double));

}  // namespace carom
