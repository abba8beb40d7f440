#pragma once

#include <optional>
#include <span>
#include <vector>

#include "carom/audio/impulse_event.h"
#include "carom/audio/result.h"
#include "carom/native/sphere_stepper.h"
#include "native/jello/jello_stepper.h"

namespace carom::native {

/// Returns the jello with the spheres as its balls, which are moved by the caller. [any thread]
JelloWorld withSpheres(JelloWorld jello, const SphereWorld& spheres);

/// A jello among rigid spheres: the spheres fly and collide with each other and with walls as
/// SphereStepper says, at exact times; jello and spheres push each other by penalties.
///
/// Splitting: in each step the jello moves first, with the spheres in free fall through it. Its
/// effect on a sphere is then applied to the sphere as an impulse: half of it at the begin and half
/// at the end of the step, if the integrator is of second order or more, so that the coupling is of
/// second order, too; otherwise all of it at the begin, as symplectic Euler does. Momentum is kept
/// to rounding. Spheres that do not touch the jello keep every bit of the path that their own
/// stepper gives them.
///
/// Events: those of the spheres, and a pair for each touch of a sphere and the jello that began at
/// SphereWorld::restSpeed or faster. Their time is the begin of the step in which the touch began;
/// their impulse is that of the whole touch, or of its first kLongestTouch: the remainder is rest.
/// A touch that begins again within kSameTouch after its end is still the same one. [physics
/// thread]
class JelloCoupling {
 public:
  static constexpr double kLongestTouch = 0.05;  ///< s
  static constexpr double kSameTouch = 2e-3;     ///< s

  /// Creates the coupling. The ids of the spheres differ from the jello's, and `jello` has no
  /// balls. Errors: those of both steppers; a jello with balls.
  static Result<JelloCoupling> create(JelloWorld jello, const SphereWorld& spheres,
                                      const JelloStepping& stepping);

  /// Advances by one step of the jello. Error: it has blown up; the state is that before the step.
  Status advance();
  /// Events that became known in the last step; the events of one collision follow each other.
  std::span<const ImpulseEvent> events() const { return events_; }
  /// Time in s before which all events have been returned.
  double settledTime() const;

  /// Changes the velocity (m/s) of a point of the jello's lattice, or of a sphere.
  void pushPoint(std::size_t point, const Vec3& velocityChange) {
    jello_.kick(point, velocityChange);
  }
  void pushSphere(std::size_t sphere, const Vec3& velocityChange);

  double time() const { return jello_.time(); }  ///< s
  const JelloStepper& jello() const { return jello_; }
  const SphereStepper& spheres() const { return spheres_; }

 private:
  /// A touch of one sphere and the jello, with their states at its begin.
  struct Touch {
    double begin = 0.0;  // s
    double last = 0.0;   // s, begin of the last step in which the two were in contact
    Vec3 impulse = Vec3::Zero();
    Vec3 point = Vec3::Zero();
    SphereState sphere = {};
    Vec3 jelloVelocity = Vec3::Zero();
    double approachSpeed = 0.0;  // m/s
    bool isTold = false;         // true once its events are returned: the remainder is rest
  };

  JelloCoupling(JelloStepper jello, SphereStepper spheres, double restSpeed);
  void addImpulse(std::size_t ball, const JelloTouch& touch, double begin, const Vec3& impulse);
  void endTouches();
  void report(std::size_t ball, Touch& touch);
  void placeBalls();

  JelloStepper jello_;
  SphereStepper spheres_;
  double restSpeed_;   // m/s
  double firstShare_;  // share of the jello's impulse that acts at the begin of a step
  double jelloMass_;   // kg
  std::vector<std::optional<Touch>> touches_;  // by ball
  std::vector<ImpulseEvent> events_;
};

}  // namespace carom::native
