#include "scenes/run/solid_surface.h"

#include <cassert>
#include <memory>
#include <utility>
#include <variant>

#include "bullet_bridge/shapes/shape_surface.h"
#include "scenes/run/bullet_solid.h"

namespace carom::scenes {

SurfaceMesh surfaceOf(const SolidShape& solid) {
  if (const auto* mesh = std::get_if<std::shared_ptr<const SolidMesh>>(&solid.form)) {
    SurfaceMesh surface = (*mesh)->surface;
    for (Vec3& vertex : surface.vertices)
      vertex -= solid.centreOfMass;
    return surface;
  }
  const BulletSolid made(solid, Quat::Identity());
  Result<SurfaceMesh> surface = bullet::shapeSurface(made.shape());
  assert(surface);  // a box or a cylinder has one
  return *std::move(surface);
}

}  // namespace carom::scenes
