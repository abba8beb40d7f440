#include "bullet_bridge/shapes/shape_surface.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <BulletCollision/CollisionShapes/btConvexPointCloudShape.h>
#include <BulletCollision/Gimpact/btGImpactShape.h>
#include <LinearMath/btConvexHullComputer.h>

#include "audio/model/immortal.h"
#include "bullet_bridge/geometry/to_vec3.h"
#include "bullet_bridge/shapes/surface_union.h"

namespace carom::bullet {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kAround = 16;               // panels around an axis
constexpr int kCap = 4;                   // rings in the half sphere at a capsule's end
constexpr double kUnionTolerance = 1e-5;  // relative to the extent
constexpr double kWeld = 1e-6;            // relative to the extent
constexpr double kNoVolume = 1e-9;        // relative to the extent cubed

double number(btScalar value) {
  return static_cast<double>(value);
}

double extentOf(const SurfaceMesh& mesh) {
  Vec3 low = mesh.vertices.front();
  Vec3 high = low;
  for (const Vec3& vertex : mesh.vertices) {
    low = low.cwiseMin(vertex);
    high = high.cwiseMax(vertex);
  }
  return (high - low).maxCoeff();
}

void append(SurfaceMesh& mesh, const SurfaceMesh& other) {
  const auto offset = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), other.vertices.begin(), other.vertices.end());
  for (const auto& [first, second, third] : other.triangles)
    mesh.triangles.push_back({first + offset, second + offset, third + offset});
}

// ---- Polyhedra

// Appends a face of several points on one plane, as a fan.
void appendFace(const btConvexHullComputer& hull, int face, SurfaceMesh& mesh) {
  const btConvexHullComputer::Edge* const first = &hull.edges[hull.faces[face]];
  const auto start = static_cast<std::uint32_t>(first->getSourceVertex());
  for (const auto* edge = first->getNextEdgeOfFace(); edge != first;
       edge = edge->getNextEdgeOfFace()) {
    const auto from = static_cast<std::uint32_t>(edge->getSourceVertex());
    const auto to = static_cast<std::uint32_t>(edge->getTargetVertex());
    if (from != start && to != start) mesh.triangles.push_back({start, from, to});
  }
}

// btConvexHullComputer rounds coordinates to 1e-4 of the extent: its vertices are replaced by the
// points that they came from.
SurfaceMesh hullOf(const std::vector<Vec3>& points) {
  std::vector<double> coordinates;
  for (const Vec3& point : points)
    coordinates.insert(coordinates.end(), {point.x(), point.y(), point.z()});
  btConvexHullComputer hull;
  hull.compute(coordinates.data(), 3 * static_cast<int>(sizeof(double)),
               static_cast<int>(points.size()), btScalar(0), btScalar(0));
  SurfaceMesh mesh;
  for (int vertex = 0; vertex < hull.vertices.size(); ++vertex)
    mesh.vertices.push_back(points[static_cast<std::size_t>(hull.original_vertex_index[vertex])]);
  for (int face = 0; face < hull.faces.size(); ++face)
    appendFace(hull, face, mesh);
  if (signedVolume(mesh) < 0.0) {
    for (auto& triangle : mesh.triangles)
      std::swap(triangle[1], triangle[2]);
  }
  return mesh;
}

SurfaceMesh boxSurface(const Vec3& half) {
  SurfaceMesh mesh;
  for (unsigned corner = 0; corner < 8; ++corner) {
    mesh.vertices.emplace_back((corner & 1U) != 0 ? half.x() : -half.x(),
                               (corner & 2U) != 0 ? half.y() : -half.y(),
                               (corner & 4U) != 0 ? half.z() : -half.z());
  }
  mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return mesh;
}

