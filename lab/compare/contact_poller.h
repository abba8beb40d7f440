#pragma once

#include <map>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "carom/audio/impulse_event.h"
#include "scenes/run/bullet_scene.h"

namespace carom::lab {

using namespace scenes;

/// The time at which an application without a bridge, which looks at Bullet's contact points after
/// every step, would take two bodies to have collided.
struct PolledContact {
  /// s: end of the step in which Bullet first pushed the two apart, when the application sees it.
  double seen = 0.0;
  /// s: extrapolated from the distance or overlap at which Bullet found the bodies, and their
  /// approach speed along the normal then. The same as `seen` if they did not approach.
  double backDated = 0.0;
};

/// Polls a world's contact points; is called before and after each of its steps. [one thread]
class ContactPoller {
 public:
  explicit ContactPoller(BulletScene& world);

  void beforeStep();
  void afterStep(double dt);

  /// Returns the contact of this pair seen nearest to `time` (s), if it is within `window` (s).
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
  std::map<Pair, double> pushed_;  // s, end of the last step in which Bullet pushed the pair
  std::map<Pair, std::vector<PolledContact>> seen_;
};

}  // namespace carom::lab
