#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <carom/audio/impulse_event.h>
#include <carom/native/motion.h>
#include <carom/native/sphere_stepper.h>

namespace carom {

/// A run of a SphereStepper, from which every state and every event of it can be had again, bit for
/// bit, at any time and in any order, without stepping.
///
/// Between the instants at which something happens to a sphere it moves on a parabola. So a run is
/// the parabolas of each sphere one after the other, its segments, and between two of them nothing
/// is to be known. A collision keeps its normal, approach speed, effective mass and impulse; all
/// else in its two events follows from the segments that it ends. What an event says beyond that is
/// kept as it is (Exception): no event loses a bit, it only takes more room.
///
/// Memory: 92 bytes for each segment and 104 for each collision, times up to two while recording.
/// recording_format.h has the form for files, which is much smaller. Not thread-safe while it
/// grows; otherwise [any thread].
class Recording {
 public:
  static constexpr std::uint32_t kNobody = 0xFFFFFFFF;

  struct Sphere {
    BodyId id = 0;
    double radius = 0.0;  ///< m
    double mass = 0.0;    ///< kg
  };
  /// A body that nothing can push.
  struct Wall {
    BodyId id = 0;
    Vec3 normal = Vec3::UnitX();   ///< unit, world frame, towards the spheres
    double offset = 0.0;           ///< m, at time 0, of the plane { x : normal . x = offset }
    Vec3 velocity = Vec3::Zero();  ///< m/s, world frame
  };
  /// A parabola: how a sphere moves from `since` on, until its next segment begins.
  struct Segment {
    Instant since;
    Vec3 position = Vec3::Zero();      ///< m, world frame, at `since`
    Vec3 velocity = Vec3::Zero();      ///< m/s, world frame, at `since`
    Vec3 acceleration = Vec3::Zero();  ///< m/s^2, world frame

    Motion at(const Instant& instant) const {
      return Motion{position, velocity, since}.at(instant, acceleration);
    }
  };
  /// Two events in short. `first` is a sphere.
  struct Collision {
    Instant time;
    std::uint32_t first = 0;            ///< a sphere
    std::uint32_t second = kNobody;     ///< a sphere, or the number of spheres + a wall
    std::uint32_t firstSegment = 0;     ///< of `first`: which one it came along
    std::uint32_t secondSegment = 0;    ///< of `second`, if that is a sphere
    std::uint32_t exception = kNobody;  ///< index of exceptions(), if it has one
    double approachSpeed = 0.0;         ///< m/s
    double effectiveMass = 0.0;         ///< kg
    double impulse = 0.0;               ///< N s, on `first` along the normal
    Vec3 normal = Vec3::UnitX();        ///< unit, world frame, towards `first`
  };
  using Events = std::array<ImpulseEvent, 2>;  ///< of the first body, of the second

  /// What is the same for the whole run.
  struct World {
    Vec3 gravity = Vec3::Zero();  ///< m/s^2
    std::vector<Sphere> spheres;  ///< ids ascending
    std::vector<Wall> walls;
    /// 1, of pairs of bodies, some or all: only makes files smaller.
    std::vector<double> restitutions;
  };

  Recording() = default;
  /// From `begin` (s) on; `segments` holds one for each sphere, which has begun by then.
  Recording(World world, double begin, std::span<const Segment> segments);

  /// Whatever text its owner wants to travel along: a scene, for one.
  const std::string& payload() const { return payload_; }
  void setPayload(std::string payload) { payload_ = std::move(payload); }

  const World& world() const { return world_; }
  std::size_t sphereCount() const { return world_.spheres.size(); }
  /// By which index the sphere is known here.
  std::optional<std::size_t> sphereOf(BodyId id) const;

  double begin() const { return begin_; }  ///< s
  double end() const { return end_; }      ///< s, up to which all is known

  /// The sphere's state at `time` (s, from begin() to end(); asserted, and taken to the nearer of
  /// them), as SphereStepper::state would have it after advanceTo(time). O(log of its segments).
  SphereState state(std::size_t sphere, double time) const;
  std::span<const Segment> segments(std::size_t sphere) const { return segments_[sphere]; }
  std::size_t segmentCount() const;  ///< of all spheres

  std::size_t collisionCount() const { return collisions_.size(); }
  /// How many have happened at `time` (s) or before. O(log of their number).
  std::size_t collisionsUntil(double time) const;
  /// In order of time.
  std::span<const Collision> collisions() const { return collisions_; }
  /// What SphereStepper::advanceTo returned of it. O(1).
  Events events(std::size_t collision) const;
  /// All later than `after` (s) and not later than `until` (s), in order of time.
  std::vector<ImpulseEvent> eventsBetween(double after, double until) const;

  /// FNV-1a over the bits of all events (time, impulse, position, bodyVelocity), and of the
  /// spheres' positions and velocities at end(), in order of their ids: equal for equal runs, and
  /// hardly ever otherwise.
  std::uint64_t trajectoryHash() const;

  // For those who record, in order of what happens.

  /// The sphere moves as `segment` says from now on.
  void addSegment(std::uint32_t sphere, const Segment& segment);
  /// Two events of one collision at `instant`, before the segments to which it leads; `impulse` N
  /// s, on the first body along the normal.
  void addCollision(const Events& events, const Instant& instant, double impulse);
  /// As above in short. Only what `exception` holds, if anything, is not rebuilt.
  void addCollision(const Collision& collision, const Events* exception);
  /// All until `time` (s) is known. Not before end().
  void extendTo(double time) { end_ = time; }

  /// Which sphere's segment was next, or kNobody for a collision, since begin().
  std::span<const std::uint32_t> log() const { return log_; }
  std::span<const Events> exceptions() const { return exceptions_; }
  /// What follows of the events from the states, and from nothing that is an exception.
  Events rebuilt(const Collision& collision) const;

 private:
  std::uint32_t bodyOf(BodyId id) const;
  const Segment& segmentAt(std::size_t sphere, double time) const;

  World world_;
  std::string payload_;
  double begin_ = 0.0;
  double end_ = 0.0;
  std::vector<std::vector<Segment>> segments_;  // by sphere
  std::vector<Collision> collisions_;
  std::vector<Events> exceptions_;
  std::vector<std::uint32_t> log_;
};

/// Calls visit(numbers) with a span of doubles for each field of the event that holds such, in the
/// order of their declaration: kEventFields of them.
template <class Visit>
void visitFields(ImpulseEvent& event, const Visit& visit) {
  const auto vector = [&](auto& value) { visit(std::span<double>(value.data(), 3)); };
  const auto number = [&](double& value) { visit(std::span<double>(&value, 1)); };
  number(event.time);
  vector(event.impulse);
  vector(event.appliedImpulse);
  vector(event.position);
  vector(event.normal);
  number(event.approachSpeed);
  number(event.effectiveMass);
  number(event.radius);
  number(event.otherRadius);
  vector(event.bodyPosition);
  visit(std::span<double>(event.bodyOrientation.coeffs().data(), 4));
  vector(event.bodyVelocity);
  vector(event.bodyAngularVelocity);
}
inline constexpr unsigned kEventFields = 13;

}  // namespace carom
