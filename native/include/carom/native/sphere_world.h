#pragma once

#include <cstdint>
#include <vector>

#include <carom/audio/impulse_event.h>
#include <carom/native/restitution.h>

namespace carom {

/// Friction and spin of a sphere. If all are zero, the sphere neither spins nor feels friction, and
/// costs nothing.
struct SphereFriction {
  /// Coulomb's coefficient (1, >= 0); a contact has the geometric mean of its two bodies'.
  double sliding = 0.0;
  /// Rolling on a plane is slowed by this share (1, >= 0) of the support (m/s^2 for m/s^2).
  double rolling = 0.0;
  /// Arm (m, >= 0) at which the support slows a spin about the normal of the plane.
  double pivoting = 0.0;
  Vec3 spin = Vec3::Zero();  ///< rad/s, world frame, at time 0
};

/// A rigid, homogeneous sphere.
struct Sphere {
  BodyId id = 0;
  double radius = 0.0;           ///< m, > 0
  double mass = 0.0;             ///< kg, > 0
  double restitution = 1.0;      ///< 0 to 1; a pair not in the table has combinedRestitution
  Vec3 position = Vec3::Zero();  ///< m, world frame, centre, at time 0
  Vec3 velocity = Vec3::Zero();  ///< m/s, world frame, at time 0
  SurfaceId surface = 0;         ///< kind of surface, the key of SphereWorld::restitutions
  /// Applies to `restitution`; pairs in the table are constant.
  RestitutionLaw restitutionLaw = {};
  SphereFriction friction = {};
  double stiffness = 0.0;  ///< Pa, E / (1 - nu^2): only read, and > 0, with Simultaneous::hertz
};

/// A harmonic motion about a mean position: amplitude sin(2 pi frequency t + phase).
struct Oscillation {
  Vec3 amplitude = Vec3::Zero();  ///< m, world frame; a zero vector means no oscillation
  double frequency = 0.0;         ///< Hz, > 0 if there is an amplitude
  double phase = 0.0;             ///< rad, at time 0
};

/// An immovable half-space; the spheres are on the side its normal points to.
struct Plane {
  BodyId id = 0;                ///< shares one set of ids with the spheres
  Vec3 normal = Vec3::UnitY();  ///< unit within 1e-9; create() normalises it
  double offset = 0.0;          ///< m, the plane is { x : normal . x = offset }
  double restitution = 1.0;     ///< 0 to 1
  SurfaceId surface = 0;        ///< kind of surface, see Sphere
  /// Velocity (m/s, world frame) of a plane in steady motion, which no impact changes. Its
  /// component along the plane is felt through friction only. `offset` is that at time 0.
  Vec3 velocity = Vec3::Zero();
  /// Oscillation added to the steady motion; `offset` is then that of its middle. Only its
  /// component along the normal is felt.
  Oscillation oscillation = {};
  RestitutionLaw restitutionLaw = {};  ///< applies to `restitution`
  double friction = 0.0;               ///< 1, >= 0, Coulomb's; not felt on a plane that oscillates
  double stiffness = 0.0;              ///< Pa, see Sphere
};

/// A solid, immovable box. With one half extent of 0 it is a rectangle, which has two faces; with
/// two a needle, with three a point.
struct Box {
  BodyId id = 0;                        ///< shares one set of ids with spheres and planes
  Vec3 centre = Vec3::Zero();           ///< m, world frame, at time 0
  Vec3 halfExtents = Vec3::Ones();      ///< m, >= 0, along its own axes
  Quat orientation = Quat::Identity();  ///< box to world; unit within 1e-9
  double restitution = 1.0;             ///< 0 to 1
  SurfaceId surface = 0;                ///< kind of surface, see Sphere
  /// Velocity (m/s, world frame) of a box in steady motion, which no impact changes or turns.
  Vec3 velocity = Vec3::Zero();
  RestitutionLaw restitutionLaw = {};  ///< applies to `restitution`
  double friction = 0.0;               ///< 1, >= 0, Coulomb's, of the faces
  double stiffness = 0.0;              ///< Pa, see Sphere
};

// Box has the same layout for every host, whatever its compiler may vectorise with.
static_assert(sizeof(Box) == 160 && alignof(Box) == alignof(double));

/// Id that stands for a fixed point in space as the other end of a spring or rod.
inline constexpr BodyId kAnchor = 0xFFFFFFFF;

/// A massless spring between the centres of two spheres, or of one and a fixed point. Spheres that
/// it joins collide as others do.
struct Spring {
  BodyId sphere = 0;
  BodyId other = kAnchor;      ///< another sphere, or kAnchor for the fixed point `anchor`
  Vec3 anchor = Vec3::Zero();  ///< m, world frame
  double length = 0.0;         ///< m, >= 0, the rest length
  double stiffness = 0.0;      ///< N/m, >= 0
  double damping = 0.0;        ///< N s/m, >= 0, along the spring
};

/// A massless rigid rod between two centres, or a centre and a fixed point, that keeps the distance
/// they have at time 0; velocities that would change it are removed at once. Two rods from one
/// sphere to two points make the bifilar pendulum of a Newton's cradle.
struct Rod {
  BodyId sphere = 0;
  BodyId other = kAnchor;
  Vec3 anchor = Vec3::Zero();  ///< m, world frame
};

/// A force on all spheres in proportion to their masses; the acceleration at x is
///     -k (x - centre) - mu (x - centre) / |x - centre|^3.
struct ForceField {
  Vec3 centre = Vec3::Zero();  ///< m, world frame
  double harmonic = 0.0;       ///< 1/s^2, k
  double inverseSquare = 0.0;  ///< m^3/s^2, mu; G M for a star
};

/// Linear drag on all spheres in proportion to their masses; the acceleration is -rate (v - wind).
struct Drag {
  double rate = 0.0;         ///< 1/s, >= 0
  Vec3 wind = Vec3::Zero();  ///< m/s
};

/// Methods of resolving contacts at one instant that share bodies: a ball that hits two, a ball in
/// a corner, touching balls in a row. Bodies touch if they are less than 1e-9 of the smaller radius
/// apart. See SphereStepper.
enum class Simultaneous : std::uint8_t {
  reflections,  ///< Generalized Reflections (reflectCluster): the impulses of rigid bodies
  hertz         ///< follows the forces of elastic contacts (followHertz): some ms each
};

struct SphereWorld {
  Vec3 gravity = Vec3::Zero();  ///< m/s^2, the same for every sphere
  std::vector<Sphere> spheres;
  std::vector<Plane> planes;
  std::vector<Box> boxes;
  RestitutionTable restitutions;  ///< by pairs of surfaces, instead of the mean of the two bodies
  std::vector<Spring> springs;
  std::vector<Rod> rods;
  std::vector<ForceField> fields;
  Drag drag = {};
  /// Step (s, >= 0) of springs, rods, fields and drag, see Linkage; 0: chosen for each group of
  /// spheres that they connect, at kForceStepAngle of its fastest motion.
  double forceStep = 0.0;
  /// Speed in m/s, >= 0, below which an approach is rest and not reported: see SphereStepper. Zero
  /// reports and damps every contact.
  double restSpeed = 0.005;
  Simultaneous simultaneous = Simultaneous::reflections;
};

}  // namespace carom
