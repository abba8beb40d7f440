#pragma once

#include <span>
#include <vector>

#include <btBulletDynamicsCommon.h>

#include "bullet_bridge/contact_pair.h"

namespace carom::bullet {

/// One point of a contact as Bullet holds it after its solver: where it was at the start of the
/// substep, and what the solver did there.
struct SolvedPoint {
  Vec3 position = Vec3::Zero();  ///< m, world frame, at the start of the substep, on `other`
  Vec3 normal = Vec3::UnitX();   ///< 1, world frame, towards the pair's `body`
  double gap = 0.0;              ///< m
  double impulse = 0.0;          ///< N s, along the normal
};

/// All that Bullet holds of a pair: several points, several manifolds (compounds), and the
/// manifold that it predicted (CCD).
struct SolvedContact {
  double restitution = 0.0;     ///< that of a pair without points is what Bullet will give it
  double impulse = 0.0;         ///< N s, sum over the points
  Vec3 applied = Vec3::Zero();  ///< N s, world frame, on `body`, friction included
  std::vector<SolvedPoint> points;
};

/// What Bullet will give a pair that it holds no contact of yet.
double combinedRestitution(const ContactPair& pair);

/// Reads what Bullet's solver did to a pair in the substep that has just ended. [physics thread]
///
/// An applied impulse is left out where it is a stale number: points that the solver skipped (a gap
/// above the processing threshold), and pairs asleep. It never follows a body pointer that a
/// manifold holds, since that body may be gone.
class ContactReader {
 public:
  explicit ContactReader(btDynamicsWorld& world) : world_(world) {}

  /// Once per substep, before the first read. `continuous`: some body may be stopped short.
  void beginReading(bool continuous);
  /// Valid until the next read.
  const SolvedContact& read(const ContactPair& pair);
  /// Whether Bullet would let the two collide: groups and masks, ignored pairs, contact response.
  bool collides(const ContactPair& pair) const;

 private:
  void addManifold(const ContactPair& pair, const btPersistentManifold& manifold, bool predicted);
  void addPoint(const btManifoldPoint& point, double sign, bool solved);

  btDynamicsWorld& world_;
  btManifoldArray manifolds_;                           // of one pair; kept for its memory
  std::vector<const btPersistentManifold*> predicted_;  // of this substep
  SolvedContact contact_;
};

}  // namespace carom::bullet
