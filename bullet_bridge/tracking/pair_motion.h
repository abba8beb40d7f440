#pragma once

#include <cstdint>

#include "bullet_bridge/shapes/shape_pair.h"
#include "bullet_bridge/tracking/contact_pair.h"

namespace carom::bullet {

/// The motion of a body over a substep: the one that it had, or the one that it would have had if
/// the solver had acted on no contact of it.
enum class MotionKind : std::uint8_t { actual, contactFree };

/// The relative motion of a pair over one substep, of length dt.
///
/// Spheres and planes have closed forms; all other shapes are followed by their convex pieces
/// (ShapePair, shared and reused). Times are seconds after the start of the substep.
class PairMotion {
 public:
  PairMotion() = default;
  /// `horizon` (s) bounds the times that will be asked for.
  PairMotion(const ContactPair& pair, MotionKind kind, double dt, double horizon,
             ShapePair& pieces);
  /// Takes motions of the caller's own; such a PairMotion knows velocities and places, but not the
  /// gap.
  PairMotion(const ContactPair& pair, const RigidMotion& body, const RigidMotion& other)
      : pair_(pair), body_(body), other_(other) {}

  /// True if the two shapes can be followed at all.
  bool isFollowed() const { return followed_; }
  Proximity proximityAt(double s) const;
  /// Time of first contact at or after 0 of a pair that is apart at 0; infinity if there is none.
  double impactTime(double horizon) const;

  /// Approach speed (m/s) at `point` along `normal`; > 0 when the two bodies approach each other.
  double approachSpeedAt(const Vec3& point, const Vec3& normal, double s) const {
    return (other_.velocityAt(point, s) - body_.velocityAt(point, s)).dot(normal);
  }

  /// Inverse mean curvature (m) of one body where it touches (ImpulseEvent::radius).
  double radiusAt(PairSide side, double s, const Proximity& closest) const;
  /// Local shape of one body where it touches at the start; its rim axis is in the world frame.
  LocalShape shapeAt(PairSide side, const Proximity& closest) const;

  const ContactPair& pair() const { return pair_; }
  /// Motions of the two bodies, without the orientation of spheres, which is costly: see
  /// TrackedBody::actual.
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