// Directions of an octahedron whose faces are cut in splits x splits: 4 splits^2 + 2 of them.
std::vector<Vec3> directions(int splits) {
  std::vector<Vec3> result;
  for (int x = -splits; x <= splits; ++x) {
    const int rest = splits - std::abs(x);
    for (int y = -rest; y <= rest; ++y) {
      const int z = rest - std::abs(y);
      result.push_back(Vec3(x, y, z).normalized());
      if (z > 0) result.push_back(Vec3(x, y, -z).normalized());
    }
  }
  return result;
}

const SurfaceMesh& unitSphere() {
  static const SurfaceMesh& mesh = audio::immortal([] {
    SurfaceMesh sphere = hullOf(directions(4));
    const double grow = std::cbrt(4.0 / 3.0 * kPi / signedVolume(sphere));
    for (Vec3& vertex : sphere.vertices)
      vertex *= grow;
    return sphere;
  });
  return mesh;
}

// ---- Bodies of revolution

struct ProfilePoint {
  double radius;  // m, 0 at both ends
  double height;  // m, along the axis, from the bottom up
};

Vec3 around(int axis, const ProfilePoint& point, int turn) {
  const double angle = 2.0 * kPi * turn / kAround;
  Vec3 result;
  result[(axis + 1) % 3] = point.radius * std::cos(angle);
  result[(axis + 2) % 3] = point.radius * std::sin(angle);
  result[axis] = point.height;
  return result;
}

// The radii are enlarged so that the polyhedron has the volume (m^3) of the round body.
SurfaceMesh revolved(int axis, std::vector<ProfilePoint> profile, double volume) {
  std::vector<ProfilePoint> rings(profile.begin() + 1, profile.end() - 1);
  SurfaceMesh mesh;
  mesh.vertices = {around(axis, profile.front(), 0), around(axis, profile.back(), 0)};
  for (const ProfilePoint& ring : rings) {
    for (int turn = 0; turn < kAround; ++turn)
      mesh.vertices.push_back(around(axis, ring, turn));
  }
  const auto name = [](std::size_t ring, int turn) {
    return static_cast<std::uint32_t>(2 + static_cast<int>(ring) * kAround + turn % kAround);
  };
  for (int turn = 0; turn < kAround; ++turn) {
    mesh.triangles.push_back({0, name(0, turn + 1), name(0, turn)});
    mesh.triangles.push_back({1, name(rings.size() - 1, turn), name(rings.size() - 1, turn + 1)});
    for (std::size_t ring = 0; ring + 1 < rings.size(); ++ring) {
      mesh.triangles.push_back({name(ring, turn), name(ring, turn + 1), name(ring + 1, turn + 1)});
      mesh.triangles.push_back({name(ring, turn), name(ring + 1, turn + 1), name(ring + 1, turn)});
    }
  }
  const double grow = std::sqrt(volume / signedVolume(mesh));
  for (Vec3& vertex : mesh.vertices) {
    vertex[(axis + 1) % 3] *= grow;
    vertex[(axis + 2) % 3] *= grow;
  }
  return mesh;
}

SurfaceMesh capsuleSurface(const btCapsuleShape& shape) {
  const double radius = number(shape.getRadius());
  const double half = number(shape.getHalfHeight());
  std::vector<ProfilePoint> profile;
  for (int ring = 0; ring <= kCap; ++ring) {
    const double angle = 0.5 * kPi * ring / kCap;
    profile.push_back(
        {ring == 0 ? 0.0 : radius * std::sin(angle), -half - radius * std::cos(angle)});
  }
  for (int ring = half > 0.0 ? kCap : kCap - 1; ring >= 0; --ring) {
    const double angle = 0.5 * kPi * ring / kCap;
    profile.push_back(
        {ring == 0 ? 0.0 : radius * std::sin(angle), half + radius * std::cos(angle)});
  }
  return revolved(shape.getUpAxis(), std::move(profile),
                  kPi * radius * radius * (2.0 * half + 4.0 / 3.0 * radius));
}

