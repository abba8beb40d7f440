#pragma once

#include <btBulletCollisionCommon.h>

namespace carom::bullet {

/// Id that tells a new object at an old address from the old one; -1 for an object that is in no
/// world.
inline int proxyIdOf(const btCollisionObject& object) {
  const btBroadphaseProxy* proxy = object.getBroadphaseHandle();
  return proxy == nullptr ? -1 : proxy->getUid();
}

}  // namespace carom::bullet
