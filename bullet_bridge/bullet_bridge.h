#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "audio/impulse_event.h"
#include "audio/result.h"

class btCollisionObject;
class btDynamicsWorld;

namespace carom {

struct BulletBridgeSettings {
  /// m/s. A contact that approaches more slowly is rest, not a collision. Bullet itself does not
  /// bounce below its restitution velocity threshold (0.2 m/s unless set).
  double restSpeed = 0.005;
};

struct BulletBridgeCounters {
  std::uint64_t substeps = 0;
  std::uint64_t collisions = 0;  ///< reported, two events each
  std::uint64_t ahead = 0;       ///< of these, Bullet bounced before touching (speculative contact)
  std::uint64_t unsupported = 0;  ///< pairs of other shapes in contact, once per substep
  std::uint64_t substepsWithoutStart =
      0;  ///< the host took the pre-tick slot: nothing reported there
};

/// Bullet world -> impulse events, each collision once per body, at its exact time.
///
/// Bullet detects contacts at the start of a substep and reports impulses that carry support load,
/// Baumgarte energy and speculative losses (docs/bridge.md). The bridge therefore takes from Bullet
/// only the motion of its bodies, which pairs it lets collide, and whether its solver acted on a
/// gap. Bullet moves a body along an exact parabola within each substep (see Motion), so the time
/// of first touch on Bullet's own path is a root in closed form. Where the solver acts on a gap (a
/// speculative contact), it is that of the path without the solver, which may lie after the end of
/// the substep. The impulse follows from the state at that time,
///
///     j = (1 + e) m |vn| n,   1/m = 1/m1 + 1/m2
///
/// with the restitution e that Bullet holds for the pair, or 0 where Bullet does not bounce
/// (approach below its restitution velocity threshold). A pair that has collided may collide again
/// once it no longer approaches, so an impact that Bullet spreads over several substeps is one.
///
/// Events of a substep are sorted by time, and lie in it or after it. A pair that overlaps at its
/// start without having touched (put there by the host) is dated there. Spheres that Bullet lets
/// tunnel through each other within a substep are reported, as what they would have done.
///
/// Frictionless spheres (btSphereShape) and planes (btStaticPlaneShape) in this version; contacts
/// of other pairs are counted as `unsupported`. Bullet's precision sets the accuracy of times: in
/// float builds, about 0.1 us near the origin at 3 m/s, growing with the distance from it.
///
/// [physics thread], not inside a tick callback. The world must outlive the bridge. The host's tick
/// callbacks, contact callbacks, user pointers and user indices keep working (see TickHook).
class BulletBridge {
 public:
  /// Starts to listen. Refuses a second bridge on one world, and settings that are not finite or
  /// negative.
  static Result<BulletBridge> attach(btDynamicsWorld& world,
                                     const BulletBridgeSettings& settings = {});
  BulletBridge(BulletBridge&&) noexcept;
  BulletBridge& operator=(BulletBridge&&) noexcept;
  /// Detaches and restores the host's callback.
  ~BulletBridge();

  /// Events since the last clearEvents.
  std::span<const ImpulseEvent> events() const;
  void clearEvents();

  /// s, the simulation clock: sum of all substeps since attaching.
  double time() const;
  /// The id that events carry for this object; ids count from 0 in the order in which objects were
  /// first seen, the world's own order at attach. Refuses objects that are not in the world.
  Result<BodyId> bodyId(const btCollisionObject& object) const;

  const BulletBridgeCounters& counters() const;

 private:
  class Impl;
  explicit BulletBridge(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace carom
