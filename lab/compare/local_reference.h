#pragma once

#include <cstdint>
#include <set>
#include <unordered_set>
#include <utility>
#include <vector>

#include "lab/compare/collision_match.h"

#include "carom/audio/impulse_event.h"
#include "scenes/format/scene.h"
#include "scenes/run/bullet_scene.h"

namespace carom::lab {

using namespace scenes;

/// The exact collisions of the path that a Bullet world really takes: those that its bridge ought
/// to find.
///
/// Given the states before and after every step, it tests all pairs with the native stepper's
/// closed forms, and shares nothing with the bridge: slow, obvious, independent. In step k Bullet
/// moves a body along x_k + (w - a dt/2) s + a s^2/2 with the velocity w after its solver, so that
/// a first touch within the step is exact. Where Bullet turns a pair back before it touches (a
/// speculative contact; only the applied impulses in Bullet's manifolds tell which pairs), the
/// collision is that of the path without the solver. A pair that overlaps and approaches without
/// having touched collides at once.
///
/// A contact slower than the scene's rest speed does not count; after a collision a pair counts
/// again once it no longer approaches, has passed, or is well apart. Restitution is the scene's, or
/// 0 below Bullet's restitution velocity threshold.
class LocalReference {
 public:
  explicit LocalReference(const Scene& scene);

  void beforeStep(BulletScene& world);
  void afterStep(BulletScene& world, double dt);

  const std::vector<Collision>& collisions() const { return collisions_; }
  /// Returns the collisions as events, two for each, with all that their sound depends on.
  const std::vector<ImpulseEvent>& events() const { return events_; }

 private:
  struct BodyStep {
    Vec3 position;        // m, before the step
    Vec3 velocityBefore;  // m/s
    Vec3 velocityAfter;   // m/s, after the solver
    Vec3 acceleration;    // m/s^2, zero when asleep
    Quat orientation;     // body to world, before the step
    Vec3 spinBefore;      // rad/s
    Vec3 spinAfter;       // rad/s, after the solver
  };
  // The motion of a sphere relative to another sphere or a block, or above a plane, in one step.
  struct PairStep {
    std::size_t first = 0;
    std::size_t second = 0;
    Vec3 offset;          // m, between the centres; from a plane, along its normal
    Vec3 velocityBefore;  // m/s, relative
    Vec3 velocityAfter;
    Vec3 acceleration;    // m/s^2, relative
    double reach = 0.0;   // m, sum of the radii
    bool pushed = false;  // Bullet's solver pushed the two apart in this step
    const PlaneShape* plane = nullptr;
    const BlockShape* block = nullptr;
  };
  struct Touch {
    double time = 0.0;  // s, after the start of the step
    double approachSpeed = 0.0;
    double nodeSpeed = 0.0;  // m/s, approach speed that Bullet compares with its threshold
    bool isFree = false;     // the contact is on the path without the solver
  };

  void readPushedPairs(BulletScene& world);
  PairStep pairStep(std::size_t sphere, std::size_t other, BulletScene& world) const;
  void testPair(const PairStep& pair, double dt);
  void record(const PairStep& pair, const Touch& touch, double dt);
  BodyStep stateAt(std::size_t body, const Touch& touch, double dt) const;

  const Scene& scene_;
  double time_ = 0.0;
  double restitutionThreshold_ = 0.0;  // m/s, Bullet's
  std::vector<BodyStep> bodies_;
  std::set<std::pair<const btCollisionObject*, const btCollisionObject*>> pushed_;
  std::unordered_set<std::uint64_t> collided_;  // pairs that have collided and still approach
  std::vector<Collision> collisions_;
  std::vector<ImpulseEvent> events_;
};

}  // namespace carom::lab
