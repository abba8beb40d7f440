#pragma once

#include <memory>
#include <vector>

#include <btBulletDynamicsCommon.h>

#include "carom/audio/result.h"
#include "carom/audio/surface_mesh.h"
#include "scenes/solid_shape.h"

namespace carom::scenes {

inline btScalar toBullet(double value) {
  return static_cast<btScalar>(value);
}
inline btVector3 toBullet(const Vec3& v) {
  return {toBullet(v.x()), toBullet(v.y()), toBullet(v.z())};
}
inline btTransform toBullet(const Quat& turn, const Vec3& place) {
  const btQuaternion rotation(toBullet(turn.x()), toBullet(turn.y()), toBullet(turn.z()),
                              toBullet(turn.w()));
  return btTransform(rotation, toBullet(place));
}

/// What Bullet collides of a solid, and all that it is made of.
class BulletSolid {
 public:
  /// `axes` turns the frame that Bullet has of it to the body's: Bullet turns bodies about their
  /// principal axes only. A box or a cylinder comes as such; a mesh that moves, as the hulls of its
  /// pieces; one that does not, as its triangles. Edges are sharp: there is no margin.
  ///
  /// All but cylinders have their faces and edges ready, for the world to separate them by
  /// (m_enableSatConvex): Bullet's GJK is off by millimetres between bodies of centimetres, and
  /// pushes them askew.
  BulletSolid(const SolidShape& solid, const Quat& axes);

  btCollisionShape& shape() const { return *shapes_.back(); }

 private:
  struct Builder;

  std::vector<std::unique_ptr<btStridingMeshInterface>> meshes_;
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;  // parts before what they are part of
};

/// The surface of a solid: m, body frame. Cylinders are polyhedra of their volume, as
/// shapeSurface makes them. [any thread], allocates.
SurfaceMesh surfaceOf(const SolidShape& solid);

}  // namespace carom::scenes
