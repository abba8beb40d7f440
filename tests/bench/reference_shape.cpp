#include "tests/bench/reference_shape.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <set>

#include <btBulletCollisionCommon.h>

namespace carom::bench {
namespace {

constexpr double kFar = std::numeric_limits<double>::infinity();

Vec3 toVec3(const btVector3& v) {
  return {double(v.x()), double(v.y()), double(v.z())};
}

Vec3 onWorld(const Placement& place, const Vec3& local) {
  return place.position + place.rotation * local;
}

Placement compose(const Placement& outer, const Placement& inner) {
  return {onWorld(outer, inner.position), outer.rotation * inner.rotation};
}

// ---- reading Bullet's shapes

// Three points span a face if all others are on one side of their plane.
void addFaces(Core& core) {
  const std::vector<Vec3>& points = core.points;
  std::set<std::pair<std::size_t, std::size_t>> edges;
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t j = i + 1; j < points.size(); ++j) {
      for (std::size_t k = j + 1; k < points.size(); ++k) {
        const Vec3 normal = (points[j] - points[i]).cross(points[k] - points[i]).normalized();
        double least = 0.0;
        double most = 0.0;
        for (const Vec3& point : points) {
          least = std::min(least, normal.dot(point - points[i]));
          most = std::max(most, normal.dot(point - points[i]));
        }
        const double flat = 1e-6 * (most - least);
        if (most > flat && least < -flat) continue;
        if (most > flat) core.triangles.push_back({i, k, j});
        if (least < -flat) core.triangles.push_back({i, j, k});
        edges.insert({{i, j}, {i, k}, {j, k}});
      }
    }
  }
  core.edges.assign(edges.begin(), edges.end());
}

Core hullCore(std::vector<Vec3> points, double rounding) {
  Core core;
  core.points = std::move(points);
  core.rounding = rounding;
  if (core.points.size() <= 2) {
    core.edges = {{0, core.points.size() - 1}};
  } else {
    addFaces(core);
  }
  return core;
}

std::vector<Vec3> cornersOf(const Vec3& half) {
  std::vector<Vec3> corners;
  for (int corner = 0; corner < 8; ++corner) {
    corners.emplace_back((corner & 1 ? 1 : -1) * half.x(), (corner & 2 ? 1 : -1) * half.y(),
                         (corner & 4 ? 1 : -1) * half.z());
  }
  return corners;
}

Core coreOfCylinder(const btCylinderShape& cylinder) {
  const Vec3 half = toVec3(cylinder.getHalfExtentsWithoutMargin());
  Core core;
  core.cylinder = {half.x(), half.y()};
  core.rounding = double(cylinder.getMargin());
  return core;
}

Core coreOfHull(const btConvexHullShape& hull) {
  std::vector<Vec3> points;
  for (int i = 0; i < hull.getNumPoints(); ++i)
    points.push_back(toVec3(hull.getScaledPoint(i)));
  return hullCore(points, double(hull.getMargin()));
}

ReferencePart partOf(const btCollisionShape& shape) {
  ReferencePart part;
  const double margin = double(shape.getMargin());
  switch (shape.getShapeType()) {
    case SPHERE_SHAPE_PROXYTYPE:
      part.core =
          hullCore({Vec3::Zero()}, double(static_cast<const btSphereShape&>(shape).getRadius()));
      return part;
    case CAPSULE_SHAPE_PROXYTYPE: {
      const auto& capsule = static_cast<const btCapsuleShape&>(shape);
      const Vec3 end(0, double(capsule.getHalfHeight()), 0);
      part.core = hullCore({end, -end}, double(capsule.getRadius()));
      return part;
    }
    case BOX_SHAPE_PROXYTYPE: {
      const auto& box = static_cast<const btBoxShape&>(shape);
      part.sharpBox = toVec3(box.getHalfExtentsWithMargin());
      part.core = hullCore(cornersOf(toVec3(box.getHalfExtentsWithoutMargin())), margin);
      return part;
    }
    case CYLINDER_SHAPE_PROXYTYPE:
      part.core = coreOfCylinder(static_cast<const btCylinderShape&>(shape));
      return part;
    case CONVEX_HULL_SHAPE_PROXYTYPE:
      part.core = coreOfHull(static_cast<const btConvexHullShape&>(shape));
      return part;
    default:
      std::abort();  // no case of this program has such a shape
  }
}

double reachOf(const ReferencePart& part) {
  double reach = 0.0;
  for (const Vec3& point : part.core.points)
    reach = std::max(reach, onWorld(part.place, point).norm());
  if (part.sharpBox) reach = std::max(reach, part.place.position.norm() + part.sharpBox->norm());
  if (part.core.cylinder) {
    const auto [radius, half] = *part.core.cylinder;
    reach = part.place.position.norm() + std::hypot(radius, half);
  }
  // A rounded point turns with the body unless it is at its centre.
  return part.place.position.isZero(0.0) ? reach : reach + part.core.rounding;
}

