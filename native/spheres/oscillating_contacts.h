#pragma once

#include <cstdint>

#include "native/spheres/contact_parts.h"

namespace carom::native {

/// Resolves contacts of spheres with planes that oscillate. Such a plane holds no sphere: one that
/// lies on it follows in short hops, whose energy the plane provides. SphereStepper documents the
/// rules under Oscillation.
///
/// Reads the bodies, their properties and responses. Changes the motion of the sphere and of
/// spheres on rods with it, its rest and sleep; reports collisions. Internal to native/.
class OscillatingContacts {
 public:
  explicit OscillatingContacts(const ContactParts& parts);

  /// Resolves the contact of a sphere with an oscillating plane, given as a wall, at now().
  void meet(std::uint32_t sphere, std::uint32_t wall);

 private:
  /// A sphere that arrives at an oscillating plane.
  struct Arrival {
    std::uint32_t sphere = 0;
    std::uint32_t wall = 0;
    double approachSpeed = 0.0;  ///< m/s, >= 0
    double pressed = 0.0;        ///< m/s^2, at which plane and sphere are drawn together
    double cosine = 1.0;         ///< of the plane's phase: its speed as a share of the largest
  };
  struct Rebound {
    double speed = 0.0;  ///< m/s
    bool rest = false;   ///< true if the contact is too slow to be reported
  };

  Rebound rebound(const Arrival& arrival, const Motion& motion) const;
  void bounce(const Arrival& arrival, Motion& motion);
  void bounceOnRods(const Arrival& arrival, double rebound, Motion& motion);
  void report(const Arrival& arrival, const Motion& motion, double mass, double rebound);

  const Bodies& bodies_;
  const SphereProperties& properties_;
  const Linkage& linkage_;
  const ResponseModel& responses_;
  Trajectories& trajectories_;
  RestTracker& rest_;
  SleepController& sleep_;
  CollisionReporter& reporter_;
};

}  // namespace carom::native
