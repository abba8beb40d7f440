#pragma once

#include <cstdint>
#include <unordered_set>
#include <vector>

#include "audio/impulse_event.h"
#include "scenes/bullet_scene.h"
#include "scenes/scene.h"

namespace carom {

/// One collision of the reference: which pair, when, how hard.
struct ReferenceCollision {
  BodyId body = 0;  ///< the lower of the two ids
  BodyId other = 0;
  double time = 0.0;     ///< s
  double impulse = 0.0;  ///< N s, magnitude
};

/// The exact collisions of the path that a Bullet world really takes: what its bridge ought to
/// find.
///
/// Told the states before and after every step, it tests all pairs with the native stepper's closed
/// forms, and knows neither manifolds nor the bridge: slow, obvious, independent. In step k Bullet
/// moves a body along x_k + (w - g dt/2) s + g s^2/2 with the velocity w after its solver, so that
/// a first touch within the step is exact. Where Bullet turns a body back from a plane before it
/// touches (a speculative contact), the collision is the one of the path without the solver.
///
/// A contact slower than the scene's rest speed is none; after a collision a pair counts again once
/// it no longer approaches. Restitution is the scene's, or 0 below Bullet's restitution velocity
/// threshold.
class LocalReference {
 public:
  explicit LocalReference(const Scene& scene);

  void beforeStep(BulletScene& world);
  void afterStep(BulletScene& world, double dt);

  const std::vector<ReferenceCollision>& collisions() const { return collisions_; }

 private:
  struct BodyStep {
    Vec3 position;        // m, before the step
    Vec3 velocityBefore;  // m/s
    Vec3 velocityAfter;   // m/s, after the solver
  };
  // A pair along its line of centres, or a sphere above a plane: everything scalar or relative.
  struct PairStep {
    std::size_t first, second;
    Vec3 offset;          // m, position of the first from the second; along the normal for a plane
    Vec3 velocityBefore;  // m/s, relative
    Vec3 velocityAfter;
    double reach = 0.0;  // m, sum of the radii
    bool plane = false;
  };
  struct Touch {
    double time = 0.0;  // s, after the start of the step
    double approachSpeed = 0.0;
    double nodeSpeed = 0.0;  // m/s, what Bullet compares with its threshold
  };

  void testPair(const PairStep& pair, double dt);
  bool findActualTouch(const PairStep& pair, double dt, Touch& touch) const;
  bool findPreventedTouch(const PairStep& pair, double dt, Touch& touch) const;
  double touchTime(const PairStep& pair, const Vec3& velocity) const;
  Vec3 normalAt(const PairStep& pair, const Vec3& velocity, double time) const;
  double approachAt(const PairStep& pair, const Vec3& velocity, double time) const;
  void record(const PairStep& pair, const Touch& touch);

  const Scene& scene_;
  double time_ = 0.0;
  double restitutionThreshold_ = 0.0;  // m/s, Bullet's
  std::vector<BodyStep> bodies_;
  std::unordered_set<std::uint64_t> collided_;  // and still approaching
  std::vector<ReferenceCollision> collisions_;
};

}  // namespace carom
