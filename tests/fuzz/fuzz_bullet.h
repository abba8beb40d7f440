#pragma once

#include <btBulletDynamicsCommon.h>

namespace carom::fuzz {

/// Pools for a few bodies: Bullet's own take longer to clear than such a world lives.
inline btDefaultCollisionConstructionInfo smallPools() {
  btDefaultCollisionConstructionInfo pools;
  pools.m_defaultMaxPersistentManifoldPoolSize = 64;
  pools.m_defaultMaxCollisionAlgorithmPoolSize = 64;
  return pools;
}

}  // namespace carom::fuzz
