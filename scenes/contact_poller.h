#pragma once

#include <map>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "carom/audio/impulse_event.h"
#include "scenes/bullet_scene.h"

namespace carom::scenes {

/// When an application without a bridge would take two bodies to have collided: one that looks at
/// Bullet's contact points after every step.
struct PolledContact {
  /// s, the end of the step in which Bullet first pushed the two apart: when it is seen.
  double seen = 0.0;
  /// s, from how far apart or inside each other Bullet found the bodies, and how fast they then
  /// approached along the normal. Without an approach the same as `seen`.
  double backDated = 0.0;
};

/// Looks at a world before and after each of its steps. [one thread]
class ContactPoller {
 public:
  explicit ContactPoller(BulletScene& world);

  void beforeStep();
  void afterStep(double dt);

  /// What was seen of this pair nearest to `time` (s), if it is within `window` (s).
  std::optional<PolledContact> nearest(BodyId body, BodyId other, double time, double window) const;

 private:
  struct Motion {
    btVector3 position;
    btVector3 velocity;  // m/s
    btVector3 spin;      // rad/s
  };
  using Pair = std::pair<BodyId, BodyId>;

  btVector3 velocityAt(BodyId body, const btVector3& point) const;

  BulletScene& world_;
  double time_ = 0.0;
  std::unordered_map<const btCollisionObject*, BodyId> ids_;
  std::vector<Motion> before_;
  std::map<Pair, double> pushed_;  // s, until when Bullet has pushed them last
  std::map<Pair, std::vector<PolledContact>> seen_;
};

}  // namespace carom::scenes
