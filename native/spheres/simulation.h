#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "carom/native/recording.h"
#include "carom/native/sphere_stepper.h"
#include "native/mechanics/linkage.h"
#include "native/mechanics/rolling.h"
#include "native/scheduling/bodies.h"
#include "native/scheduling/event_scheduler.h"
#include "native/spheres/event_pair.h"

namespace carom::native {

// These constants define rest and are documented in SphereStepper.
inline constexpr double kHopTime = 0.5e-3;      ///< s, of a hop that is paid for
inline constexpr double kLeastHopTime = 20e-6;  ///< s, of an unpaid hop
inline constexpr double kWakeSpeed = 4.0;       ///< in rest speeds, below which a sphere sleeps on
inline constexpr double kLeastRebound = 1e-15;  ///< relative to the speed: above its rounding

/// The properties of a sphere except its size, and its state of rest.
struct Substance {
  double mass = 0.0;         ///< kg
  double restitution = 0.0;  ///< 1, at the speed of its RestitutionLaw
  SurfaceId surface = 0;
  std::uint16_t rapidContacts = 0;  ///< number in a row, kCollapseInterval apart or less
  bool asleep = false;
  bool collapsed = false;         ///< true after a collapse: its rest speed is raised
  double hopAllowance = 0.0;      ///< J, energy that hops may give back
  double calmSince = kNever;      ///< s, since when it has kept to `calmPlace`
  Vec3 calmPlace = Vec3::Zero();  ///< m
};

/// The momentum and energy that should be there, summed up from everything that has changed them:
/// free flight changes them by gravity alone, a collision of two spheres keeps momentum and takes
/// the energy that restitution takes, and everything else changes them by its effect on the
/// velocities. For validate().
struct Books {
  Vec3 momentum = Vec3::Zero();    ///< kg m/s, without the share of gravity
  double energy = 0.0;             ///< J, translation and gravity
  double momentumTurnover = 0.0;   ///< kg m/s, sum of the sizes of all changes
  double energyTurnover = 0.0;     ///< J, sum of the sizes of all changes
  Vec3 unbalanced = Vec3::Zero();  ///< kg m/s, error of momentum in collisions of two spheres
  double unexplained = 0.0;        ///< J, error of energy in collisions of two spheres
};

/// The implementation of SphereStepper. Spheres are numbered in order of their ids. Internal to
/// native/.
class Simulation {
 public:
  explicit Simulation(const SphereWorld& world);

  void advanceTo(double time);
  void push(std::size_t listed, const Vec3& impulse);

  const std::vector<ImpulseEvent>& events() const { return events_; }
  double time() const { return time_; }
  std::size_t sphereCount() const { return bodies_.count(); }
  const SphereStepperCounters& counters() const { return counters_; }
  /// Motion at time(); spheres are given by position in SphereWorld::spheres.
  Motion motionOf(std::size_t listed) const { return motionAtTime(order_[listed]); }
  Vec3 spinOf(std::size_t listed) const { return spinAt(order_[listed], {time_, 0.0}); }
  double kineticEnergy() const;
  double potentialEnergy() const;
  bool validate(std::string* why) const;

  void startRecording();      // recording: record.cpp
  Recording takeRecording();  ///< ends the recording and returns it

 private:
  /// Two spheres, or a sphere and an immovable body, at the instant of their contact.
  struct Pair {
    Motion motion;
    Motion otherMotion;
    Vec3 normal;  ///< unit, from the other body to `sphere`
    double approachSpeed = 0.0;
    std::uint32_t sphere = 0;
    std::uint32_t other = 0;  ///< EventScheduler::kNobody for an immovable body
  };

  /// Changes of velocity (m/s) by an impulse of 1 N s between two bodies.
  struct Give {
    Vec3 yield = Vec3::Zero();
    Vec3 otherYield = Vec3::Zero();
    std::vector<std::pair<std::uint32_t, Vec3>> others;  ///< spheres that rods connect with them
  };
  /// A hop off an edge or corner.
  struct EdgeHop {
    double rebound = 0.0;   ///< m/s, along the normal
    double sideways = 1.0;  ///< share of the speed across the normal that remains
  };

