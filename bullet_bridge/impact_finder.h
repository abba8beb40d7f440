#pragma once

#include <limits>
#include <span>
#include <vector>

#include "bullet_bridge/blow.h"
#include "bullet_bridge/pair_motion.h"
#include "bullet_bridge/solved_contact.h"

namespace carom::bullet {

/// An impact of a pair: when, where, and on which motion.
struct FoundImpact {
  PairMotion motion;       ///< with the orientation of spheres left out
  double s = 0.0;          ///< s, on that motion
  double offset = 0.0;     ///< s, after the start of the substep
  double nodeSpeed = 0.0;  ///< m/s, approach at the node where Bullet solves: what it goes by
  /// m/s, approach by what they had at the start of the substep and by their fall from there. That
  /// of bodies that lie on each other but for rounding is none, though Bullet lets them fall for a
  /// substep and meet at g dt.
  double onset = std::numeric_limits<double>::infinity();
  bool solved = false;  ///< Bullet has acted on it in this substep
  double radius = 0.0;  ///< m, as ImpulseEvent::radius, of the pair's `body`
  double otherRadius = 0.0;
  std::span<const BlowPoint> points = {};
};

/// Finds the first touch of a pair in a substep: nullptr if there is none, else valid until the
/// next call. [physics thread]
class ImpactFinder {
 public:
  /// dt is the substep's length; an approach up to `restSpeed` (m/s) is none.
  struct Substep {
    double dt = 0.0;
    double restSpeed = 0.0;
  };

  /// What the two did in the substep before.
  struct PreviousSubstep {
    const SubstepMotion& body;
    const SubstepMotion& other;
    double dt = 0.0;
  };

  /// On the way that the bodies went, apart at its start.
  const FoundImpact* within(const PairMotion& now, const Proximity& start, const Substep& substep);
  /// Bullet's solver acted on a gap, so that the bodies do not touch, or too slowly: on the way
  /// that they would have gone.
  const FoundImpact* prevented(const PairMotion& now, const Proximity& start,
                               const SolvedContact& solved, const Substep& substep);
  /// Spheres and planes that overlap at the start without having touched: the host, or rounding,
  /// has brought them together. Dated there.
  const FoundImpact* overlapping(const PairMotion& now, const Substep& substep);
  /// Other shapes that overlap at the start: new points of a contact that approach there. Dated
  /// where the deepest of them met the other surface in the substep before, as an offset below
  /// zero.
  const FoundImpact* newPoints(const PairMotion& now, const SolvedContact& solved,
                               const Substep& substep, const PreviousSubstep& previous);

  /// For PairMotion.
  ShapePair& pieces() { return pieces_; }

 private:
  FoundImpact& begin(const PairMotion& motion);
  bool isOnSurface(const PairMotion& now, const SolvedPoint& point);
  bool isOutwards(const MovingShape& shape, const Vec3& place, const Vec3& normal, double height);
  // Which corners count that follow the first.
  struct Following {
    double depth = 0.0;   // m, above the touch
    double latest = 0.0;  // s, after it
  };
  bool complete(const Proximity& touch, const Following& following);
  void keepOutermost(const Vec3& normal);
  double delayOf(const BlowPoint& point, const Proximity& touch) const;
  void dateBack(const Proximity& touch, const PreviousSubstep& previous);

  ShapePair pieces_;      // of the way that the caller asked for
  ShapePair freePieces_;  // of the other way
  ShapePair probe_;
  btSphereShape probeShape_{btScalar(0)};
  FoundImpact found_;
  std::vector<BlowPoint> points_;
};

/// m/s, approach of a pair at a point at the start of the substep, with the velocities of that node
/// before or after the solver. Velocities at the nodes are free of the g dt/2 by which a resting
/// body bobs between them.
double approachAtNode(const ContactPair& pair, Way way, const Vec3& point, const Vec3& normal);

/// m/s, the same at a later point of a way: the node's velocities, at where the bodies are then.
double approachWithNode(const PairMotion& motion, Way way, const Proximity& touch, double s);

}  // namespace carom::bullet
