#pragma once

#include <array>
#include <optional>
#include <vector>

#include <BulletCollision/CollisionShapes/btConvexPointCloudShape.h>
#include <BulletCollision/CollisionShapes/btTriangleShape.h>
#include <btBulletCollisionCommon.h>

#include "carom/audio/vector.h"

namespace carom::bullet {

/// Curvature of a surface where it is touched.
struct LocalShape {
  /// 1 / mean curvature, in m; a flat surface has infinity, an edge or corner 0.
  double radius = 0.0;
  /// The smaller principal radius, in m; a flat surface has infinity, an edge or corner 0.
  double rollingRadius = 0.0;
  /// Unit axis, of either sign, of the round rim that is touched; zero if it is no rim.
  Vec3 rimAxis = Vec3::Zero();
  double rimRadius = 0.0;  ///< m
};

/// A convex set as Bullet collides it: a core rounded by a margin. It is a view of a shape, not a
/// copy: cheap to make from the shape when it is needed, and not to be kept over a change of it.
/// Coordinates are the piece's own unless said otherwise. [any thread]
class ConvexPiece {
 public:
  enum class Core {
    point,
    segment,
    box,
    cylinder,
    cone,    ///< apex up, the origin halfway between apex and base
    points,  ///< hull of scaled points
    triangle,
    spheres,    ///< hull of spheres
    halfSpace,  ///< n . x <= planeConstant
    sampled     ///< through Bullet's virtual support function: rounded to btScalar
  };

  /// Returns the set that Bullet's GJK sees of a convex shape; nothing for a shape without extent
  /// or points.
  static std::optional<ConvexPiece> from(const btConvexShape& shape);
  static ConvexPiece from(const btStaticPlaneShape& plane);
  static ConvexPiece from(const std::array<Vec3, 3>& triangle, double margin);

  /// Returns a box with sharp edges, as Bullet takes it against boxes and planes.
  ConvexPiece withSharpEdges() const;

  /// Moves the piece into the frame of the body that it is part of.
  void place(const Eigen::Matrix3d& rotation, const Vec3& offset);

  Core core() const { return core_; }
  double margin() const { return margin_; }
  void setMargin(double margin) { margin_ = margin; }
  const Eigen::Matrix3d& rotation() const { return rotation_; }  ///< piece to body
  const Vec3& offset() const { return offset_; }                 ///< m, body frame
  /// Centre (m, body frame) of a ball around the core; not for half spaces.
  const Vec3& ballCentre() const { return ballCentre_; }
  double coreBall() const { return ballRadius_; }        ///< m, radius around the core
  double ball() const { return ballRadius_ + margin_; }  ///< m, radius around the surface
  /// Upper bound (m) of the distance of the core's points from the body's centre.
  double coreReach() const { return ballCentre_.norm() + ballRadius_; }
  /// Centre (m) of that ball in the piece's own frame.
  const Vec3& ownBallCentre() const { return ownBallCentre_; }
  /// False if the piece's own frame is that of the body.
  bool isPlaced() const { return placed_; }

  /// Outward unit normal of a half space; of a triangle, to either side, or zero if it has no area.
  const Vec3& planeNormal() const { return half_; }
  const Vec3& anyCorner() const { return corners_[0]; }  ///< m, triangles only
  double planeConstant() const { return radius_; }       ///< m

  /// Returns the point of the core that lies farthest in a direction of any length.
  Vec3 support(const Vec3& direction) const;
  /// Appends the corners of the core within `depth` (m) of the farthest in the unit direction; for
  /// a round core, points of its rim or ends that span the place.
  void appendCorners(const Vec3& direction, double depth, std::vector<Vec3>& corners) const;
  /// Returns the curvature where the surface is touched from outside along the unit direction.
  LocalShape shapeFacing(const Vec3& direction) const;

 private:
  void readRound(const btConvexShape& shape);
  bool readPoints(const btConvexShape& shape);
  bool readSpheres(const btMultiSphereShape& shape);
  void setTriangle(const std::array<Vec3, 3>& corners);
  void scaleBy(double factor);
  void findBall();
  Vec3 pointAt(int index) const;
  Vec3 farthestPoint(const Vec3& direction) const;
  Vec3 farthestOfSpheres(const Vec3& direction) const;
  Vec3 rimTowards(const Vec3& direction, double height) const;
  Vec3 supportOfSample(const Vec3& direction) const;
  void appendRoundCorners(const Vec3& direction, std::vector<Vec3>& corners) const;
  LocalShape shapeOfPoints(const Vec3& direction) const;
  LocalShape shapeOfSpheres(const Vec3& direction) const;
  LocalShape shapeOfCone(double axial) const;

  Core core_ = Core::point;
  double margin_ = 0.0;
  Eigen::Matrix3d rotation_ = Eigen::Matrix3d::Identity();
  Vec3 offset_ = Vec3::Zero();
  Vec3 ballCentre_ = Vec3::Zero();
  Vec3 ownBallCentre_ = Vec3::Zero();
  double ballRadius_ = 0.0;
  bool placed_ = false;

  Vec3 half_ = Vec3::Zero();  // box: half extents; half space, triangle: normal
  int axis_ = 1;              // segment, cylinder, cone
  double radius_ = 0.0;       // cylinder, cone; half space: constant
  double halfHeight_ = 0.0;   // segment, cylinder, cone
  std::array<Vec3, 3> corners_{};
  const btVector3* points_ = nullptr;
  int pointCount_ = 0;
  Vec3 scale_ = Vec3::Ones();
  const btConvexShape* shape_ = nullptr;  // spheres, sampled
};

}  // namespace carom::bullet