// ---- distances, all in the world frame

double pointToSegment(const Vec3& point, const Vec3& start, const Vec3& end) {
  const Vec3 along = end - start;
  const double length = along.squaredNorm();
  const double part =
      length > 0.0 ? std::clamp((point - start).dot(along) / length, 0.0, 1.0) : 0.0;
  return (start + part * along - point).norm();
}

double segmentToSegment(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  double least = std::min({pointToSegment(a, c, d), pointToSegment(b, c, d),
                           pointToSegment(c, a, b), pointToSegment(d, a, b)});
  const Vec3 across = (b - a).cross(d - c);
  const double square = across.squaredNorm();
  if (square == 0.0) return least;
  const double first = (c - a).cross(d - c).dot(across) / square;
  const double second = (c - a).cross(b - a).dot(across) / square;
  if (first < 0.0 || first > 1.0 || second < 0.0 || second > 1.0) return least;
  return std::min(least, std::abs((c - a).dot(across)) / std::sqrt(square));
}

// Height of a point above a triangle's inside; infinite for all other points.
double pointAboveTriangle(const Vec3& point, const Vec3& a, const Vec3& b, const Vec3& c) {
  constexpr double kEdge = 1e-12;  // m^2/m^2; a point on the edge is inside
  const Vec3 area = (b - a).cross(c - a);
  const double square = area.squaredNorm();
  const double height = (point - a).dot(area);
  if (height < 0.0 || square == 0.0) return kFar;
  const double second = (point - a).cross(c - a).dot(area) / square;
  const double third = (b - a).cross(point - a).dot(area) / square;
  if (second < -kEdge || third < -kEdge || second + third > 1.0 + kEdge) return kFar;
  return height / std::sqrt(square);
}

// A core with its points in world coordinates.
struct PlacedCore {
  const Core& core;
  Placement place;
  std::vector<Vec3> points;

  PlacedCore(const Core& of, const Placement& at) : core(of), place(at) {
    for (const Vec3& point : of.points)
      points.push_back(onWorld(at, point));
  }
};

double pointsAboveFaces(const PlacedCore& corners, const PlacedCore& faces) {
  double least = kFar;
  for (const auto& [a, b, c] : faces.core.triangles) {
    for (const Vec3& point : corners.points) {
      least = std::min(
          least, pointAboveTriangle(point, faces.points[a], faces.points[b], faces.points[c]));
    }
  }
  return least;
}

double hullToHull(const PlacedCore& first, const PlacedCore& second) {
  double least = std::min(pointsAboveFaces(first, second), pointsAboveFaces(second, first));
  for (const auto& [a, b] : first.core.edges) {
    for (const auto& [c, d] : second.core.edges) {
      least = std::min(least, segmentToSegment(first.points[a], first.points[b], second.points[c],
                                               second.points[d]));
    }
  }
  return least;
}

double pointToCylinder(const Vec3& point, const PlacedCore& cylinder) {
  const auto [radius, half] = *cylinder.core.cylinder;
  const Vec3 local = cylinder.place.rotation.transpose() * (point - cylinder.place.position);
  const double outside = std::max(0.0, std::hypot(local.x(), local.z()) - radius);
  const double beyond = std::max(0.0, std::abs(local.y()) - half);
  return std::hypot(outside, beyond);
}

// The distance to a convex body is convex along a line, so that golden section finds its minimum.
double segmentToCylinder(const Vec3& start, const Vec3& end, const PlacedCore& cylinder) {
  constexpr double kGolden = 0.6180339887498949;
  const auto at = [&](double part) {
    return pointToCylinder(start + part * (end - start), cylinder);
  };
  double low = 0.0;
  double high = 1.0;
  double left = at(1.0 - kGolden);
  double right = at(kGolden);
  for (int i = 0; i < 60; ++i) {
    if (left < right) {
      high = low + kGolden * (high - low);
      right = left;
      left = at(high - kGolden * (high - low));
    } else {
      low = high - kGolden * (high - low);
      left = right;
      right = at(low + kGolden * (high - low));
    }
  }
  return std::min({left, right, at(0.0), at(1.0)});
}

// Returns the point of a cylinder that is farthest along a direction.
Vec3 farthestOfCylinder(const PlacedCore& cylinder, const Vec3& direction) {
  const auto [radius, half] = *cylinder.core.cylinder;
  const Vec3 local = cylinder.place.rotation.transpose() * direction;
  const Vec3 radial(local.x(), 0, local.z());
  const Vec3 rim = radial.isZero(0.0) ? radial : Vec3(radius * radial.normalized());
  return onWorld(cylinder.place, rim + Vec3(0, std::copysign(half, local.y()), 0));
}

