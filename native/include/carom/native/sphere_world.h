#pragma once

#include <cstdint>
#include <vector>

#include <carom/audio/impulse_event.h>
#include <carom/native/restitution.h>

namespace carom {

/// How a sphere spins, slides and rolls. With all zero it neither spins nor feels friction, and
/// costs nothing.
struct SphereFriction {
  /// 1, >= 0, Coulomb's; of two spheres, or a sphere and a plane, the geometric mean.
  double sliding = 0.0;
  /// 1, >= 0: rolling on a plane is slowed by so much of its support (m/s^2 for m/s^2).
  double rolling = 0.0;
  /// m, >= 0, the arm at which the support holds up a spin about the normal of the plane.
  double pivoting = 0.0;
  Vec3 spin = Vec3::Zero();  ///< rad/s, world frame, at time 0
};

/// A rigid, homogeneous sphere.
struct Sphere {
  BodyId id = 0;
  double radius = 0.0;           ///< m, > 0
  double mass = 0.0;             ///< kg, > 0
  double restitution = 1.0;      ///< 0 to 1; a pair has combinedRestitution of both, or ...
  Vec3 position = Vec3::Zero();  ///< m, world frame, centre, at time 0
  Vec3 velocity = Vec3::Zero();  ///< m/s, world frame, at time 0
  SurfaceId surface = 0;         ///< ... what SphereWorld::restitutions holds for their surfaces
  RestitutionLaw restitutionLaw = {};  ///< of its own restitution; pairs in the table are constant
  SphereFriction friction = {};
  double stiffness = 0.0;  ///< Pa, E / (1 - nu^2): only read, and > 0, with Simultaneous::hertz
};

/// A harmonic motion about a place: amplitude sin(2 pi frequency t + phase).
struct Shaking {
  Vec3 amplitude = Vec3::Zero();  ///< m, world frame, as a vector; zero: none
  double frequency = 0.0;         ///< Hz, > 0 where there is an amplitude
  double phase = 0.0;             ///< rad, at time 0
};

/// A half-space that nothing can push; the spheres are on the side its normal points to.
struct Plane {
  BodyId id = 0;                ///< shares one set of ids with the spheres
  Vec3 normal = Vec3::UnitY();  ///< unit within 1e-9; create() removes the rest
  double offset = 0.0;          ///< m, the plane is { x : normal . x = offset }
  double restitution = 1.0;     ///< 0 to 1
  SurfaceId surface = 0;        ///< as of a Sphere
  /// m/s, world frame: a plane that is moved, and that no impact slows down. What it does along
  /// itself is felt through friction alone. The offset is that at time 0.
  Vec3 velocity = Vec3::Zero();
  /// Besides: the offset is that of the middle. Of it, too, only what is along the normal is felt.
  Shaking shaking = {};
  RestitutionLaw restitutionLaw = {};  ///< of its own restitution
  double friction = 0.0;               ///< 1, >= 0, Coulomb's; not felt on a plane that shakes
  double stiffness = 0.0;              ///< Pa, as of a Sphere
};

/// A solid box that nothing can push. With one half extent of 0 it is a rectangle, which has two
/// faces; with two a needle, with three a point.
struct Box {
  BodyId id = 0;                        ///< shares one set of ids with spheres and planes
  Vec3 centre = Vec3::Zero();           ///< m, world frame, at time 0
  Vec3 halfExtents = Vec3::Ones();      ///< m, >= 0, along its own axes
  Quat orientation = Quat::Identity();  ///< box to world; unit within 1e-9
  double restitution = 1.0;             ///< 0 to 1
  SurfaceId surface = 0;                ///< as of a Sphere
  /// m/s, world frame: a box that is moved, and that no impact slows down or turns.
  Vec3 velocity = Vec3::Zero();
  RestitutionLaw restitutionLaw = {};  ///< of its own restitution
  double friction = 0.0;               ///< 1, >= 0, Coulomb's, of its faces
  double stiffness = 0.0;              ///< Pa, as of a Sphere
};

// One layout for every host, whatever its compiler may vectorise with.
static_assert(sizeof(Box) == 160 && alignof(Box) == alignof(double));

/// The other end of a spring or rod that is held fast in space.
inline constexpr BodyId kAnchor = 0xFFFFFFFF;

/// A massless spring between the centres of two spheres, or of one and a fixed point. Spheres that
/// it joins collide as others do.
struct Spring {
  BodyId sphere = 0;
  BodyId other = kAnchor;      ///< another sphere, or kAnchor: the point ...
  Vec3 anchor = Vec3::Zero();  ///< m, world frame
  double length = 0.0;         ///< m, >= 0, at which it is slack
  double stiffness = 0.0;      ///< N/m, >= 0
  double damping = 0.0;        ///< N s/m, >= 0, along the spring
};

/// A massless rigid rod between two centres, or a centre and a fixed point, that keeps the distance
/// they have at time 0; what of the velocities would change it is taken off at once. Two rods from
/// one sphere to two points make the bifilar pendulum of a Newton's cradle.
struct Rod {
  BodyId sphere = 0;
  BodyId other = kAnchor;
  Vec3 anchor = Vec3::Zero();  ///< m, world frame
};

/// A force on all spheres, in proportion to their masses: accelerations at the place x,
///     -k (x - centre) - mu (x - centre) / |x - centre|^3.
struct ForceField {
  Vec3 centre = Vec3::Zero();  ///< m, world frame
  double harmonic = 0.0;       ///< 1/s^2, k
  double inverseSquare = 0.0;  ///< m^3/s^2, mu: of a star, G M
};

/// Linear drag, in proportion to the masses: -rate (v - wind).
struct Drag {
  double rate = 0.0;         ///< 1/s, >= 0
  Vec3 wind = Vec3::Zero();  ///< m/s
};

/// How contacts at one instant are resolved that share bodies: a ball that hits two, a ball in a
/// corner, touching balls in a row. Bodies touch that are less than 1e-9 of the smaller radius
/// apart. See SphereStepper.
enum class Simultaneous : std::uint8_t {
  reflections,  ///< as Generalized Reflections (reflectCluster): the impulses of rigid bodies
  hertz         ///< by following the forces of elastic contacts (followHertz): costs some ms each
};

struct SphereWorld {
  Vec3 gravity = Vec3::Zero();  ///< m/s^2, the same for every sphere
  std::vector<Sphere> spheres;
  std::vector<Plane> planes;
  std::vector<Box> boxes;
  RestitutionTable restitutions;  ///< of pairs of surfaces, instead of the mean of the two bodies
  std::vector<Spring> springs;
  std::vector<Rod> rods;
  std::vector<ForceField> fields;
  Drag drag = {};
  /// s, >= 0, the step of what springs, rods, fields and drag do, see Linkage; 0: chosen for each
  /// group of spheres that they connect, at kForceStepAngle of its fastest motion.
  double forceStep = 0.0;
  /// m/s, >= 0. A contact that approaches more slowly is rest, and not reported: see SphereStepper.
  /// Zero reports and damps every contact.
  double restSpeed = 0.005;
  Simultaneous simultaneous = Simultaneous::reflections;
};

}  // namespace carom