  Motion motionAtTime(std::size_t sphere) const { return bodies_.at(sphere, {time_, 0.0}); }

  void step(std::uint32_t sphere);
  void meetSphere(std::uint32_t sphere, std::uint32_t other);
  void collide(const Pair& pair);
  void collideLinked(const Pair& pair, double restitution);
  void reportPair(const Pair& pair, double mass, double impulse);
  void takeMechanics(const SphereWorld& world);
  void touch(const Pair& pair);
  void meetWall(std::uint32_t sphere, std::uint32_t index);
  void meetImmovable(std::uint32_t sphere, std::uint32_t index);
  void bounce(std::uint32_t sphere, Motion motion, std::uint32_t index, double approachSpeed);
  void leave(std::uint32_t sphere, const Motion& motion);
  void rebase(std::uint32_t sphere, const Motion& motion);
  void openBooks();
  void book(std::uint32_t sphere, const Vec3& before, const Vec3& after);
  void bookForces(std::uint32_t sphere, const Motion& now, Books& books) const;
  void audit(const Pair& pair, const Motion& motion, const Motion& otherMotion, double taken);
  bool validateBooks(std::string* why) const;
  double restitutionOf(std::uint32_t sphere, std::uint32_t other, double approachSpeed) const;
  double wallRestitution(std::uint32_t sphere, const Plane& plane, double approachSpeed) const;
  Side sideOf(std::uint32_t sphere, const Motion& motion) const;
  Side wallSide(const Wall& wall, const Vec3& point) const;

  // Simultaneous contacts: simultaneous.cpp.
  struct Cluster;
  bool meetTogether(std::uint32_t sphere, std::uint32_t partner) {
    return (tied_ || !stiffnesses_.empty()) && resolveCluster(sphere, partner);
  }
  bool resolveCluster(std::uint32_t sphere, std::uint32_t partner);
  Cluster clusterAt(std::uint32_t sphere, std::uint32_t partner) const;
  void gather(Cluster& cluster) const;
  bool meets(std::uint32_t sphere, const Vec3& position, std::uint32_t other) const;
  void describe(Cluster& cluster) const;
  double clusterRestitution(std::uint32_t sphere, std::uint32_t partner,
                            double approachSpeed) const;
  double hertzStiffness(std::uint32_t sphere, std::uint32_t partner) const;
  bool wakeHit(const Cluster& cluster);
  void reportCluster(const Cluster& cluster);
  bool applyCluster(const Cluster& cluster);
  void settleRods(std::uint32_t group);

  // Boxes and planes that oscillate: surfaces.cpp.
  void meetBox(std::uint32_t sphere, std::uint32_t index);
  void meetEdge(std::uint32_t sphere, const Solid& solid, const Vec3& normal);
  void strikeEdge(std::uint32_t sphere, const Solid& solid, const Impact& impact, Motion& motion);
  void touchEdge(std::uint32_t sphere, const Solid& solid, const Impact& impact, Motion& motion);
  Vec3 sidewaysOf(std::uint32_t sphere, const Vec3& velocity, const Vec3& normal) const;
  EdgeHop edgeHop(std::uint32_t sphere, const Impact& impact, double mass, double square);
  void passBorder(std::uint32_t sphere, std::uint32_t face);
  void meetOscillating(std::uint32_t sphere, std::uint32_t index);
  void bounceOffOscillating(std::uint32_t sphere, std::uint32_t index, const Impact& impact,
                            double pressed, Motion& motion);

  void report(const Side& first, const Side& second, const Impact& impact);
  void predictChanged();
  void record(std::uint32_t sphere);
  Recording::World recordedWorld() const;

