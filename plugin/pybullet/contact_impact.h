#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>

#include "bullet_bridge/geometry/motion.h"
#include "carom/audio/impulse_event.h"
#include "carom/audio/vector.h"

namespace carom::plugin {

/// Pose and velocity of a body at the start of a substep, after the solver of the substep before.
struct BodyState {
  Vec3 position = Vec3::Zero();         ///< m, world frame, centre of mass
  Quat orientation = Quat::Identity();  ///< principal axes of inertia to world
  Vec3 velocity = Vec3::Zero();         ///< m/s, world frame
  Vec3 angularVelocity = Vec3::Zero();  ///< rad/s, world frame
};

/// The mechanical properties of a body.
struct ContactBody {
  enum class Form : std::uint8_t { other, sphere, box, cylinder, capsule, plane };

  double mass = std::numeric_limits<double>::infinity();  ///< kg, > 0; infinite: nothing moves it
  /// kg m^2, in the axes of BodyState::orientation; 0 about an axis about which it does not turn.
  Vec3 inertia = Vec3::Zero();
  std::optional<double> restitution = 0.0;  ///< 1, factor in the pair's; none: not known
  Form form = Form::other;
  /// m: radius of a sphere, of a cylinder and of a capsule, whose axes are z.
  double radius = 0.0;

  /// True for a rigid body, of which the server does not tell the restitution.
  bool isRigid() const { return !restitution; }
  bool isMovable() const { return mass < std::numeric_limits<double>::infinity(); }
};

/// A point of contact at the start of the substep, with the solver's impulse.
struct TouchPoint {
  BodyId body = 0;
  BodyId other = 0;
  Vec3 positionOnBody = Vec3::Zero();   ///< m, world frame
  Vec3 positionOnOther = Vec3::Zero();  ///< m, world frame
  Vec3 normal = Vec3::UnitX();          ///< 1, world frame, unit, from `other` towards `body`
  double distance = 0.0;                ///< m, below 0 where they overlap
  double impulse = 0.0;                 ///< N s, >= 0, along the normal, on `body`
  Vec3 friction = Vec3::Zero();         ///< N s, world frame, on `body`
};

/// One body of a pair, at the start of a substep.
struct ContactSide {
  BodyId id = 0;
  ContactBody body{};
  BodyState state{};
  Vec3 acceleration = Vec3::Zero();  ///< m/s^2
  /// True if the body came here by its own motion, with velocityBefore (m/s) at the start of the
  /// substep before.
  bool hasPast = false;
  Vec3 velocityBefore = Vec3::Zero();

  /// Motion of its centre from the start of the substep on, and back, for as long as nothing
  /// touches it: the parabola through the nodes of symplectic Euler, `dt` (s) apart.
  bullet::Motion way(double dt) const {
    return {state.position, state.velocity + 0.5 * dt * acceleration, acceleration};
  }
};

/// Velocity (m/s, world frame) of a body's point at a place.
Vec3 velocityAt(const BodyState& state, const Vec3& place);

/// Local radius of curvature (m) of a body that is touched along `normal` (world frame), as
/// ImpulseEvent::radius.
double curvatureOf(const ContactBody& body, const Quat& orientation, const Vec3& normal);

/// Speed (m/s) at which the two approach at a point, at the start of the substep.
double approachAt(const TouchPoint& point, const BodyState& body, const BodyState& other);

/// Returns one point in place of several: their mean, weighted by impulse, with all their impulse.
/// Requires some impulse.
TouchPoint meanOf(std::span<const TouchPoint> points);

/// The first touch of two bodies.
struct Touch {
  double s = 0.0;               ///< s, after the start of the substep; below 0 before it
  Vec3 normal = Vec3::UnitX();  ///< 1, world frame, unit, towards the first of the two
  double approachSpeed = 0.0;   ///< m/s
  /// Approach speed (m/s) by the velocities at the start of the substep before, and the fall from
  /// there. Zero for bodies that rest on each other but for rounding, although a solver that waits
  /// for overlap lets them meet at g dt.
  double onset = std::numeric_limits<double>::infinity();
};

/// The lengths (s) of this substep and of the one before.
struct ContactDurations {
  double now = 0.0;
  double before = 0.0;
};

/// Finds the first touch of two bodies from their state at the start of a substep; see
/// ContactListener for the rules. Nothing if they would not touch within two more substeps.
/// [any thread]
std::optional<Touch> touchOf(const ContactSide& body, const ContactSide& other,
                             const TouchPoint& point, const ContactDurations& durations);

/// The solver of a physics server, as far as contacts depend on it.
struct ContactSolver {
  double restitutionSpeed = 0.0;  ///< m/s, slower impacts do not bounce
  double erp = 0.0;               ///< 1: share of an overlap that a substep takes away
  double slop = 0.0;              ///< m, added to the distance of contacts
  /// m, below 0: two rigid bodies that overlap more are moved apart, and get no speed by that.
  double pushDistance = -std::numeric_limits<double>::infinity();
};

/// Finds the restitution of a pair, 0 to 1, from its motion over the substep: `parting` is the
/// speed (m/s) at which it parts at the point afterwards. The solver makes that e times the
/// approach, less what is left of a gap, or plus its share of an overlap. The approach has the pull
/// of the substep in it unless both bodies are rigid. [any thread]
double restitutionFrom(const ContactSide& body, const ContactSide& other, const TouchPoint& point,
                       double parting, double duration, const ContactSolver& solver);

/// An impact of which the time is known.
struct Impact {
  TouchPoint point{};
  Touch touch{};
  double duration = 0.0;              ///< s, of the substep
  std::optional<double> restitution;  ///< where the bodies have none; none: from the impulse
};

/// Returns the shares of both bodies in an impact, at the time `touch.s` after the start of the
/// substep. One of the two has to be movable. [any thread]
std::array<ImpulseEvent, 2> sharesOf(const ContactSide& body, const ContactSide& other,
                                     const Impact& impact, const ContactSolver& solver);

}  // namespace carom::plugin
