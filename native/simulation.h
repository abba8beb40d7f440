#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "carom/native/recording.h"
#include "carom/native/sphere_stepper.h"
#include "native/agenda.h"
#include "native/bodies.h"
#include "native/event_pair.h"
#include "native/linkage.h"
#include "native/rolling.h"

namespace carom::native {

// These define resting and are documented in SphereStepper.
inline constexpr double kHopTime = 0.5e-3;      ///< s, of a hop that is paid for
inline constexpr double kLeastHopTime = 20e-6;  ///< s, of one that is not
inline constexpr double kWakeSpeed = 4.0;       ///< of the rest speed: what is slower lets sleep
inline constexpr double kLeastRebound = 1e-15;  ///< of the speed: more than its rounding swallows

/// What a sphere is but for its size, and how it comes to rest.
struct Substance {
  double mass = 0.0;         ///< kg
  double restitution = 0.0;  ///< 1, at the speed of its law
  SurfaceId surface = 0;
  std::uint16_t rapidContacts = 0;  ///< in a row, kCollapseInterval apart or less
  bool asleep = false;
  bool collapsed = false;         ///< once: its rest speed is raised
  double hopAllowance = 0.0;      ///< J, that a hop may give back
  double calmSince = kNever;      ///< s: it has kept to ...
  Vec3 calmPlace = Vec3::Zero();  ///< m, ... this place
};

/// What momentum and energy should be, summed up from what has changed them: free flight changes
/// them by gravity alone, a collision of two not at all or by what restitution takes, and all else
/// by what it did to the velocities. For validate().
struct Books {
  Vec3 momentum = Vec3::Zero();    ///< kg m/s, without what gravity adds
  double energy = 0.0;             ///< J, of translation and gravity
  double momentumTurnover = 0.0;   ///< kg m/s, of all changes
  double energyTurnover = 0.0;     ///< J
  Vec3 unbalanced = Vec3::Zero();  ///< kg m/s, by which collisions of two have not kept momentum
  double unexplained = 0.0;        ///< J, by which they have changed energy otherwise
};

/// What SphereStepper does. Spheres are counted in order of their ids. Internal to native/.
class Simulation {
 public:
  explicit Simulation(const SphereWorld& world);

  void advanceTo(double time);
  void push(std::size_t listed, const Vec3& impulse);

  const std::vector<ImpulseEvent>& events() const { return events_; }
  double time() const { return time_; }
  std::size_t sphereCount() const { return bodies_.count(); }
  const SphereStepperCounters& counters() const { return counters_; }
  /// At time(), by position in SphereWorld::spheres.
  Motion motionOf(std::size_t listed) const { return motionAtTime(order_[listed]); }
  Vec3 spinOf(std::size_t listed) const { return spinAt(order_[listed], {time_, 0.0}); }
  double kineticEnergy() const;
  double potentialEnergy() const;
  bool validate(std::string* why) const;

  void startRecording();      // these two: record.cpp
  Recording takeRecording();  ///< what has been recorded

 private:
  /// Two spheres at the instant of their contact.
  struct Pair {
    Motion motion;
    Motion otherMotion;
    Vec3 normal;  ///< from the other
    double approachSpeed = 0.0;
    std::uint32_t sphere = 0;
    std::uint32_t other = 0;  ///< Agenda::kNobody: something immovable
  };

  /// What an impulse of 1 N s between two does, m/s.
  struct Give {
    Vec3 yield = Vec3::Zero();
    Vec3 otherYield = Vec3::Zero();
    std::vector<std::pair<std::uint32_t, Vec3>> others;  ///< that rods connect with them
  };
  /// Off an edge or corner.
  struct EdgeHop {
    double rebound = 0.0;   ///< m/s
    double sideways = 1.0;  ///< what remains of the speed across the normal
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

  // Several contacts at one instant: simultaneous.cpp.
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

  // Surfaces that are finite or shake: surfaces.cpp.
  void meetBox(std::uint32_t sphere, std::uint32_t index);
  void meetEdge(std::uint32_t sphere, const Solid& solid, const Vec3& normal);
  void strikeEdge(std::uint32_t sphere, const Solid& solid, const Impact& impact, Motion& motion);
  void touchEdge(std::uint32_t sphere, const Solid& solid, const Impact& impact, Motion& motion);
  Vec3 sidewaysOf(std::uint32_t sphere, const Vec3& velocity, const Vec3& normal) const;
  EdgeHop edgeHop(std::uint32_t sphere, const Impact& impact, double mass, double square);
  void passBorder(std::uint32_t sphere, std::uint32_t face);
  void meetShaken(std::uint32_t sphere, std::uint32_t index);
  void bounceOffShaken(std::uint32_t sphere, std::uint32_t index, const Impact& impact,
                       double pressed, Motion& motion);

  void report(const Side& first, const Side& second, const Impact& impact);
  void predictChanged();
  void record(std::uint32_t sphere);
  Recording::World recordedWorld() const;

  // What bends paths, and what turns spheres: mechanics.cpp.
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

  // How things come to rest: rest.cpp.
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
  std::vector<std::uint32_t> order_;  ///< by position in SphereWorld::spheres: which sphere it is
  Bodies bodies_;
  std::vector<Substance> substances_;  ///< by sphere
  Linkage linkage_;
  std::vector<Vec3> pulls_;                ///< m/s^2, by sphere, of what is linked; or empty
  std::vector<std::uint32_t> restarts_;    ///< groups, since the last prediction
  std::vector<Spin> spins_;                ///< by sphere; empty where nothing spins
  std::vector<SphereFriction> frictions_;  ///< by sphere; empty where nothing spins
  std::vector<RestitutionLaw> laws_;       ///< by sphere; empty where all are constant
  Agenda agenda_;
  std::vector<double> stiffnesses_;     ///< Pa, by sphere; empty but for Simultaneous::hertz
  bool tied_ = false;                   ///< the contact at hand may be one of several
  std::vector<std::uint32_t> changed_;  ///< spheres whose motion has, since the last prediction
  Instant now_;                         ///< of the contact at hand
  double time_ = 0.0;                   ///< s, where advanceTo stopped
  std::vector<ImpulseEvent> events_;
  SphereStepperCounters counters_;
  Books books_;
  std::unique_ptr<Recording> recording_;  ///< null: nothing is recorded
};

}  // namespace carom::native
