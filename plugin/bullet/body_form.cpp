#include "plugin/bullet/body_form.h"

#include <array>
#include <cmath>
#include <memory>
#include <utility>

#include <btBulletCollisionCommon.h>

#include "bullet_bridge/geometry/to_vec3.h"
#include "bullet_bridge/shapes/shape_surface.h"
#include "carom/audio/panel_radiator.h"

namespace carom::plugin {

using namespace audio;
using namespace bullet;

namespace {

using Kind = BodyForm::Kind;

constexpr std::size_t kMostTriangles = 200'000;

/// Collects the triangles of a concave shape.
class TriangleCollector final : public btTriangleCallback {
 public:
  TriangleCollector(SurfaceMesh& mesh, double metres) : mesh_(mesh), metres_(metres) {}

  void processTriangle(btVector3* corners, int, int) override {
    if (mesh_.triangles.size() >= kMostTriangles) return;
    const auto first = static_cast<std::uint32_t>(mesh_.vertices.size());
    for (int corner = 0; corner < 3; ++corner)
      mesh_.vertices.push_back(metres_ * toVec3(corners[corner]));
    mesh_.triangles.push_back({first, first + 1, first + 2});
  }

 private:
  SurfaceMesh& mesh_;
  double metres_;
};

SurfaceMesh trianglesOf(const btConcaveShape& shape, double metres) {
  btVector3 low;
  btVector3 high;
  shape.getAabb(btTransform::getIdentity(), low, high);
  SurfaceMesh mesh;
  TriangleCollector collector(mesh, metres);
  shape.processAllTriangles(&collector, low, high);
  return mesh;
}

BodyForm formOfMesh(SurfaceMesh mesh) {
  for (const Vec3& vertex : mesh.vertices)
    if (!vertex.allFinite()) return {};
  if (mesh.triangles.empty()) return {};
  return {.kind = Kind::mesh, .mesh = std::make_shared<const SurfaceMesh>(std::move(mesh))};
}

BodyForm formOfPlane(const btStaticPlaneShape& plane, double metres) {
  BodyForm form{.kind = Kind::plane, .size = toVec3(plane.getPlaneNormal())};
  form.offset = metres * static_cast<double>(plane.getPlaneConstant());
  return form;
}

BodyForm anyForm(const btCollisionShape& shape, double metres) {
  switch (shape.getShapeType()) {
    case SPHERE_SHAPE_PROXYTYPE: {
      const auto radius = static_cast<double>(static_cast<const btSphereShape&>(shape).getRadius());
      return {.kind = Kind::sphere, .size = {metres * radius, 0.0, 0.0}};
    }
    case BOX_SHAPE_PROXYTYPE:
      return {.kind = Kind::box,
              .size = metres *
                      toVec3(static_cast<const btBoxShape&>(shape).getHalfExtentsWithMargin())};
    case STATIC_PLANE_PROXYTYPE:
      return formOfPlane(static_cast<const btStaticPlaneShape&>(shape), metres);
    default:
      break;
  }
  if (Result<SurfaceMesh> surface = shapeSurface(shape)) {
    for (Vec3& vertex : surface->vertices)
      vertex *= metres;
    return formOfMesh(*std::move(surface));
  }
  if (shape.isConcave())
    return formOfMesh(trianglesOf(static_cast<const btConcaveShape&>(shape), metres));
  return {};
}

}  // namespace

BodyForm formOf(const btCollisionShape& shape, double metres) {
  BodyForm form = anyForm(shape, metres);
  return form.size.allFinite() && std::isfinite(form.offset) ? form : BodyForm();
}

const BodyForm& BodyForms::of(const btCollisionShape& shape) {
  const auto [entry, isNew] = forms_.try_emplace(&shape);
  BodyForm& form = entry->second;
  if (isNew) form = formOf(shape, metres_);
  if (isNew && form.mesh != nullptr) form.mesh = oneOf(form.mesh);
  return form;
}

/// Returns the mesh, or an equal one that is there already.
std::shared_ptr<const SurfaceMesh> BodyForms::oneOf(std::shared_ptr<const SurfaceMesh> mesh) {
  const std::size_t hash = RadiatorCache::Hash()(*mesh);
  const auto [begin, end] = meshes_.equal_range(hash);
  for (auto entry = begin; entry != end; ++entry)
    if (std::shared_ptr<const SurfaceMesh> known = entry->second.lock(); known && *known == *mesh)
      return known;
  if (meshes_.size() >= many_) {
    std::erase_if(meshes_, [](const auto& entry) { return entry.second.expired(); });
    many_ = 2 * meshes_.size() + 64;
  }
  meshes_.emplace(hash, mesh);
  return mesh;
}

}  // namespace carom::plugin
