#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "carom/audio/result.h"
#include "native/jello/jello_kernels.h"
#include "native/jello/jello_skin.h"
#include "native/jello/jello_worker.h"
#include "native/jello/jello_world.h"

namespace carom::native {

/// The error that a run may have by its end; see JelloStepper::follow.
struct JelloPromise {
  /// m, >= 0, root mean square over the points; 0: nothing is promised. Infinite: any error will
  /// do, so that steps are whole, and the first contact is noticed all the same.
  double error = 0.0;
  double seconds = 0.0;  ///< s, duration of the run
};

/// The integrator and step (s, > 0) of a jello; jelloLimits tells which steps are stable.
struct JelloStepping {
  JelloIntegrator integrator = JelloIntegrator::rungeKutta4;
  double step = 0.0;
  JelloPromise promise = {};
};

/// Energies in J. `total` is constant if nothing damps, and falls otherwise.
struct JelloEnergy {
  double kinetic = 0.0;
  double elastic = 0.0;  ///< in the springs
  double gravity = 0.0;  ///< relative to the origin
  double contact = 0.0;  ///< in points and balls pressed into walls and balls

  double total() const { return kinetic + elastic + gravity + contact; }
};

/// The contact of a ball with the jello during a step.
struct JelloTouch {
  bool isThere = false;         ///< true if the ball was in contact with the jello
  Vec3 impulse = Vec3::Zero();  ///< N s, on the ball
  // The next two are means over the places of contact, weighted by force; only valid if there is an
  // impulse.
  Vec3 point = Vec3::Zero();     ///< m
  Vec3 velocity = Vec3::Zero();  ///< m/s, of the jello
};

/// Steps a jello: a lattice of mass points that springs join, among walls and rigid balls. Unlike
/// SphereStepper it steps in time. In each step all forces on a point are added up, and an
/// integrator moves the points by them:
///
///     forces      springs (Hooke, with dampers), walls and balls (penalties), field, gravity
///        |
///     integrator  evaluates the forces once to four times, by JelloIntegrator
///        |
///     places and velocities a step later
///
/// follow() lets leapfrog and rungeKutta4 divide each step into equal parts, as many as an estimate
/// of their own error asks for, until the jello first meets something: a way after a contact cannot
/// be followed for long, since contacts multiply what differs. From then on steps are whole, and by
/// leapfrog.
///
/// Too long a step makes the motion grow without bound: jelloLimits tells which steps are stable,
/// chooseStepping which of them is exact enough, and advance() fails when the jello has blown up.
/// JelloCoupling puts a jello among the spheres of a SphereStepper.
///
/// Deterministic: the same bits on any machine, whatever its
/// instruction set, but with backwardEuler, whose linear solver is Eigen's. A lattice of kSplitFrom
/// points along each axis or more is computed in two halves, by a second thread if there is a
/// second core; the bits are those of one core. [one thread]
class JelloStepper {
 public:
  static constexpr std::size_t kSplitFrom = 24;
  static constexpr std::size_t kMostParts = 64;  ///< of a step, see follow()

  /// Creates a stepper; `step` in s. Errors: those of validate(JelloWorld), or a step that is not
  /// positive. The stability of the step is not checked here: see jelloLimits.
  static Result<JelloStepper> create(JelloWorld world, JelloIntegrator integrator, double step);

  /// Divides steps into up to kMostParts parts, so that the error stays as promised as long as the
  /// jello has met nothing: half of it may be spent evenly over time, the other half where it is
  /// needed, by a twentieth of what is left of it in a step. Only for leapfrog and rungeKutta4; to
  /// be called before the first step.
  void follow(const JelloPromise& promise);

  /// Advances by one step. Error: it has blown up, with the time and what to change; the state is
  /// that before the step, and stays so.
  Status advance();

  /// Sets place (m) and velocity (m/s) of a ball.
  void setBall(std::size_t ball, const Vec3& position, const Vec3& velocity);

  /// Changes the velocity (m/s) of a point of the lattice.
  void kick(std::size_t point, const Vec3& velocityChange) {
    put(3, point, at(3, point) + velocityChange);
  }

