#pragma once

#include <vector>

#include "audio/impulse_event.h"
#include "audio/restitution_table.h"

namespace carom {

/// A rigid, frictionless sphere that does not spin.
struct Sphere {
  BodyId id = 0;
  double radius = 0.0;           ///< m, > 0
  double mass = 0.0;             ///< kg, > 0
  double restitution = 1.0;      ///< 0 to 1; a pair has combinedRestitution of both, or ...
  Vec3 position = Vec3::Zero();  ///< m, world frame, centre, at time 0
  Vec3 velocity = Vec3::Zero();  ///< m/s, world frame, at time 0
  SurfaceId surface = 0;         ///< ... what SphereWorld::restitutions holds for their surfaces
};

/// A half-space that nothing can push; the spheres are on the side its normal points to.
struct Plane {
  BodyId id = 0;                ///< shares one set of ids with the spheres
  Vec3 normal = Vec3::UnitY();  ///< unit within 1e-9; create() removes the rest
  double offset = 0.0;          ///< m, the plane is { x : normal . x = offset }
  double restitution = 1.0;     ///< 0 to 1
  SurfaceId surface = 0;        ///< as of a Sphere
  /// m/s, world frame: a plane that is moved, and that no impact slows down. What it does along
  /// itself is not felt. The offset is that at time 0.
  Vec3 velocity = Vec3::Zero();
};

struct SphereWorld {
  Vec3 gravity = Vec3::Zero();  ///< m/s^2, the same for every sphere
  std::vector<Sphere> spheres;
  std::vector<Plane> planes;
  RestitutionTable restitutions;  ///< of pairs of surfaces, instead of the mean of the two bodies
  /// m/s, >= 0. A contact that approaches more slowly is rest, and not reported: see SphereStepper.
  /// Zero reports and damps every contact.
  double restSpeed = 0.005;
};

}  // namespace carom