SurfaceMesh cylinderSurface(const btCylinderShape& shape) {
  const int axis = shape.getUpAxis();
  const Vec3 half = toVec3(shape.getHalfExtentsWithMargin());
  const double radius = half[(axis + (axis == 0 ? 1 : 2)) % 3];
  const double height = half[axis];
  return revolved(axis, {{0, -height}, {radius, -height}, {radius, height}, {0, height}},
                  2.0 * kPi * radius * radius * height);
}

SurfaceMesh coneSurface(const btConeShape& shape) {
  const double radius = number(shape.getRadius());
  const double height = number(shape.getHeight());
  return revolved(shape.getConeUpIndex(),
                  {{0, -0.5 * height}, {radius, -0.5 * height}, {0, 0.5 * height}},
                  kPi / 3.0 * radius * radius * height);
}

// ---- Points

std::vector<Vec3> scaledPoints(const btVector3* points, int count, const btVector3& scale) {
  std::vector<Vec3> result;
  result.reserve(static_cast<std::size_t>(count));
  for (int k = 0; k < count; ++k)
    result.push_back(toVec3(points[k] * scale));
  return result;
}

std::vector<Vec3> cornersOf(const btPolyhedralConvexShape& shape) {
  std::vector<Vec3> points;
  for (int k = 0; k < shape.getNumVertices(); ++k) {
    btVector3 corner;
    shape.getVertex(k, corner);
    points.push_back(toVec3(corner));
  }
  return points;
}

SurfaceMesh multiSphereSurface(const btMultiSphereShape& shape) {
  const Vec3 scale = toVec3(shape.getLocalScaling());
  std::vector<Vec3> points;
  for (int k = 0; k < shape.getSphereCount(); ++k) {
    const Vec3 centre = toVec3(shape.getSpherePosition(k));
    const double radius = number(shape.getSphereRadius(k));
    for (const Vec3& vertex : unitSphere().vertices)
      points.push_back((centre + radius * vertex).cwiseProduct(scale));
  }
  return hullOf(points);
}

SurfaceMesh sampledSurface(const btConvexShape& shape) {
  std::vector<Vec3> points;
  for (const Vec3& direction : directions(8)) {
    const btVector3 towards(static_cast<btScalar>(direction.x()),
                            static_cast<btScalar>(direction.y()),
                            static_cast<btScalar>(direction.z()));
    points.push_back(toVec3(shape.localGetSupportingVertex(towards)));
  }
  return hullOf(points);
}

SurfaceMesh pointsSurface(const btVector3* points, int count, const btVector3& scaling) {
  return count == 0 ? SurfaceMesh{} : hullOf(scaledPoints(points, count, scaling));
}

SurfaceMesh scaledBy(double factor, SurfaceMesh mesh) {
  for (Vec3& vertex : mesh.vertices)
    vertex *= factor;
  return mesh;
}

SurfaceMesh convexSurface(const btConvexShape& shape) {
  switch (shape.getShapeType()) {
    case BOX_SHAPE_PROXYTYPE:
      return boxSurface(
          toVec3(static_cast<const btBoxShape&>(shape).getHalfExtentsWithMargin()).cwiseMax(0.0));
    case SPHERE_SHAPE_PROXYTYPE:
      return scaledBy(number(static_cast<const btSphereShape&>(shape).getRadius()), unitSphere());
    case CAPSULE_SHAPE_PROXYTYPE:
      return capsuleSurface(static_cast<const btCapsuleShape&>(shape));
    case CYLINDER_SHAPE_PROXYTYPE:
      return cylinderSurface(static_cast<const btCylinderShape&>(shape));
    case CONE_SHAPE_PROXYTYPE:
      return coneSurface(static_cast<const btConeShape&>(shape));
    case CONVEX_HULL_SHAPE_PROXYTYPE: {
      const auto& hull = static_cast<const btConvexHullShape&>(shape);
      return pointsSurface(hull.getUnscaledPoints(), hull.getNumPoints(), hull.getLocalScalingNV());
    }
    case CONVEX_POINT_CLOUD_SHAPE_PROXYTYPE: {
      const auto& cloud = static_cast<const btConvexPointCloudShape&>(shape);
      return pointsSurface(cloud.getUnscaledPoints(), cloud.getNumPoints(),
                           cloud.getLocalScalingNV());
    }
    case TETRAHEDRAL_SHAPE_PROXYTYPE:
    case TRIANGLE_SHAPE_PROXYTYPE:
      return hullOf(cornersOf(static_cast<const btPolyhedralConvexShape&>(shape)));
    case MULTI_SPHERE_SHAPE_PROXYTYPE:
      return multiSphereSurface(static_cast<const btMultiSphereShape&>(shape));
    case UNIFORM_SCALING_SHAPE_PROXYTYPE: {
      const auto& scaling = static_cast<const btUniformScalingShape&>(shape);
      return scaledBy(number(scaling.getUniformScalingFactor()),
                      convexSurface(*scaling.getChildShape()));
    }
    default:
      return sampledSurface(shape);
  }
}

