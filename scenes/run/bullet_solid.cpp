#include "scenes/run/bullet_solid.h"

#include <cstddef>
#include <utility>

#include "scenes/run/collision_corners.h"

namespace carom::scenes {

namespace {

std::unique_ptr<btCollisionShape> shapeOf(const BoxForm& box) {
  auto shape = std::make_unique<btBoxShape>(toBullet(box.halfExtents));
  shape->setMargin(0);
  shape->initializePolyhedralFeatures();
  return shape;
}

std::unique_ptr<btCollisionShape> shapeOf(const CylinderForm& cylinder) {
  auto shape = std::make_unique<btCylinderShape>(
      toBullet(Vec3(cylinder.radius, 0.5 * cylinder.height, cylinder.radius)));
  shape->setMargin(0);
  return shape;
}

std::unique_ptr<btCollisionShape> hullOf(const std::vector<Vec3>& points) {
  auto hull = std::make_unique<btConvexHullShape>();
  for (const Vec3& corner : collisionCorners(points))
    hull->addPoint(toBullet(corner), false);
  hull->setMargin(0);
  hull->recalcLocalAabb();
  hull->initializePolyhedralFeatures();
  return hull;
}

}  // namespace

struct BulletSolid::Builder {
  BulletSolid& made;
  const SolidShape& solid;
  const Quat& axes;

  void operator()(const BoxForm& box) const { made.shapes_.push_back(shapeOf(box)); }
  void operator()(const CylinderForm& cylinder) const { made.shapes_.push_back(shapeOf(cylinder)); }
  void operator()(const std::shared_ptr<const SolidMesh>& mesh) const {
    if (solid.canMove())
      addHulls(*mesh);
    else
      addTriangles(mesh->surface);
  }

  void addHulls(const SolidMesh& mesh) const {
    for (const std::vector<Vec3>& piece : mesh.pieces) {
      std::vector<Vec3> points;
      points.reserve(piece.size());
      for (const Vec3& point : piece)
        points.push_back(axes.conjugate() * (point - solid.centreOfMass));
      made.shapes_.push_back(hullOf(points));
    }
    if (mesh.pieces.size() == 1) return;
    auto compound = std::make_unique<btCompoundShape>(true, static_cast<int>(mesh.pieces.size()));
    for (const auto& piece : made.shapes_)
      compound->addChildShape(btTransform::getIdentity(), piece.get());
    made.shapes_.push_back(std::move(compound));
  }

  void addTriangles(const SurfaceMesh& surface) const {
    auto triangles = std::make_unique<btTriangleMesh>(true, false);
    for (const auto& [first, second, third] : surface.triangles)
      triangles->addTriangle(toBullet(surface.vertices[first]), toBullet(surface.vertices[second]),
                             toBullet(surface.vertices[third]));
    auto shape = std::make_unique<btBvhTriangleMeshShape>(triangles.get(), true);
    shape->setMargin(0);
    made.meshes_.push_back(std::move(triangles));
    made.shapes_.push_back(std::move(shape));
  }
};

BulletSolid::BulletSolid(const SolidShape& solid, const Quat& axes) {
  std::visit(Builder{*this, solid, axes}, solid.form);
}

}  // namespace carom::scenes
