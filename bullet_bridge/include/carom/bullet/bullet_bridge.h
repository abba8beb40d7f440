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

// The bridge listens to a Bullet world and tells what hit what, when and how hard, and what slides,
// rolls or rests. Bullet's contacts do not say so: they describe poses at the start of a substep,
// and their impulses carry load, penetration correction and speculative losses (docs/bridge.md). So
// the bridge takes from Bullet how the bodies moved and what its solver applied, and finds the
// impacts itself, on the exact paths between Bullet's nodes. One substep:
//
//     Bullet                                the bridge
//     ------                                ----------
//     pre-tick callback ------------------> poses, velocities and forces before the solver
//     finds contacts (manifolds)
//     solves them
//     moves the bodies
//     actions ----------------------------> velocities after the solver
//                                                  |
//                                           pairs whose paths come near each other (broad phase)
//                                                  |
//     impulses of the pair's manifolds ---> time of impact on the path of each pair
//                                                  |
//                       +--------------------------+--------------------------+
//                       |                          |                          |
//                 a new impact            an impact under way         a lasting contact
//             Newton's impulse there,     what Bullet applied is       load, slip, roll,
//              from mass and speed        added until it is over     path of the contact
//                       |                          |                          |
//                       +----> ImpulseEvent <------+                    ContactState
//                             one for each body                  one for each pair and substep

/// When the bridge hands an event out.
enum class EventDelivery : std::uint8_t {
  /// The bridge delivers an event when Bullet has finished solving its impact, with the impulse
  /// that Bullet applied: usually one or two substeps after contact, at the latest after three
  /// substeps or 20 ms, whichever is longer.
  complete,
  /// The bridge delivers an event in the substep in which it finds the impact (ImpactSearch),
  /// without `appliedImpulse`.
  prompt,
};

/// The pairs among which the bridge looks for impacts.
enum class ImpactSearch : std::uint8_t {
  /// Bodies whose paths come near each other. An impact is known in the substep in which the bodies
  /// touch, and also where Bullet's solver never acts on it.
  paths,
  /// Bodies on which Bullet's solver acts: the same impacts, at the same times, but for those that
  /// Bullet misses, and known only when it acts, which is up to a substep later. Costs a third to
  /// two thirds where boxes and hulls move, and as much for balls.
  contacts,
};

struct BulletBridgeSettings {
  /// Least approach speed (m/s) of a collision; a slower contact counts as rest. Bullet itself does
  /// not bounce below its restitution velocity threshold (0.2 m/s unless set).
  double restSpeed = 0.005;
  EventDelivery delivery = EventDelivery::complete;
  /// Speed (m/s) of the surfaces of two bodies up to which their lasting contact lies still. Of a
  /// contact that lies still, only those states are handed out in which it begins, comes to lie
  /// still, changes its load twofold, or ends; the impulses of the others are in no state. With 0,
  /// the states of all substeps are handed out.
  double stillSpeed = 0.0;
  ImpactSearch search = ImpactSearch::paths;
  /// Callback at the end of each substep, when its events are available: the only place within a
  /// step where the bridge may be asked for them. It must not throw. It may end the bridge.
  std::function<void()> onSubstep = nullptr;
};

struct BulletBridgeCounters {
  std::uint64_t substeps = 0;
  std::uint64_t collisions = 0;  ///< collisions found; each makes two events
  std::uint64_t delivered = 0;   ///< collisions whose events were handed out
  /// Impacts that Bullet solved before the bodies touched (speculative contacts).
  std::uint64_t speculative = 0;
  std::uint64_t merged = 0;  ///< contact points merged with others into one collision
  /// Impacts that Bullet's solver never acted on: the bodies grazed or passed through each other.
  std::uint64_t unsolved = 0;
  /// Impacts after which the bodies part at less than half of the speed that restitution demands.
  std::uint64_t lostRebound = 0;
  /// Impacts slower than Bullet's restitution velocity threshold, which therefore do not bounce.
  std::uint64_t belowThreshold = 0;
  std::uint64_t contactsBegun = 0;  ///< lasting contacts that began
  /// Pairs in contact that cannot be followed, counted once per substep.
  std::uint64_t unsupported = 0;
  /// Substeps of whose start the bridge has learnt late, or not, as the host had taken the pre-tick
  /// slot.
  std::uint64_t substepsWithoutStart = 0;
  /// Pairs near each other or in contact, counted once per substep, whose shapes the bridge looked
  /// at, and those for which it needed not to.
  std::uint64_t searched = 0;
  std::uint64_t carried = 0;
  /// Contacts of soft bodies' nodes, which make no events, counted once per substep.
  std::uint64_t softContacts = 0;
};