// ---- Triangle meshes

class TriangleCollector : public btInternalTriangleIndexCallback {
 public:
  void internalProcessTriangleIndex(btVector3* triangle, int /*part*/, int /*index*/) override {
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (int corner = 0; corner < 3; ++corner)
      mesh.vertices.push_back(toVec3(triangle[corner]));
    mesh.triangles.push_back({first, first + 1, first + 2});
  }

  SurfaceMesh mesh;
};

SurfaceMesh trianglesOf(const btStridingMeshInterface& triangles, const Vec3& scale) {
  TriangleCollector collector;
  const btVector3 far(BT_LARGE_FLOAT, BT_LARGE_FLOAT, BT_LARGE_FLOAT);
  triangles.InternalProcessAllTriangles(&collector, -far, far);
  SurfaceMesh mesh = std::move(collector.mesh);
  for (Vec3& vertex : mesh.vertices)
    vertex = vertex.cwiseProduct(scale);
  if (scale.prod() < 0.0) {
    for (auto& triangle : mesh.triangles)
      std::swap(triangle[1], triangle[2]);
  }
  return mesh;
}

Result<SurfaceMesh> meshSurface(const btCollisionShape& shape) {
  SurfaceMesh mesh;
  if (shape.getShapeType() == TRIANGLE_MESH_SHAPE_PROXYTYPE) {
    mesh = trianglesOf(*static_cast<const btTriangleMeshShape&>(shape).getMeshInterface(),
                       Vec3::Ones());
  } else if (shape.getShapeType() == SCALED_TRIANGLE_MESH_SHAPE_PROXYTYPE) {
    const auto& scaled = static_cast<const btScaledBvhTriangleMeshShape&>(shape);
    mesh =
        trianglesOf(*scaled.getChildShape()->getMeshInterface(), toVec3(scaled.getLocalScaling()));
  } else {
    const auto& gimpact = static_cast<const btGImpactShapeInterface&>(shape);
    if (gimpact.getGImpactShapeType() != CONST_GIMPACT_TRIMESH_SHAPE)
      return Error{"shape: a GImpact shape that is not a whole mesh; expected btGImpactMeshShape"};
    const auto& whole = static_cast<const btGImpactMeshShape&>(gimpact);
    mesh = trianglesOf(*whole.getMeshInterface(), Vec3::Ones());
  }
  if (mesh.triangles.empty()) return Error{"shape: its mesh has no triangles"};
  mesh = welded(mesh, kWeld * extentOf(mesh));
  if (mesh.triangles.empty() || !closedSurface(mesh)) {
    return Error{
        "shape: its mesh is open, or neighbouring triangles face opposite ways; expected "
        "a closed one"};
  }
  if (signedVolume(mesh) < 0.0) {
    for (auto& triangle : mesh.triangles)
      std::swap(triangle[1], triangle[2]);
  }
  return mesh;
}