  double time() const { return static_cast<double>(steps_) * step_; }  ///< s
  double step() const { return step_; }
  std::size_t steps() const { return steps_; }
  std::size_t evaluations() const { return evaluations_; }  ///< of all forces, so far
  /// Error (m) that is expected by now, or at the first contact if that is behind; only if the
  /// jello is followed, and 0 otherwise.
  double followedError() const { return followedError_; }
  /// False if a step could not be divided finely enough for the promise.
  bool isKept() const { return isKept_; }
  /// Time (s) at the end of the step in which a jello that is followed first met something;
  /// infinite if it has not.
  double metAt() const { return metAt_; }
  const JelloWorld& world() const { return world_; }  ///< the world at time 0

  Vec3 position(std::size_t point) const { return at(0, point); }  ///< m
  Vec3 velocity(std::size_t point) const { return at(3, point); }  ///< m/s
  Vec3 ballPosition(std::size_t ball) const { return at(0, world_.pointCount() + ball); }
  Vec3 ballVelocity(std::size_t ball) const { return at(3, world_.pointCount() + ball); }

  JelloEnergy energy() const;
  Vec3 momentum() const;         ///< N s, jello and balls
  Vec3 angularMomentum() const;  ///< N m s, about the origin; balls count as points
  double volume() const;         ///< m^3, enclosed by the outermost points, in triangles
  Vec3 centre() const;           ///< m, centre of the jello's mass
  Vec3 jelloMomentum() const;    ///< N s, without the balls
  /// Contacts of the balls with the jello in the last step, by ball.
  std::span<const JelloTouch> touches() const { return touches_; }

 private:
  JelloStepper(JelloWorld world, JelloIntegrator integrator, double step);

  /// Six arrays, one after the other, by point and then ball: places x, y, z (m), velocities x, y,
  /// z (m/s), with kJelloSlack zeros before and behind each.
  using Values = JelloValues;
  Vec3 at(std::size_t array, std::size_t index) const;
  void put(std::size_t array, std::size_t index, const Vec3& value);
  JelloSkin::Places places() const;
  std::size_t bodies() const { return world_.pointCount() + world_.balls.size(); }
  std::size_t stride() const {  // a multiple of kJelloBlock
    return (bodies() / kJelloBlock + 1) * kJelloBlock + 2 * kJelloSlack;
  }
  JelloArrays arraysOf(const Values& values, Values& accelerations) const;
  std::size_t parts() const;
  void inParts(const std::function<void(std::size_t)>& part);
  void addSprings(const JelloArrays& arrays);
  void addField(const JelloArrays& arrays) const;
  void addBalls(const JelloArrays& arrays, double share);
  void pushBySkin(std::size_t ball, const JelloArrays& arrays, double share);
  void accelerate(const Values& values, double share, Values& accelerations);
  struct Terms;
  void combine(const Terms& places, const Terms& speeds, Values& out);
  void explicitStep();
  void symplecticStep();
  void midpointStep();
  void rungeKuttaStep();
  void implicitStep();
  void leapfrogStep();
  void stepOnce();
  void beginTouches();
  double allowedError() const;
  double runParts();
  void followStep();
  double rootMeanSquare(const double* one, const double* two, double share,
                        const double* third) const;
  double partError() const;
  bool hasMet() const;
  bool hasBlownUp() const;

  JelloWorld world_;
  JelloIntegrator integrator_;
  double step_;
  double part_;  // s, step_ or a part of it
  std::size_t steps_ = 0;
  std::size_t evaluations_ = 0;
  JelloPromise promise_;
  double spent_ = 0.0;  // m, of the half of the promise that is not spent evenly
  std::size_t parts_ = 1;
  double followedError_ = 0.0;  // m
  bool isKept_ = true;
  double metAt_ = std::numeric_limits<double>::infinity();  // s
  double lastPart_ = 0.0;  // s, what lies between the last two accelerations of leapfrog
  JelloSprings springs_;
  JelloSkin skin_;
  std::vector<JelloWall> walls_;
  Values now_;        // state at time()
  Values before_;     // state before the last step, or part of it
  Values start_;      // state before the last step, if it is followed
  Values startPush_;  // accelerations before the last step, of leapfrog that is followed
  std::array<Values, 4> accelerations_;  // x, y and z in m/s^2, by stage
  Values stage_;                         // state at which an inner stage takes the forces
  Values upperForces_;                   // N, by the second half of the springs, if split
  std::unique_ptr<JelloWorker> worker_;  // null if there is no second core for it
  std::vector<double> inverseMass_;      // 1/kg, by body
  std::vector<JelloTouch> touches_;
  std::vector<double> touchSizes_;  // N, by ball: weight of the means of its touch so far
};

}  // namespace carom::native
