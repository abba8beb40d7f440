#pragma once

#include <memory>
#include <vector>

#include <btBulletDynamicsCommon.h>

#include "carom/audio/vector.h"
#include "scenes/format/solid_shape.h"

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

inline Vec3 fromBullet(const btVector3& v) {
  return {static_cast<double>(v.x()), static_cast<double>(v.y()), static_cast<double>(v.z())};
}
inline Quat fromBullet(const btQuaternion& turn) {
  return Quat(static_cast<double>(turn.w()), static_cast<double>(turn.x()),
              static_cast<double>(turn.y()), static_cast<double>(turn.z()))
      .normalized();
}

/// The collision shape that a solid has in Bullet, with the parts that it is made of.
class BulletSolid {
 public:
  /// `axes` turns Bullet's frame of the solid to the body's: Bullet turns bodies about their
  /// principal axes only. A box or a cylinder becomes Bullet's own shape of that kind; a mesh that
  /// moves, the hulls of its pieces; a mesh that does not move, its triangles. Edges are sharp:
  /// there is no margin.
  ///
  /// All shapes but cylinders have their faces and edges prepared, so that the world can separate
  /// them by these (m_enableSatConvex): Bullet's GJK is off by millimetres between bodies of
  /// centimetres, and pushes them askew.
  BulletSolid(const SolidShape& solid, const Quat& axes);

  btCollisionShape& shape() const { return *shapes_.back(); }

 private:
  struct Builder;

  std::vector<std::unique_ptr<btStridingMeshInterface>> meshes_;
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;  // parts before their compound
};

}  // namespace carom::scenes