double hullToCylinder(const PlacedCore& hull, const PlacedCore& cylinder) {
  double least = kFar;
  for (const auto& [a, b] : hull.core.edges)
    least = std::min(least, segmentToCylinder(hull.points[a], hull.points[b], cylinder));
  for (const auto& [i, j, k] : hull.core.triangles) {
    const Vec3& a = hull.points[i];
    const Vec3& b = hull.points[j];
    const Vec3& c = hull.points[k];
    const Vec3 nearest = farthestOfCylinder(cylinder, -(b - a).cross(c - a));
    least = std::min(least, pointAboveTriangle(nearest, a, b, c));
  }
  return least;
}

double coreToCore(const PlacedCore& first, const PlacedCore& second) {
  if (first.core.cylinder && second.core.cylinder) std::abort();  // in no case of this program
  const double rounding = first.core.rounding + second.core.rounding;
  if (first.core.cylinder) return hullToCylinder(second, first) - rounding;
  if (second.core.cylinder) return hullToCylinder(first, second) - rounding;
  return hullToHull(first, second) - rounding;
}

double extentAlong(const Placement& box, const Vec3& half, const Vec3& axis) {
  return (box.rotation.transpose() * axis).cwiseAbs().dot(half);
}

// Separating axes: boxes are apart exactly if they are along a face normal or a cross product of
// edges.
double boxToBox(const Placement& first, const Vec3& firstHalf, const Placement& second,
                const Vec3& secondHalf) {
  std::vector<Vec3> axes;
  for (Eigen::Index i = 0; i < 3; ++i) {
    axes.push_back(first.rotation.col(i));
    axes.push_back(second.rotation.col(i));
    for (Eigen::Index j = 0; j < 3; ++j)
      axes.push_back(first.rotation.col(i).cross(second.rotation.col(j)));
  }
  double most = -kFar;
  for (const Vec3& axis : axes) {
    if (axis.squaredNorm() < 1e-12) continue;  // parallel edges; the face normals suffice
    const Vec3 unit = axis.normalized();
    most = std::max(most, std::abs(unit.dot(first.position - second.position)) -
                              extentAlong(first, firstHalf, unit) -
                              extentAlong(second, secondHalf, unit));
  }
  return most;
}

double partToPlane(const ReferencePart& part, const Placement& body, const Vec3& normal,
                   double offset) {
  const Placement place = compose(body, part.place);
  const double height = place.position.dot(normal) - offset;
  if (part.sharpBox) return height - extentAlong(place, *part.sharpBox, normal);
  const PlacedCore core(part.core, place);
  if (part.core.cylinder)
    return farthestOfCylinder(core, -normal).dot(normal) - offset - part.core.rounding;
  double least = kFar;
  for (const Vec3& point : core.points)
    least = std::min(least, point.dot(normal));
  return least - offset - part.core.rounding;
}

double partToPart(const ReferencePart& first, const Placement& firstBody,
                  const ReferencePart& second, const Placement& secondBody) {
  const Placement firstPlace = compose(firstBody, first.place);
  const Placement secondPlace = compose(secondBody, second.place);
  if (first.sharpBox && second.sharpBox)
    return boxToBox(firstPlace, *first.sharpBox, secondPlace, *second.sharpBox);
  return coreToCore(PlacedCore(first.core, firstPlace), PlacedCore(second.core, secondPlace));
}

}  // namespace

ReferenceShape ReferenceShape::of(const btCollisionShape& shape) {
  ReferenceShape reference;
  if (shape.getShapeType() == STATIC_PLANE_PROXYTYPE) {
    const auto& plane = static_cast<const btStaticPlaneShape&>(shape);
    reference.plane = {toVec3(plane.getPlaneNormal()), double(plane.getPlaneConstant())};
    return reference;
  }
  if (shape.isCompound()) {
    const auto& compound = static_cast<const btCompoundShape&>(shape);
    for (int child = 0; child < compound.getNumChildShapes(); ++child) {
      ReferencePart part = partOf(*compound.getChildShape(child));
      const btTransform& pose = compound.getChildTransform(child);
      part.place.position = toVec3(pose.getOrigin());
      for (int row = 0; row < 3; ++row)
        part.place.rotation.row(row) = toVec3(pose.getBasis().getRow(row)).transpose();
      reference.parts.push_back(part);
    }
  } else {
    reference.parts.push_back(partOf(shape));
  }
  for (const ReferencePart& part : reference.parts)
    reference.reach = std::max(reference.reach, reachOf(part));
  return reference;
}

double gapOf(const ReferenceShape& first, const Placement& firstPlace, const ReferenceShape& second,
             const Placement& secondPlace) {
  double least = kFar;
  for (const ReferencePart& part : first.parts) {
    if (second.plane) {
      least =
          std::min(least, partToPlane(part, firstPlace, second.plane->first, second.plane->second));
    }
    for (const ReferencePart& other : second.parts)
      least = std::min(least, partToPart(part, firstPlace, other, secondPlace));
  }
  return least;
}

}  // namespace carom::bench
