#pragma once

#include <vector>

#include <Eigen/Core>

#include "native/jello/jello_kernels.h"
#include "native/jello/jello_skin.h"
#include "native/jello/jello_world.h"

namespace carom::native {

/// The linear system of a backward Euler step: how springs, dampers and contacts, taken as linear
/// for the length of the step, change the velocities of all bodies at once. Internal to native/.
class JelloImplicit {
 public:
  /// The parts of the step that the system describes; all outlive it.
  struct Step {
    const JelloWorld& world;
    const JelloSprings& springs;
    const JelloSkin& skin;
    const std::vector<JelloWall>& walls;
    double duration;  ///< s
  };
  explicit JelloImplicit(const Step& step) : step_(step) {}

  /// Returns the changes of velocity (m/s) of each point and then each ball, from places (m),
  /// velocities (m/s) and forces (N) at the begin of the step. Springs that are pressed together
  /// count as having no stiffness across, which keeps the system positive definite (Choi, Ko 2002,
  /// "Stable but responsive cloth").
  Eigen::VectorXd velocityChange(const std::vector<Vec3>& positions,
                                 const std::vector<Vec3>& velocities,
                                 const Eigen::VectorXd& forces) const;

 private:
  struct Parts;
  void addContacts(const std::vector<Vec3>& positions, Parts& parts) const;

  Step step_;
};

}  // namespace carom::native
