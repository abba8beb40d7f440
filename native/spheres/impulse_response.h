#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "native/mechanics/linkage.h"
#include "native/scheduling/bodies.h"
#include "native/spheres/sphere_properties.h"
#include "native/spheres/trajectories.h"

namespace carom::native {

/// Two spheres, or a sphere and an immovable body, at the instant of their contact.
struct ContactPair {
  static constexpr std::uint32_t kImmovable = EventScheduler::kNobody;

  Motion motion;               ///< of `sphere`, as it arrives
  Motion otherMotion;          ///< the same for `other`
  Vec3 normal;                 ///< unit, from the other body to `sphere`
  double approachSpeed = 0.0;  ///< m/s
  std::uint32_t sphere = 0;
  std::uint32_t other = 0;  ///< kImmovable for an immovable body
};

/// Changes of velocity (m/s) by an impulse of 1 N s between two bodies along their normal.
struct ImpulseResponse {
  Vec3 velocityChange = Vec3::Zero();
  Vec3 otherVelocityChange = Vec3::Zero();
  /// The spheres that rods connect with the two, and their changes of velocity.
  std::vector<std::pair<std::uint32_t, Vec3>> linked;

  /// Opening speed (m/s per N s), the inverse of the effective mass.
  double compliance(const Vec3& normal) const;
};

/// The effect of impulses on the velocities of spheres, whatever holds them: sleep, walls or rods.
/// Reads the bodies, their masses, rods and motions; changes nothing. Internal to native/.
class ResponseModel {
 public:
  /// All references must outlive the model.
  struct Parts {
    const Bodies& bodies;
    const SphereProperties& properties;
    const Linkage& linkage;
    const Trajectories& trajectories;
  };

  explicit ResponseModel(const Parts& parts);

  /// Returns the response of the two and of all spheres that rods connect with them.
  ImpulseResponse impulseResponse(const ContactPair& pair) const;
  /// Change of velocity (m/s per N s) of a sphere without rods by a slow impulse along `direction`:
  /// a sleeping sphere does not yield, nor does one on a wall towards that wall.
  Vec3 velocityChange(std::uint32_t sphere, const Vec3& direction) const;

 private:
  struct Ends;
  void respond(const ContactPair& pair, const Ends& ends, ImpulseResponse& response) const;

  const Bodies& bodies_;
  const SphereProperties& properties_;
  const Linkage& linkage_;
  const Trajectories& trajectories_;
};

/// Applies an impulse (N s) to the linked spheres of a response.
void applyToLinked(const ImpulseResponse& response, double impulse, Trajectories& trajectories);

}  // namespace carom::native