// ---- Compounds

struct Part {
  SurfaceMesh mesh;
  bool convex;
};

bool apart(const SurfaceMesh& one, const SurfaceMesh& other) {
  const auto bounds = [](const SurfaceMesh& mesh) {
    Eigen::AlignedBox3d box;
    for (const Vec3& vertex : mesh.vertices)
      box.extend(vertex);
    return box;
  };
  return bounds(one).intersection(bounds(other)).isEmpty();
}

void place(const btTransform& pose, SurfaceMesh& mesh) {
  Eigen::Matrix3d rotation;
  for (int row = 0; row < 3; ++row)
    rotation.row(row) = toVec3(pose.getBasis().getRow(row)).transpose();
  for (Vec3& vertex : mesh.vertices)
    vertex = rotation * vertex + toVec3(pose.getOrigin());
}

Status collect(const btCollisionShape& shape, const btTransform& pose, std::vector<Part>& parts) {
  if (shape.isCompound()) {
    const auto& compound = static_cast<const btCompoundShape&>(shape);
    for (int child = 0; child < compound.getNumChildShapes(); ++child) {
      Status done =
          collect(*compound.getChildShape(child), pose * compound.getChildTransform(child), parts);
      if (!done) return done;
    }
    return std::monostate{};
  }
  Result<SurfaceMesh> surface = shapeSurface(shape);
  if (!surface) return surface.error();
  place(pose, *surface);
  parts.push_back({*std::move(surface), shape.isConvex()});
  return std::monostate{};
}

Result<SurfaceMesh> compoundSurface(const btCollisionShape& shape) {
  std::vector<Part> parts;
  const Status collected = collect(shape, btTransform::getIdentity(), parts);
  if (!collected) return collected.error();
  SurfaceMesh all;
  SurfaceMesh concave;
  std::vector<SurfaceMesh> solids;
  for (std::size_t part = 0; part < parts.size(); ++part) {
    append(all, parts[part].mesh);
    if (parts[part].convex) {
      solids.push_back(parts[part].mesh);
      continue;
    }
    for (std::size_t other = 0; other < parts.size(); ++other) {
      if (other != part && !apart(parts[part].mesh, parts[other].mesh)) {
        return Error{
            "shape: a compound's mesh may touch another child; expected convex children, "
            "or meshes apart from all others"};
      }
    }
    append(concave, parts[part].mesh);
  }
  if (solids.size() < 2) return all;
  std::optional<SurfaceMesh> united = unionOfConvex(solids, kUnionTolerance * extentOf(all));
  if (!united) return hullOf(all.vertices);
  append(*united, concave);
  return *std::move(united);
}

Result<SurfaceMesh> surfaceOf(const btCollisionShape& shape) {
  if (shape.isConvex()) return convexSurface(static_cast<const btConvexShape&>(shape));
  if (shape.isCompound()) return compoundSurface(shape);
  switch (shape.getShapeType()) {
    case TRIANGLE_MESH_SHAPE_PROXYTYPE:
    case SCALED_TRIANGLE_MESH_SHAPE_PROXYTYPE:
    case GIMPACT_SHAPE_PROXYTYPE:
      return meshSurface(shape);
    default:
      return Error{std::string("shape: ") + shape.getName() +
                   " is not a solid body; expected a convex shape, a closed mesh or a compound"};
  }
}

}  // namespace

Result<SurfaceMesh> shapeSurface(const btCollisionShape& shape) {
  Result<SurfaceMesh> surface = surfaceOf(shape);
  if (!surface) return surface;
  const double extent = surface->vertices.empty() ? 0.0 : extentOf(*surface);
  if (!(signedVolume(*surface) > kNoVolume * extent * extent * extent)) {
    return Error{std::string("shape: ") + shape.getName() +
                 " encloses no volume; expected a solid body"};
  }
  return surface;
}

}  // namespace carom::bullet
