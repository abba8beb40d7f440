#pragma once

#include "bullet_bridge/bodies/multibody_link.h"
#include "bullet_bridge/tracking/impact_finder.h"
#include "bullet_bridge/tracking/impact_solver.h"
#include "bullet_bridge/tracking/pair_records.h"
#include "bullet_bridge/tracking/substep_clock.h"

namespace carom::bullet {

/// Time (s) within which corners of a body that land count as one impact: about the duration of a
/// hard contact.
inline constexpr double kSameImpact = 2e-4;

/// Makes the events of an impact that was found. [physics thread]
class ImpactEvents {
 public:
  /// Solves the contact points of the impact, and sets `impact.points`: one for all contact points
  /// that land within kSameImpact. They are none if neither body can be moved. `impact.restitution`
  /// must be set; `substep` is that in which the impact was found.
  void set(Impact& impact, const FoundImpact& found, const SubstepTime& substep);

 private:
  ImpactSolver solver_;
  MultibodyMass multibodies_;
};

}  // namespace carom::bullet
