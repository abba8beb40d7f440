#pragma once

#include <cstdint>

#include "native/spheres/cluster_contacts.h"
#include "native/spheres/contact_parts.h"

namespace carom::native {

/// Resolves contacts of spheres with planes and with faces of boxes that stand still or move
/// steadily. A slow contact makes the wall hold the sphere.
///
/// Reads the bodies, their properties and responses. Changes the motion of the sphere, of spheres
/// linked with it, their rest and sleep; reports collisions. Internal to native/.
class WallContacts {
 public:
  /// `clusters` resolves contacts that are not alone at their instant.
  WallContacts(const ContactParts& parts, ClusterContacts& clusters);

  /// Resolves the contact of a sphere with a wall, given by its index, at now(). `tied`: it may be
  /// one of several at this instant.
  void meet(std::uint32_t sphere, std::uint32_t wall, bool tied);

 private:
  /// A sphere that arrives at a wall.
  struct Arrival {
    Motion motion;
    std::uint32_t sphere = 0;
    std::uint32_t wall = 0;
    double approachSpeed = 0.0;  ///< m/s, >= 0
  };

  void bounce(const Arrival& arrival);
  void bounceOnRods(const Arrival& arrival, double rebound);
  bool isReported(const Arrival& arrival) const;
  double rebound(const Arrival& arrival);
  void report(const Arrival& arrival, double mass, double impulse);
  void applyFriction(const Arrival& arrival, double impulse, Motion& motion);

  const Bodies& bodies_;
  const SphereProperties& properties_;
  const Linkage& linkage_;
  const ResponseModel& responses_;
  Trajectories& trajectories_;
  RestTracker& rest_;
  SleepController& sleep_;
  CollisionReporter& reporter_;
  ClusterContacts& clusters_;
};

}  // namespace carom::native
