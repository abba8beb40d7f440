#pragma once

#include <cstdint>

#include "native/spheres/contact_parts.h"

namespace carom::native {

/// Resolves contacts of spheres with the edges and corners of boxes, and moves spheres that a face
/// holds round its border. SphereStepper documents the rules under Boxes.
///
/// Reads the bodies, their properties and responses. Changes the motion of the sphere and of
/// spheres on rods with it, its rest and sleep; reports collisions. Internal to native/.
class EdgeContacts {
 public:
  explicit EdgeContacts(const ContactParts& parts);

  /// Resolves the contact of a sphere with an edge or corner at now(). `normal` is unit, from the
  /// nearest point of the box to the sphere.
  void meet(std::uint32_t sphere, const Solid& solid, const Vec3& normal);
  /// Moves the sphere at now() round the border of the face that holds it, given as a wall.
  void passBorder(std::uint32_t sphere, std::uint32_t face);

 private:
  /// A hop off an edge or corner.
  struct EdgeHop {
    double rebound = 0.0;   ///< m/s, along the normal
    double sideways = 1.0;  ///< share of the speed across the normal that remains
  };

  void strike(std::uint32_t sphere, const Solid& solid, const Impact& impact, Motion& motion);
  void resolveRest(std::uint32_t sphere, const Solid& solid, const Impact& impact, Motion& motion);
  Vec3 sidewaysOf(std::uint32_t sphere, const Vec3& velocity, const Vec3& normal) const;
  EdgeHop hop(std::uint32_t sphere, const Impact& impact, double square);

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
