#pragma once

#include <atomic>
#include <cstdint>

#include <btBulletCollisionCommon.h>

namespace carom::bullet {

/// Tells a new object at an old address from the old one. [simulation thread of the object's world]
///
/// The broadphase's number alone does not: but for btDbvtBroadphase as long as it is not empty,
/// every broadphase gives a number again. So objects are marked, in a field that Bullet keeps for
/// its extensions, of which it has none, and that a new object has empty. What another has put
/// there stays.
struct ObjectIdentity {
  int proxyId = -1;  ///< -1 for an object that is in no world
  const void* mark = nullptr;
};

/// True for the identity of an object that has been seen before, at the same place in its world's
/// array or at another. At the same place it may have another number: a host that changes filters
/// gives it a new proxy (btCollisionWorld::refreshBroadphaseProxy).
inline bool isSameObject(const ObjectIdentity& known, const ObjectIdentity& now, bool isInPlace) {
  constexpr std::uintptr_t kOdd = 1;
  const bool isOurs = (reinterpret_cast<std::uintptr_t>(known.mark) & kOdd) != 0;
  return known.mark == now.mark && ((isOurs && isInPlace) || known.proxyId == now.proxyId);
}

/// Returns the identity of an object, without a mark if it has none yet.
inline ObjectIdentity identityOf(const btCollisionObject& object) {
  const btBroadphaseProxy* const proxy = object.getBroadphaseHandle();
  return {proxy == nullptr ? -1 : proxy->getUid(), object.internalGetExtensionPointer()};
}

/// Marks an object that has no mark. Returns its identity, which it keeps while it is in its world.
inline ObjectIdentity identify(btCollisionObject& object) {
  static std::atomic<std::uintptr_t> marks = 0;
  constexpr std::uintptr_t kOdd = 1;  // no pointer to anything is
  if (object.internalGetExtensionPointer() == nullptr) {
    const std::uintptr_t number = 2 * marks.fetch_add(1) + kOdd;
    // NOLINTNEXTLINE(performance-no-int-to-ptr): it is a number, in a field for pointers
    object.internalSetExtensionPointer(reinterpret_cast<void*>(number));
  }
  return identityOf(object);
}

}  // namespace carom::bullet
