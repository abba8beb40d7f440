#pragma once

#include <span>
#include <utility>
#include <vector>

#include "bullet_bridge/bodies/body_tracker.h"
#include "bullet_bridge/broad_phase/hierarchical_grid.h"
#include "bullet_bridge/tracking/contact_pair.h"

namespace carom::bullet {

/// Gap (m) above which Bullet's solver does not act on a pair; infinite where it may act across
/// any.
double solverRange(const ContactPair& pair);

/// The broad phase of a substep: finds the pairs that may have touched in it, or on which Bullet's
/// solver may have acted. [physics thread]
///
/// All bodies but planes go through a HierarchicalGrid; planes, which have no box, are tested
/// against every body.
class CandidatePairs {
 public:
  /// Returns the pairs of the substep of `dt` (s) that has just ended, without those of which both
  /// are at rest; valid until the next call. Completes their bodies.
  std::span<const ContactPair> find(BodyTracker& tracker, double dt);

 private:
  // A ball that holds all that a body may reach in this substep.
  struct Ball {
    Vec3 centre;
    double radius = 0.0;
    const TrackedBody* body = nullptr;
  };

  void gatherBodies(const BodyTracker& tracker, double dt);
  void findNear(BodyTracker& tracker, double dt);
  void findOnPlanes(BodyTracker& tracker, double dt);

  HierarchicalGrid grid_;
  std::vector<SweptBox> boxes_;  // of this substep, like those that follow; kept for their memory
  std::vector<const TrackedBody*> planes_;
  std::vector<Ball> balls_;
  std::vector<ContactPair> found_;
};

}  // namespace carom::bullet
