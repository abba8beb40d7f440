#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>

#include <carom/audio/contact_state.h>
#include <carom/audio/impulse_event.h>
#include <carom/audio/result.h>

class btCollisionObject;
class btDynamicsWorld;

namespace carom {

/// When the bridge hands an event out.
enum class EventDelivery : std::uint8_t {
  /// When Bullet has finished with the impact, with what it applied: usually one or two substeps
  /// after the touch, at the latest after three substeps or 20 ms, whichever is longer.
  complete,
  /// In the substep in which the bodies touch, without `appliedImpulse`.
  prompt,
};

struct BulletBridgeSettings {
  /// m/s. A contact that approaches more slowly is rest, not a collision. Bullet itself does not
  /// bounce below its restitution velocity threshold (0.2 m/s unless set).
  double restSpeed = 0.005;
  EventDelivery delivery = EventDelivery::complete;
  /// If set, called at the end of each substep, when its events are there: the only place within a
  /// step where the bridge may be asked for them. Must not throw, nor detach the bridge.
  std::function<void()> onSubstep = nullptr;
};

struct BulletBridgeCounters {
  std::uint64_t substeps = 0;
  std::uint64_t collisions = 0;  ///< found, two events each
  std::uint64_t delivered = 0;   ///< of these, handed out
  std::uint64_t ahead = 0;       ///< of these, Bullet bounced before touching (speculative contact)
  std::uint64_t merged = 0;      ///< contact points beyond the first of an impact
  /// Impacts that Bullet's solver never acted on: the bodies grazed or passed through each other.
  std::uint64_t unseen = 0;
  /// Impacts after which the bodies part at less than half of what restitution asks for.
  std::uint64_t swallowed = 0;
  /// Impacts slower than Bullet's restitution velocity threshold, which therefore do not bounce.
  std::uint64_t belowThreshold = 0;
  std::uint64_t contactsBegun = 0;  ///< lasting contacts
  std::uint64_t unsupported = 0;    ///< pairs in contact that cannot be followed, once per substep
  std::uint64_t substepsWithoutStart =
      0;  ///< the host took the pre-tick slot: nothing reported there
};

/// Bullet world -> impulse events and contact states: each collision once per body, at its exact
/// time.
///
/// Bullet detects contacts at the start of a substep and reports impulses that carry support load,
/// Baumgarte energy and speculative losses (docs/bridge.md). The bridge therefore takes the motion
/// of the bodies from Bullet, which pairs it lets collide and what its solver applied, and finds
/// the touch itself. Bullet moves a body along an exact parabola within each substep (see Motion)
/// and turns it at constant angular velocity, so the time of first touch on Bullet's own path is a
/// root: in closed form for spheres and planes, by conservative advancement on the convex pieces of
/// all other shapes. Where the solver acts on a gap (a speculative contact), it is that of the path
/// without the solver, which may lie after the end of the substep.
///
/// The impulse follows from the state at that time,
///
///     j = (1 + e) m |vn|,   1/m = sum over both bodies of 1/m_i + (r x n) . I_i^-1 (r x n)
///
/// with the restitution e that Bullet holds for the pair, or 0 where Bullet does not bounce
/// (approach below its restitution velocity threshold). Points that land together (a box on its
/// face) are solved together and make one event; it is at their mean, weighted by impulse.
///
/// An impact lasts until the two no longer approach and are apart, or Bullet has worked on it for
/// two substeps: all that Bullet applies to the pair until then is its `appliedImpulse`. So one
/// that Bullet spreads over several substeps, points, manifolds or its continuous detection is one
/// event per body. What Bullet applies outside of impacts is in the contact states: the two
/// together are the pair's whole momentum.
///
/// Bodies: rigid, kinematic, static, and links of multibodies, in any btDynamicsWorld (discrete,
/// multithreaded, multibody, soft and rigid). All of Bullet's shapes but for pairs of two concave
/// ones and signed distance fields, which are counted as `unsupported`. Soft bodies make no events.
/// Bullet's precision sets the accuracy of times: in float builds, about 0.1 us near the origin at
/// 3 m/s, growing with the distance from it.
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

  /// Since the last `clear`. Those of one substep are in order of time.
  std::span<const ImpulseEvent> events() const;
  /// Lasting contacts since the last `clear`, one for each pair and substep.
  std::span<const ContactState> contacts() const;
  void clear();
  /// Hands out the events of impacts that are not over, with what is known of them.
  void flush();

  /// s, the simulation clock: sum of all substeps since attaching.
  double time() const;
  /// s, every event before this time has been handed out.
  double settledTime() const;
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
