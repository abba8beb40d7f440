#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "native/agenda.h"
#include "native/bodies.h"
#include "native/sphere_stepper.h"

namespace carom {

/// What a sphere is but for its size, and how it comes to rest.
struct Substance {
  double mass = 0.0;         ///< kg
  double restitution = 0.0;  ///< 1
  SurfaceId surface = 0;
  std::uint16_t rapidContacts = 0;  ///< in a row, kCollapseInterval apart or less
  bool asleep = false;
  bool collapsed = false;         ///< once: its rest speed is raised
  double hopAllowance = 0.0;      ///< J, that a hop may give back
  double calmSince = kNever;      ///< s: it has kept to ...
  Vec3 calmPlace = Vec3::Zero();  ///< m, ... this place
};

/// One collision as its first body sees it, before its velocity changes.
struct Impact {
  Vec3 normal;  ///< unit, towards the first body
  double approachSpeed = 0.0;
  double effectiveMass = 0.0;
  double impulse = 0.0;  ///< N s, on the first body along the normal
};

/// One partner of an impact.
struct Side {
  BodyId id = 0;
  double radius = kNever;  ///< m
  Vec3 position;
  Vec3 velocity;
};

/// What SphereStepper does. Spheres are counted in order of their ids. Internal to native/.
class SphereStepper::Simulation {
 public:
  explicit Simulation(const SphereWorld& world);

  void advanceTo(double time);

  const std::vector<ImpulseEvent>& events() const { return events_; }
  double time() const { return time_; }
  std::size_t sphereCount() const { return bodies_.count(); }
  const SphereStepperCounters& counters() const { return counters_; }
  /// At time(), by position in SphereWorld::spheres.
  Motion motionOf(std::size_t listed) const { return motionAtTime(order_[listed]); }
  bool asleep(std::size_t listed) const { return substances_[order_[listed]].asleep; }
  double kineticEnergy() const;
  double potentialEnergy() const;
  bool validate(std::string* why) const;

 private:
  /// Two spheres at the instant of their contact.
  struct Pair {
    std::uint32_t sphere = 0;
    std::uint32_t other = 0;
    Motion motion;
    Motion otherMotion;
    Vec3 normal;  ///< from the other
    double approachSpeed = 0.0;
  };

  Motion motionAtTime(std::size_t sphere) const { return bodies_.at(sphere, {time_, 0.0}); }

  void step(std::uint32_t sphere);
  void meetSphere(std::uint32_t sphere, std::uint32_t other);
  void collide(const Pair& pair);
  void touch(const Pair& pair);
  void meetWall(std::uint32_t sphere, std::uint32_t index);
  void bounce(std::uint32_t sphere, Motion motion, std::uint32_t index, double approachSpeed);
  void leave(std::uint32_t sphere, const Motion& motion);
  void report(const Side& first, const Side& second, const Impact& impact);
  void predictChanged();

  // How things come to rest: rest.cpp.
  void grantFirstHops();
  void allowHop(std::uint32_t sphere, double energy);
  double pull(std::uint32_t sphere, std::uint32_t other, const Vec3& normal) const;
  double restSpeed(std::uint32_t sphere) const;
  Vec3 yielding(std::uint32_t sphere, const Vec3& direction) const;
  double restingRebound(const Pair& pair, double effectiveMass);
  double wallRebound(std::uint32_t sphere, std::uint32_t index, double approachSpeed);
  bool noteContact(std::uint32_t sphere, const Motion& motion);
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

  RestitutionTable restitutions_;
  double restSpeed_;                  ///< m/s
  std::vector<std::uint32_t> order_;  ///< by position in SphereWorld::spheres: which sphere it is
  Bodies bodies_;
  std::vector<Substance> substances_;  ///< by sphere
  Agenda agenda_;
  std::vector<std::uint32_t> changed_;  ///< spheres whose motion has, since the last prediction
  Instant now_;                         ///< of the contact at hand
  double time_ = 0.0;                   ///< s, where advanceTo stopped
  std::vector<ImpulseEvent> events_;
  SphereStepperCounters counters_;
};

}  // namespace carom