  // Springs, rods and fields, friction and spin: mechanics.cpp.
  void turn(std::uint32_t sphere);
  bool linked(std::size_t sphere) const { return linkage_.groupOf(sphere) != Linkage::kNoGroup; }
  Vec3 pullOn(std::uint32_t sphere) const;
  std::vector<Motion> motionsOf(std::uint32_t group, const Instant& instant) const;
  void restartGroup(std::uint32_t group);
  void restartGroups();
  Give giveOf(const Pair& pair) const;
  void drag(const Give& give, double impulse);
  Vec3 spinAt(std::size_t sphere, const Instant& instant) const;
  void rub(const Pair& pair, double impulse, Motion& motion, Motion& otherMotion);
  void rubOnWall(std::uint32_t sphere, const Plane& plane, double impulse, Motion& motion);
  void roll(std::uint32_t sphere);

  // Rest, sleep and collapse: rest.cpp.
  void grantFirstHops();
  void allowHop(std::uint32_t sphere, double energy);
  double pull(std::uint32_t sphere, std::uint32_t other, const Vec3& normal) const;
  double restSpeed(std::uint32_t sphere) const;
  Vec3 yielding(std::uint32_t sphere, const Vec3& direction) const;
  bool hopsAreDamped(std::uint32_t sphere) const;
  double restingRebound(const Pair& pair, double effectiveMass);
  double wallRebound(std::uint32_t sphere, std::uint32_t index, double approachSpeed);
  bool noteContact(std::uint32_t sphere, const Motion& motion);
  void giveUp(std::uint32_t sphere, double interval);
  void stop(std::uint32_t sphere, Motion& motion);
  void hold(std::uint32_t sphere, Motion& motion, std::uint32_t index);
  void keepHolds(std::uint32_t sphere, Motion& motion);
  void trySleep(std::uint32_t sphere);
  double touchingGap(double radius) const;
  bool touches(std::uint32_t sphere, const Vec3& position, std::uint32_t other) const;
  std::vector<std::uint32_t> calmNeighbours(std::uint32_t sphere) const;
  bool carriedByWalls(std::uint32_t sphere) const;
  bool carried(std::uint32_t sphere, std::span<const std::uint32_t> candidates) const;
  void layDown(std::uint32_t sphere);
  void wake(std::uint32_t sphere);

  bool validateSphere(std::size_t sphere, std::string* why) const;
  bool validateApart(std::size_t sphere, std::string* why) const;
  bool validateOutside(std::size_t sphere, std::string* why) const;

  RestitutionTable restitutions_;
  double restSpeed_;                  ///< m/s
  std::vector<std::uint32_t> order_;  ///< by position in SphereWorld::spheres: number of the sphere
  Bodies bodies_;
  std::vector<Substance> substances_;  ///< by sphere
  Linkage linkage_;
  std::vector<Vec3> pulls_;                ///< m/s^2, by sphere, for linked spheres; or empty
  std::vector<std::uint32_t> restarts_;    ///< groups to restart before the next prediction
  std::vector<Spin> spins_;                ///< by sphere; empty if no sphere spins
  std::vector<SphereFriction> frictions_;  ///< by sphere; empty if no sphere spins
  std::vector<RestitutionLaw> laws_;       ///< by sphere; empty if all are constant
  EventScheduler scheduler_;
  std::vector<double> stiffnesses_;     ///< Pa, by sphere; empty except for Simultaneous::hertz
  bool tied_ = false;                   ///< true if the present contact may be one of several
  std::vector<std::uint32_t> changed_;  ///< spheres changed since the last prediction
  Instant now_;                         ///< instant of the present contact
  double time_ = 0.0;                   ///< s, at which advanceTo stopped
  std::vector<ImpulseEvent> events_;
  SphereStepperCounters counters_;
  Books books_;
  std::unique_ptr<Recording> recording_;  ///< null if nothing is recorded
};

}  // namespace carom::native