/// Turns the contacts of a Bullet world into impulse events and contact states: each collision is
/// reported once per body, at its exact time.
///
/// Bullet moves a body along an exact parabola within each substep
/// (bullet_bridge/geometry/motion.h) and turns it at constant angular velocity, so the time of
/// impact on Bullet's own path is a root: in closed form for spheres and planes, by conservative
/// advancement on the convex pieces of all other shapes. Where the solver acts on a gap (a
/// speculative contact), the time is that of the path without the solver, and may lie after the end
/// of the substep.
///
/// The impulse follows from the state at that time,
///
///     j = (1 + e) m |vn|,   1/m = sum over both bodies of 1/m_i + (r x n) . I_i^-1 (r x n)
///
/// with the restitution e that Bullet holds for the pair, or 0 where Bullet does not bounce
/// (approach below its restitution velocity threshold). Points that land together (a box on its
/// face) are solved together and make one event; its position is their mean, weighted by impulse.
///
/// An impact lasts until the two bodies no longer approach and are apart, or Bullet has worked on
/// it for two substeps: all that Bullet applies to the pair until then is its `appliedImpulse`. So
/// an impact that Bullet spreads over several substeps, points, manifolds or its continuous
/// detection is one event per body. The impulses that Bullet applies outside of impacts are in the
/// contact states; events and contact states together hold the whole momentum that the pair
/// exchanges.
///
/// Bodies: rigid, kinematic, static, and links of multibodies, in any btDynamicsWorld (discrete,
/// multithreaded, multibody, soft and rigid). All of Bullet's shapes but for pairs of two concave
/// ones and signed distance fields, which are counted as `unsupported`. Soft bodies make no events.
/// Bullet's precision sets the accuracy of times: in float builds, about 0.1 us near the origin at
/// 3 m/s, growing with the distance from it.
///
/// [physics thread]. To be attached outside of steps; destroyed anywhere, in any callback too. The
/// world may be destroyed first (`isAttached`), unless it has a btSimulationIslandManager of a
/// class of the host's. The host's tick callbacks, contact callbacks, user pointers and user
/// indices keep working (see TickHook).
class BulletBridge {
 public:
  /// Attaches a bridge to the world. Fails if the world has a bridge already, if a setting is
  /// negative or not finite, if the world is no btDiscreteDynamicsWorld (a btSimpleDynamicsWorld
  /// calls no actions), and for a btDiscreteDynamicsWorldMt without a task scheduler.
  static Result<BulletBridge> attach(btDynamicsWorld& world,
                                     const BulletBridgeSettings& settings = {});
  BulletBridge(BulletBridge&&) noexcept;
  BulletBridge& operator=(BulletBridge&&) noexcept;
  /// Detaches and restores the host's callback, within a substep at its end.
  ~BulletBridge();
  /// False once the world has been destroyed: what is known stays, and nothing comes any more.
  bool isAttached() const;

  /// Events since the last `clear`, those of one substep in order of time.
  std::span<const ImpulseEvent> events() const;
  /// Lasting contacts since the last `clear`, one for each pair and substep.
  std::span<const ContactState> contacts() const;
  void clear();
  /// Hands out the events of impacts that are still under way, with what is known of them so far.
  void flush();

  /// Simulation clock in s: the sum of all substeps since attaching.
  double time() const;
  /// Time in s before which every event has been handed out.
  double settledTime() const;
  /// Returns the id that events carry for this object; ids count from 0 in the order in which
  /// objects were first seen, the world's own order at attach. Fails for objects that are not in
  /// the world.
  Result<BodyId> bodyId(const btCollisionObject& object) const;
  /// Returns the object with an id; null if it is no longer in the world.
  const btCollisionObject* bodyOf(BodyId id) const;

  const BulletBridgeCounters& counters() const;

 private:
  class Impl;
  explicit BulletBridge(std::shared_ptr<Impl> impl);
  std::shared_ptr<Impl> impl_;
};

}  // namespace carom
