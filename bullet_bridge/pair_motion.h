#pragma once

#include <cstdint>

#include "bullet_bridge/contact_pair.h"
#include "bullet_bridge/shape_pair.h"

namespace carom::bullet {

/// Which of a body's two ways through a substep: the one that it went, or the one that it would
/// have gone had the solver not touched it.
enum class Way : std::uint8_t { actual, unhindered };

/// The relative motion of a pair over one substep, of length dt.
///
/// In closed form for spheres and planes; by convex pieces (ShapePair, shared and reused) for all
/// else. Times are seconds after the start of the substep.
class PairMotion {
 public:
  PairMotion() = default;
  /// `horizon` bounds the times that will be asked for.
  PairMotion(const ContactPair& pair, Way way, double dt, double horizon, ShapePair& pieces);
  /// With motions of the caller's own; only for velocities and places, not for the gap.
  PairMotion(const ContactPair& pair, const RigidMotion& body, const RigidMotion& other)
      : pair_(pair), body_(body), other_(other) {}

  /// Whether the two shapes can be followed at all.
  bool isFollowed() const { return followed_; }
  Proximity proximityAt(double s) const;
  /// First touch at or after 0 of a pair that is apart at 0; infinity where there is none.
  double touchTime(double horizon) const;

  /// m/s, of the material point of either body at `point`.
  Vec3 bodyVelocityAt(const Vec3& point, double s) const { return body_.velocityAt(point, s); }
  Vec3 otherVelocityAt(const Vec3& point, double s) const { return other_.velocityAt(point, s); }
  /// m/s, > 0 when the two bodies approach each other at `point` along `normal`.
  double approachSpeedAt(const Vec3& point, const Vec3& normal, double s) const {
    return (otherVelocityAt(point, s) - bodyVelocityAt(point, s)).dot(normal);
  }

  /// m, inverse of the mean curvature of one body where it touches (ImpulseEvent::radius).
  double radiusAt(PairSide side, double s, const Proximity& touch) const;
  /// Of one body where it touches at the start; its axis in the world frame.
  LocalShape shapeAt(PairSide side, const Proximity& touch) const;

  const ContactPair& pair() const { return pair_; }
  /// Without the orientation of spheres, which takes some work: see TrackedBody::actual.
  const RigidMotion& body() const { return body_; }
  const RigidMotion& other() const { return other_; }
  ShapePair& pieces() const { return *pieces_; }

 private:
  double reach() const { return pair_.body->radius + pair_.other->radius; }
  double height(double s) const;
  const TrackedBody& trackedOf(PairSide side) const {
    return side == PairSide::body ? *pair_.body : *pair_.other;
  }

  ContactPair pair_;
  RigidMotion body_, other_;
  ShapePair* pieces_ = nullptr;
  bool followed_ = true;
};

}  // namespace carom::bullet
