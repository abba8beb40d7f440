#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <btBulletCollisionCommon.h>

#include "bullet_bridge/geometry/rigid_motion.h"
#include "bullet_bridge/shapes/convex_piece.h"
#include "bullet_bridge/shapes/gjk.h"
#include "bullet_bridge/shapes/separation_bound.h"
#include "bullet_bridge/shapes/shape_parts.h"

namespace carom::bullet {

/// A Bullet shape and how its collision object's world transform moves.
struct MovingShape {
  const btCollisionShape* shape = nullptr;
  RigidMotion motion;
  const ShapeParts* parts = nullptr;  ///< of the shape, if the caller has them
};

/// The gap of two shapes, at the place where they are nearest.
struct Proximity {
  double gap = 0.0;                ///< m; if not positive they overlap, by roughly that much
  Vec3 normal = Vec3::UnitY();     ///< unit, world frame, from `other` to `body`
  Vec3 point = Vec3::Zero();       ///< m, world frame, on body's surface
  Vec3 otherPoint = Vec3::Zero();  ///< m, world frame, on other's surface
  std::size_t pair = 0;  ///< number of the two convex pieces, in the ShapePair that gave it
};

enum class PairSide { body, other };

/// Gap and time of first contact of two shapes in rigid motion, in double precision, on the surface
/// that Bullet's default dispatcher collides:
///  - sharp boxes against boxes and planes, rounded by their margin inside the same outline against
///    all else; hulls and cones inflated by their margin, cylinders rounded inside their outline;
///    two polyhedra of which both have polyhedral features collide with their hulls as they are;
///  - compounds child by child; meshes and terrain triangle by triangle, each inflated by the mesh
///    margin, but not against spheres, which also ignore triangles of no area;
///  - a static plane is a half space, a mesh is not: a body behind a triangle is free of it.
/// Not followed: concave shapes against each other, signed distance fields, soft bodies.
///
/// The time is found by conservative advancement (after Mirtich 1996, with the bound of
/// SeparationBound), which cannot miss an impact however fast the rotation. Shapes are read on
/// demand: after a change of a shape, a ShapePair needs a new set(), with new parts. Allocates only
/// until its vectors have grown to what the scene asks for. [any thread]
class ShapePair {
 public:
  /// Collects the convex pieces that may come within `reach` (m) of each other in [0, horizon] (s).
  /// False for pairs that cannot be followed; true, with an infinite gap, if merely none are near.
  bool set(const MovingShape& body, const MovingShape& other, double horizon, double reach);

  /// Returns the least gap over all pieces at time s; it is infinite if none are near.
  Proximity proximityAt(double s);

  /// Tells in which direction (from `other` to `body`, world frame) the shapes may be apart: the
  /// nearer to their normal, the faster the search.
  void guess(const Vec3& direction);
  /// Returns the direction of the pieces that were looked at first, as it is known by now; zero if
  /// there are none.
  Vec3 direction() const;

  /// Returns a lower bound (m) of the gaps at time 0 of the convex pieces that cannot meet, which
  /// `proximityAt` leaves out; infinity if there are none. It does not know of triangles.
  double leftOut() const { return leftOut_; }

  /// Returns the first time in [0, horizon] at which the shapes touch, infinity if none: exact to
  /// 1e-10 s at ordinary speeds. Pieces that overlap at 0 touch at 0.
  double impactTime();

  /// Returns the points where the shapes lie on each other around a contact: corners of either
  /// within `depth` (m) of, or below, the other's surface, up to kPatchPoints for two pieces. Each
  /// is on the surface of the shape whose corner it is. Valid until the next call.
  std::span<const Vec3> patchAt(double s, const Proximity& around, double depth);

  /// Returns the curvature of one side at a contact; flat if no pieces are near. Its axis is in the
  /// world frame.
  LocalShape localShape(PairSide side, double s, const Proximity& at) const;

  static constexpr std::size_t kPatchPoints = 8;

 private:
  using Leaf = ShapeParts::Leaf;
  using ConcaveLeaf = ShapeParts::ConcaveLeaf;
  struct Side : ShapeParts {
    MovingShape moving;
    double turn = 0.0;  // how far a point at a distance of 1 from the centre may turn
    // The latest pose that was asked for, which many pieces share.
    mutable Pose pose;
    mutable double posedAt = std::numeric_limits<double>::infinity();  // s
    const Pose& poseAt(double s) const;
  };
  // Two convex pieces; a half space is always `second`.
  struct Pair {
    std::uint32_t first = 0, second = 0;
    bool flipped = false;      // `first` belongs to `other`
    Vec3 axis = Vec3::Zero();  // latest known direction from second to first
    NearestCorners corners;    // as they were found last
    double apart = 0.0;        // m, lower bound of the gap at time 0; not positive if not known
    double least = 0.0;        // m, lower bound of the gap at the latest time that was asked for
  };
  struct Placed {
    PlacedPiece first, second;  // relative to the centre of first's body
    Vec3 origin, centres;       // first's centre: in the world frame, and relative to second's
  };

  void pairConvex();
  void pairConcave(Side& convex, Side& concave, bool flipped);
  void pairTriangles(Side& convex, const Leaf& leaf, Side& concave, const ConcaveLeaf& mesh,
                     bool flipped);
  std::uint32_t variantAgainst(Side& side, Leaf& leaf, const Leaf& against);
  static Pair pairOf(std::uint32_t first, std::uint32_t second, bool flipped);
  void addPair(std::uint32_t first, std::uint32_t second, bool flipped);
  double travelOf(const Pair& pair, double reach, double otherReach) const;
  bool mayMeet(const Pair& pair);

  const Side& firstOf(const Pair& pair) const { return pair.flipped ? other_ : body_; }
  const Side& secondOf(const Pair& pair) const { return pair.flipped ? body_ : other_; }
  Placed place(const Pair& pair, double s) const;
  double gapAt(Pair& pair, double s);
  void orderByBounds(double s);
  double impactTime(Pair& pair, double horizon);
  double searchImpact(Pair& pair, double from, double horizon);
  SeparationBound::Pieces piecesAt(const Pair& pair, const Placed& placed, double s) const;
  static CoreDistance nearDistance(Pair& pair, const Placed& placed);
  bool clearsAlong(const Pair& pair, double horizon) const;
  using Clear = SeparationBound::Clear;
  static Clear clearTime(const Pair& pair, const SeparationBound::Pieces& pieces, double left);
  static Vec3 faceTowards(const Placed& placed);
  static double ballGap(const Placed& placed);
  static double leastGap(const Placed& placed);
  // A gap of more than `enough` (m) may be found too large.
  static Proximity proximityOf(Pair& pair, const Placed& placed, double enough);
  void appendPatch(const PlacedPiece& of, const PlacedPiece& on, const Vec3& towards, double depth);

  Side body_, other_;
  double horizon_ = 0.0;
  double reach_ = 0.0;
  double travel_ = 0.0;  // m, how far the centres may come towards each other
  double leftOut_ = 0.0;
  std::vector<Pair> pairs_;
  std::vector<std::size_t> order_;
  std::vector<Vec3> corners_;
  std::vector<Vec3> patch_;
};

}  // namespace carom::bullet
