#pragma once

#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "bullet_bridge/tracking/impact_solver.h"
#include "bullet_bridge/tracking/pair_motion.h"
#include "bullet_bridge/tracking/solved_contact.h"

namespace carom::bullet {

/// An impact of a pair: its time, its points, and the motion on which it was found.
struct FoundImpact {
  PairMotion motion;       ///< with the orientation of spheres left out
  double s = 0.0;          ///< s, time of impact on that motion
  double offset = 0.0;     ///< s, time of impact after the start of the substep
  double nodeSpeed = 0.0;  ///< m/s, approach at the node, from which Bullet decides on a bounce
  /// Approach speed (m/s) from the velocities at the start of the substep and the fall from there.
  /// It is zero for bodies that lie on each other but for rounding, though Bullet lets them fall
  /// for a substep and meet at g dt.
  double initialSpeed = std::numeric_limits<double>::infinity();
  double since = 0.0;   ///< s, start of the substep in which they met, after that of this one
  bool solved = false;  ///< Bullet has acted on it in this substep
  double radius = 0.0;  ///< m, as ImpulseEvent::radius, of the pair's `body`
  double otherRadius = 0.0;
  std::span<const ContactPoint> points = {};
};

/// Finds the impact of a pair in a substep: when and where the two first meet. Each search returns
/// nullptr if there is none; its result is valid until the next call. [physics thread]
class ImpactFinder {
 public:
  /// `dt` (s) is the substep's length; an approach of up to `restSpeed` (m/s) counts as rest.
  struct Substep {
    double dt = 0.0;
    double restSpeed = 0.0;
  };

  /// The motion of the two bodies in the substep before, of length `dt` (s).
  struct PreviousSubstep {
    const SubstepMotion& body;
    const SubstepMotion& other;
    double dt = 0.0;
  };

  /// Returns the speed (m/s) along a normal at which the bodies approached each other at a point as
  /// that substep ended; nothing if one of them was not known.
  static std::optional<double> approachAtEnd(const PreviousSubstep& previous, const Vec3& point,
                                             const Vec3& normal);

  /// Searches the path that the bodies took, for a pair that is apart at its start, by `gap` (m).
  /// If that is not known, and negative therefore, pairs that overlap at the start have no impact.
  const FoundImpact* alongPath(const PairMotion& now, double gap, const Substep& substep);
  /// Searches the path that the bodies would have taken, for a pair where Bullet's solver acted on
  /// a gap (a speculative contact), so that the bodies do not touch, or touch too slowly.
  const FoundImpact* speculative(const PairMotion& now, const Proximity& start,
                                 const SolvedContact& solved, const Substep& substep);
  /// Searches the path in the substep before, for a pair that was apart as it began and on which
  /// Bullet's solver has acted in this one.
  const FoundImpact* before(const ContactPair& now, const Substep& substep,
                            const PreviousSubstep& previous);
  /// Handles spheres and planes that overlap at the start without having touched, because the host
  /// or rounding has brought them together; the impact is dated at the start.
  const FoundImpact* overlapping(const PairMotion& now, const Substep& substep);
  /// Handles other shapes that overlap at the start: new points of a contact that approach there.
  /// The impact is dated when the deepest of them met the other surface in the substep before, as
  /// an offset below zero.
  const FoundImpact* newPoints(const PairMotion& now, const Proximity& start,
                               const SolvedContact& solved, const Substep& substep,
                               const PreviousSubstep& previous);

  /// The pieces to make a PairMotion with.
  ShapePair& pieces() { return pieces_; }

 private:
  FoundImpact& begin(const PairMotion& motion);
  bool isOnSurface(const PairMotion& now, const SolvedPoint& point);
  bool pointsOutwards(const MovingShape& shape, const Vec3& place, const Vec3& normal,
                      double height);
  // Limits of the corners that follow the first and count to its impact.
  struct ImpactWindow {
    double depth = 0.0;   // m, above the first contact
    double latest = 0.0;  // s, after it
  };
  bool collectPoints(const Proximity& closest, const ImpactWindow& window);
  void keepOutermost(const Vec3& normal);
  double delayOf(const ContactPoint& point, const Proximity& closest) const;
  void dateBack(const Proximity& closest, const PreviousSubstep& previous);

  ShapePair pieces_;      // on the path that the caller asked for
  ShapePair freePieces_;  // on the path without the solver
  ShapePair probe_;
  btSphereShape probeShape_{btScalar(0)};
  TrackedBody bodyBefore_, otherBefore_;  // a substep ago
  FoundImpact found_;
  std::vector<ContactPoint> points_;
};

/// Approach speed (m/s) of a pair at a point at the start of the substep, from the velocities at
/// that node before or after the solver. Node velocities are free of the g dt/2 by which a resting
/// body bobs between nodes.
double approachAtNode(const ContactPair& pair, MotionKind kind, const Vec3& point,
                      const Vec3& normal);

/// Approach speed (m/s) at the later time `s` of a path, from the node's velocities and the places
/// of the bodies at that time.
double approachWithNode(const PairMotion& motion, MotionKind kind, const Proximity& closest,
                        double s);

}  // namespace carom::bullet
