#include "bullet_bridge/shapes/convex_piece.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bullet_bridge/geometry/to_vec3.h"

namespace carom::bullet {
namespace {

constexpr double kFlat = std::numeric_limits<double>::infinity();

// Angle (rad) within which a normal counts as that of a face; coarser than the rounding of a float
// pose.
constexpr double kSameDirection = 1e-5;

Vec3 unit(int axis) {
  return Vec3::Unit(static_cast<Eigen::Index>(axis));
}

double component(const Vec3& v, int axis) {
  return v[static_cast<Eigen::Index>(axis)];
}

btVector3 toBullet(const Vec3& v) {
  return {static_cast<btScalar>(v.x()), static_cast<btScalar>(v.y()), static_cast<btScalar>(v.z())};
}

// A margin larger than the shape would turn it inside out.
Vec3 notNegative(const Vec3& v) {
  return v.cwiseMax(0.0);
}

// Curvature of a feature whose corners span `dimensions` dimensions: a corner, an edge or a face.
LocalShape shapeOfFeature(int dimensions) {
  return dimensions == 2 ? LocalShape{kFlat, kFlat} : LocalShape{};
}

}  // namespace

std::optional<ConvexPiece> ConvexPiece::from(const btConvexShape& shape) {
  if (shape.getShapeType() == UNIFORM_SCALING_SHAPE_PROXYTYPE) {
    const auto& scaling = static_cast<const btUniformScalingShape&>(shape);
    auto piece = from(*scaling.getChildShape());
    if (piece) piece->scaleBy(static_cast<double>(scaling.getUniformScalingFactor()));
    return piece;
  }
  ConvexPiece piece;
  piece.shape_ = &shape;
  piece.margin_ = static_cast<double>(shape.getMargin());
  piece.core_ = Core::sampled;
  if (shape.isPolyhedral() && !piece.readPoints(shape)) return std::nullopt;
  if (!shape.isPolyhedral()) piece.readRound(shape);
  piece.findBall();
  return piece;
}

ConvexPiece ConvexPiece::from(const btStaticPlaneShape& plane) {
  ConvexPiece piece;
  piece.core_ = Core::halfSpace;
  const Vec3 normal = toVec3(plane.getPlaneNormal());
  piece.half_ = normal.normalized();
  piece.radius_ = static_cast<double>(plane.getPlaneConstant()) / normal.norm();
  return piece;
}

ConvexPiece ConvexPiece::from(const std::array<Vec3, 3>& triangle, double margin) {
  ConvexPiece piece;
  piece.setTriangle(triangle);
  piece.margin_ = margin;
  piece.findBall();
  return piece;
}

void ConvexPiece::setTriangle(const std::array<Vec3, 3>& corners) {
  core_ = Core::triangle;
  corners_ = corners;
  const Vec3 normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
  const double length = normal.norm();
  if (length > 0.0) half_ = normal / length;
}

bool ConvexPiece::readPoints(const btConvexShape& shape) {
  const int type = shape.getShapeType();
  if (type == BOX_SHAPE_PROXYTYPE) {
    core_ = Core::box;
    half_ =
        notNegative(toVec3(static_cast<const btBoxShape&>(shape).getHalfExtentsWithoutMargin()));
  } else if (type == CONVEX_HULL_SHAPE_PROXYTYPE) {
    const auto& hull = static_cast<const btConvexHullShape&>(shape);
    core_ = Core::points;
    pointCount_ = hull.getNumPoints();
    if (pointCount_ > 0) points_ = hull.getUnscaledPoints();
    scale_ = toVec3(hull.getLocalScalingNV());
    return pointCount_ > 0;
  } else if (type == CONVEX_POINT_CLOUD_SHAPE_PROXYTYPE) {
    const auto& cloud = static_cast<const btConvexPointCloudShape&>(shape);
    core_ = Core::points;
    points_ = const_cast<btConvexPointCloudShape&>(cloud).getUnscaledPoints();
    pointCount_ = cloud.getNumPoints();
    scale_ = toVec3(cloud.getLocalScalingNV());
    return pointCount_ > 0;
  } else if (type == TRIANGLE_SHAPE_PROXYTYPE) {
    const auto& triangle = static_cast<const btTriangleShape&>(shape);
    setTriangle({toVec3(triangle.getVertexPtr(0)), toVec3(triangle.getVertexPtr(1)),
                 toVec3(triangle.getVertexPtr(2))});
  }
  return true;
}

void ConvexPiece::readRound(const btConvexShape& shape) {
  switch (shape.getShapeType()) {
    case SPHERE_SHAPE_PROXYTYPE:
      core_ = Core::point;
      break;
    case CAPSULE_SHAPE_PROXYTYPE: {
      const auto& capsule = static_cast<const btCapsuleShape&>(shape);
      core_ = Core::segment;
      axis_ = capsule.getUpAxis();
      halfHeight_ = static_cast<double>(capsule.getHalfHeight());
      margin_ = static_cast<double>(capsule.getRadius());
      break;
    }
    case CYLINDER_SHAPE_PROXYTYPE: {
      const auto& cylinder = static_cast<const btCylinderShape&>(shape);
      const Vec3 half = notNegative(toVec3(cylinder.getHalfExtentsWithoutMargin()));
      core_ = Core::cylinder;
      axis_ = cylinder.getUpAxis();
      radius_ = component(half, axis_ == 0 ? 1 : 0);
      halfHeight_ = component(half, axis_);
      break;
    }
    case CONE_SHAPE_PROXYTYPE: {
      const auto& cone = static_cast<const btConeShape&>(shape);
      core_ = Core::cone;
      axis_ = cone.getConeUpIndex();
      radius_ = static_cast<double>(cone.getRadius());
      halfHeight_ = 0.5 * static_cast<double>(cone.getHeight());
      break;
    }
    case MULTI_SPHERE_SHAPE_PROXYTYPE:
      readSpheres(static_cast<const btMultiSphereShape&>(shape));
      break;
    default:
      break;
  }
}

// Bullet's own core of a multi-sphere is the hull of spheres smaller by the margin, which may turn
// inside out; with the margin back on, it is the same set as this one. An unevenly scaled one has
// no known form.
bool ConvexPiece::readSpheres(const btMultiSphereShape& shape) {
  scale_ = toVec3(shape.getLocalScaling());
  if (!scale_.isConstant(scale_.x()) || !(scale_.x() > 0.0) || shape.getSphereCount() == 0) {
    scale_ = Vec3::Ones();
    return false;
  }
  core_ = Core::spheres;
  pointCount_ = shape.getSphereCount();
  double least = kFlat;
  for (int i = 0; i < pointCount_; ++i)
    least = std::min(least, static_cast<double>(shape.getSphereRadius(i)));
  radius_ = least;  // unscaled part of all radii that the margin takes over
  margin_ = scale_.x() * least;
  return true;
}

void ConvexPiece::scaleBy(double factor) {
  margin_ *= factor;
  if (core_ != Core::triangle) half_ *= factor;
  halfHeight_ *= factor;
  if (core_ != Core::spheres) radius_ *= factor;
  scale_ *= factor;
  for (Vec3& corner : corners_)
    corner *= factor;
  findBall();
}

ConvexPiece ConvexPiece::withSharpEdges() const {
  ConvexPiece sharp = *this;
  // Computed in Bullet's own precision, which gives back the size that the box was made with.
  sharp.half_ =
      scale_.x() * toVec3(static_cast<const btBoxShape*>(shape_)->getHalfExtentsWithMargin());
  sharp.margin_ = 0.0;
  sharp.ballRadius_ = sharp.half_.norm();
  return sharp;
}

void ConvexPiece::place(const Eigen::Matrix3d& rotation, const Vec3& offset) {
  rotation_ = rotation;
  offset_ = offset;
  placed_ = !rotation.isIdentity(0.0) || !offset.isZero(0.0);
  ballCentre_ = offset + rotation * ownBallCentre_;
}

Vec3 ConvexPiece::pointAt(int index) const {
  return toVec3(points_[index]).cwiseProduct(scale_);
}

void ConvexPiece::findBall() {
  ballCentre_ = ownBallCentre_ = Vec3::Zero();
  switch (core_) {
    case Core::point:
    case Core::halfSpace:
      ballRadius_ = 0.0;
      return;
    case Core::segment:
      ballRadius_ = halfHeight_;
      return;
    case Core::box:
      ballRadius_ = half_.norm();
      return;
    case Core::cylinder:
    case Core::cone:
      ballRadius_ = std::hypot(radius_, halfHeight_);
      return;
    default:
      break;
  }
  Vec3 low, high;
  for (int axis = 0; axis < 3 && core_ != Core::triangle; ++axis) {
    low[axis] = component(support(-unit(axis)), axis);
    high[axis] = component(support(unit(axis)), axis);
  }
  if (core_ == Core::triangle) {  // made anew for each search
    low = corners_[0].cwiseMin(corners_[1]).cwiseMin(corners_[2]);
    high = corners_[0].cwiseMax(corners_[1]).cwiseMax(corners_[2]);
  }
  ballCentre_ = ownBallCentre_ = 0.5 * (low + high);
  ballRadius_ = 0.5 * (high - low).norm();
  if (core_ != Core::points && core_ != Core::triangle) return;
  double farthest = 0.0;
  const int count = core_ == Core::points ? pointCount_ : 3;
  for (int i = 0; i < count; ++i) {
    const Vec3 point = core_ == Core::points ? pointAt(i) : corners_[static_cast<std::size_t>(i)];
    farthest = std::max(farthest, (point - ballCentre_).squaredNorm());
  }
  ballRadius_ = std::sqrt(farthest);
}

Vec3 ConvexPiece::farthestPoint(const Vec3& direction) const {
  const Vec3 scaled = direction.cwiseProduct(scale_);
  int best = 0;
  double farthest = -kFlat;
  for (int i = 0; i < pointCount_; ++i) {
    const double along = scaled.dot(toVec3(points_[i]));
    if (along > farthest) {
      farthest = along;
      best = i;
    }
  }
  return pointAt(best);
}

Vec3 ConvexPiece::farthestOfSpheres(const Vec3& direction) const {
  const auto& spheres = static_cast<const btMultiSphereShape&>(*shape_);
  const double length = direction.norm();
  int best = 0;
  double farthest = -kFlat;
  for (int i = 0; i < pointCount_; ++i) {
    const double along = direction.dot(toVec3(spheres.getSpherePosition(i))) +
                         length * static_cast<double>(spheres.getSphereRadius(i));
    if (along > farthest) {
      farthest = along;
      best = i;
    }
  }
  const double radius = static_cast<double>(spheres.getSphereRadius(best)) - radius_;
  Vec3 point = toVec3(spheres.getSpherePosition(best));
  if (length > 0.0) point += (radius / length) * direction;
  return scale_.x() * point;
}

// Returns the point of the circle of the piece's radius at a height that lies farthest in a
// direction.
Vec3 ConvexPiece::rimTowards(const Vec3& direction, double height) const {
  Vec3 across = direction - component(direction, axis_) * unit(axis_);
  const double length = across.norm();
  across = length > 0.0 ? Vec3((radius_ / length) * across) : Vec3(radius_ * unit((axis_ + 1) % 3));
  return across + height * unit(axis_);
}

Vec3 ConvexPiece::supportOfSample(const Vec3& direction) const {
  const double length = direction.norm();
  const Vec3 towards = length > 0.0 ? Vec3(direction / length) : Vec3::UnitX();
  const btVector3 point = shape_->localGetSupportingVertexWithoutMargin(toBullet(towards));
  return scale_.x() * toVec3(point);
}

Vec3 ConvexPiece::support(const Vec3& direction) const {
  switch (core_) {
    case Core::segment:
      return std::copysign(halfHeight_, component(direction, axis_)) * unit(axis_);
    case Core::box:
      return {std::copysign(half_.x(), direction.x()), std::copysign(half_.y(), direction.y()),
              std::copysign(half_.z(), direction.z())};
    case Core::cylinder:
      return rimTowards(direction, std::copysign(halfHeight_, component(direction, axis_)));
    case Core::cone: {
      const Vec3 apex = halfHeight_ * unit(axis_);
      const Vec3 rim = rimTowards(direction, -halfHeight_);
      return direction.dot(apex) > direction.dot(rim) ? apex : rim;
    }
    case Core::points:
      return farthestPoint(direction);
    case Core::triangle: {
      const double first = direction.dot(corners_[0]);
      const double second = direction.dot(corners_[1]);
      const double third = direction.dot(corners_[2]);
      if (first >= second) return first >= third ? corners_[0] : corners_[2];
      return second >= third ? corners_[1] : corners_[2];
    }
    case Core::spheres:
      return farthestOfSpheres(direction);
    case Core::sampled:
      return supportOfSample(direction);
    default:
      return Vec3::Zero();
  }
}

void ConvexPiece::appendRoundCorners(const Vec3& direction, std::vector<Vec3>& corners) const {
  const Vec3 lowest = rimTowards(direction, 0.0);
  const Vec3 beside = unit(axis_).cross(lowest);
  for (const double height : {-halfHeight_, halfHeight_}) {
    const Vec3 centre = height * unit(axis_);
    if (core_ == Core::cone && height > 0.0) {
      corners.push_back(centre);
    } else {
      for (const Vec3& spoke : {lowest, beside, Vec3(-lowest), Vec3(-beside)})
        corners.emplace_back(centre + spoke);
    }
  }
}

void ConvexPiece::appendCorners(const Vec3& direction, double depth,
                                std::vector<Vec3>& corners) const {
  const std::size_t first = corners.size();
  switch (core_) {
    case Core::segment:
      corners.emplace_back(halfHeight_ * unit(axis_));
      corners.emplace_back(-halfHeight_ * unit(axis_));
      break;
    case Core::box:
      for (int i = 0; i < 8; ++i) {
        corners.emplace_back((i & 1) != 0 ? half_.x() : -half_.x(),
                             (i & 2) != 0 ? half_.y() : -half_.y(),
                             (i & 4) != 0 ? half_.z() : -half_.z());
      }
      break;
    case Core::cylinder:
    case Core::cone:
      appendRoundCorners(direction, corners);
      break;
    case Core::points:
      for (int i = 0; i < pointCount_; ++i)
        corners.push_back(pointAt(i));
      break;
    case Core::triangle:
      corners.insert(corners.end(), corners_.begin(), corners_.end());
      break;
    case Core::spheres: {
      const auto& spheres = static_cast<const btMultiSphereShape&>(*shape_);
      for (int i = 0; i < pointCount_; ++i) {
        const double radius = static_cast<double>(spheres.getSphereRadius(i)) - radius_;
        corners.emplace_back(scale_.x() *
                             (toVec3(spheres.getSpherePosition(i)) + radius * direction));
      }
      break;
    }
    default:
      corners.push_back(support(direction));
  }
  const double least = direction.dot(support(direction)) - depth;
  const auto tooHigh = [&](const Vec3& corner) { return direction.dot(corner) < least; };
  const auto begin = corners.begin() + static_cast<std::ptrdiff_t>(first);
  corners.erase(std::remove_if(begin, corners.end(), tooHigh), corners.end());
}

// The corners that lie as far out as the farthest make the feature; a second one makes it an edge,
// a third off their line a face.
LocalShape ConvexPiece::shapeOfPoints(const Vec3& direction) const {
  const bool cloud = core_ == Core::points;
  const Vec3 first = support(direction);
  const double same = kSameDirection * ballRadius_;
  Vec3 edge = Vec3::Zero();
  double area = 0.0;
  for (int pass = 0; pass < 2; ++pass) {
    for (int i = 0; i < (cloud ? pointCount_ : 3); ++i) {
      const Vec3 arm = (cloud ? pointAt(i) : corners_[static_cast<std::size_t>(i)]) - first;
      if (-direction.dot(arm) > same) continue;
      if (pass == 0 && arm.squaredNorm() > edge.squaredNorm()) edge = arm;
      if (pass == 1) area = std::max(area, arm.cross(edge).norm());
    }
  }
  return shapeOfFeature(area > same * edge.norm() ? 2 : 1);
}

LocalShape ConvexPiece::shapeOfSpheres(const Vec3& direction) const {
  const auto& spheres = static_cast<const btMultiSphereShape&>(*shape_);
  const double farthest = direction.dot(support(direction));
  int touched = 0;
  double radius = 0.0;
  for (int i = 0; i < pointCount_; ++i) {
    const double own = static_cast<double>(spheres.getSphereRadius(i));
    const double along = direction.dot(toVec3(spheres.getSpherePosition(i))) + own - radius_;
    if (scale_.x() * along < farthest - kSameDirection * ballRadius_) continue;
    ++touched;
    radius = std::max(radius, scale_.x() * own);
  }
  if (touched == 1) return {radius, radius};
  return touched == 2 ? LocalShape{2.0 * radius, radius} : LocalShape{kFlat, kFlat};
}

// `axial` is the sine of the direction's elevation over the base. The side is touched along a line;
// half its length is as good a place as any for its curvature. The mean curvature is half of it,
// since the line is straight.
LocalShape ConvexPiece::shapeOfCone(double axial) const {
  const double side = std::hypot(radius_, 2.0 * halfHeight_);
  if (axial < kSameDirection - 1.0) return {kFlat, kFlat};
  if (std::abs(axial - radius_ / side) > kSameDirection) return {};
  const double rolling = 0.5 * radius_ * side / (2.0 * halfHeight_) + margin_;
  return {2.0 * rolling, rolling};
}

LocalShape ConvexPiece::shapeFacing(const Vec3& direction) const {
  const double axial = component(direction, axis_);
  switch (core_) {
    case Core::point:
      return {margin_, margin_};
    case Core::segment:
      if (std::abs(axial) < kSameDirection) return {2.0 * margin_, margin_};
      return {margin_, margin_};
    case Core::box:
      return shapeOfFeature((direction.cwiseAbs().array() < kSameDirection).count() == 2 ? 2 : 0);
    case Core::cylinder:
      if (std::abs(axial) < kSameDirection) return {2.0 * (radius_ + margin_), radius_ + margin_};
      if (std::abs(axial) > 1.0 - 0.5 * kSameDirection * kSameDirection) return shapeOfFeature(2);
      return {.rimAxis = unit(axis_), .rimRadius = radius_};
    case Core::cone:
      return shapeOfCone(axial);
    case Core::points:
    case Core::triangle:
      return shapeOfPoints(direction);
    case Core::spheres:
      return shapeOfSpheres(direction);
    case Core::halfSpace:
      return {kFlat, kFlat};
    default:
      return {};
  }
}

}  // namespace carom::bullet
