#pragma once

#include <vector>

#include <Eigen/Core>

#include "native/jello/jello_kernels.h"
#include "native/jello/jello_skin.h"
#include "native/jello/jello_world.h"

namespace carom::native {

/// The linear system of a backward Euler step. Internal to native/.
class JelloImplicit {
 public:
  /// The parts of the step that the system describes; all outlive it.
  struct Of {
    const JelloWorld& world;
    const JelloSprings& springs;
    const JelloSkin& skin;
    const std::vector<JelloWall>& walls;
    double step;  ///< s
  };
  explicit JelloImplicit(const Of& of) : of_(of) {}

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

  Of of_;
};

}  // namespace carom::native
