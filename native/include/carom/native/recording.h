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

/// The recorded run of a SphereStepper. Every state and every event of the run can be read from it,
/// bit for bit, at any time and in any order, without stepping.
///
/// Between the instants at which something happens to it, a sphere moves on a parabola. So a run is
/// stored as each sphere's successive parabolas, its segments. A collision stores its normal,
/// approach speed, effective mass and impulse; everything else in its two events follows from the
/// segments that it ends. Events that differ from what is rebuilt in this way are stored whole
/// (exceptions()): no event loses a bit, it only takes more room.
///
/// Memory: 92 bytes for each segment and 104 for each collision, and up to twice that while
/// recording. recording_format.h has the form for files, which is much smaller. Not thread-safe
/// while it grows; otherwise [any thread].
class Recording {
 public:
  static constexpr std::uint32_t kNobody = 0xFFFFFFFF;

  struct Sphere {
    BodyId id = 0;
    double radius = 0.0;  ///< m
    double mass = 0.0;    ///< kg
  };
  /// An immovable body.
  struct Wall {
    BodyId id = 0;
    Vec3 normal = Vec3::UnitX();   ///< unit, world frame, towards the spheres
    double offset = 0.0;           ///< m, at time 0, of the plane { x : normal . x = offset }
    Vec3 velocity = Vec3::Zero();  ///< m/s, world frame
  };
  /// The parabola on which a sphere moves from `since` until its next segment begins.
  struct Segment {
    Instant since;
    Vec3 position = Vec3::Zero();      ///< m, world frame, at `since`
    Vec3 velocity = Vec3::Zero();      ///< m/s, world frame, at `since`
    Vec3 acceleration = Vec3::Zero();  ///< m/s^2, world frame

    Motion at(const Instant& instant) const {
      return Motion{position, velocity, since}.at(instant, acceleration);
    }
  };
  /// The two events of one collision in compact form. `first` is a sphere.
  struct Collision {
    Instant time;
    std::uint32_t first = 0;            ///< a sphere
    std::uint32_t second = kNobody;     ///< a sphere, or sphere count + index of a wall
    std::uint32_t firstSegment = 0;     ///< index of the segment that brings `first`
    std::uint32_t secondSegment = 0;    ///< the same for `second`, if it is a sphere
    std::uint32_t exception = kNobody;  ///< index in exceptions(), if not rebuilt
    double approachSpeed = 0.0;         ///< m/s
    double effectiveMass = 0.0;         ///< kg
    double impulse = 0.0;               ///< N s, on `first` along the normal
    Vec3 normal = Vec3::UnitX();        ///< unit, world frame, towards `first`
  };
  using Events = std::array<ImpulseEvent, 2>;  ///< the events of the first and of the second body

  /// Properties that stay the same during the whole run.
  struct World {
    Vec3 gravity = Vec3::Zero();  ///< m/s^2
    std::vector<Sphere> spheres;  ///< ids ascending
    std::vector<Wall> walls;
    /// Restitutions (1) of some or all pairs of bodies; they only make files smaller.
    std::vector<double> restitutions;
  };

  Recording() = default;
  /// Begins a run at `begin` (s). `segments` holds one segment for each sphere, which began at
  /// `begin` or before.
  Recording(World world, double begin, std::span<const Segment> segments);

  /// Free text that travels with the recording, for example the scene; its meaning is up to the
  /// caller.
  const std::string& payload() const { return payload_; }
  void setPayload(std::string payload) { payload_ = std::move(payload); }

  const World& world() const { return world_; }
  std::size_t sphereCount() const { return world_.spheres.size(); }
  /// Index of the sphere in this recording; nothing if the id is unknown.
  std::optional<std::size_t> sphereOf(BodyId id) const;

  double begin() const { return begin_; }  ///< s
  double end() const { return end_; }      ///< s, until which the run is known

  /// Returns the sphere's state at `time` (s, from begin() to end(); asserted, and clamped to this
  /// range), as SphereStepper::state would return it after advanceTo(time), but without spin. O(log
  /// of the number of its segments).
  SphereState state(std::size_t sphere, double time) const;
  std::span<const Segment> segments(std::size_t sphere) const { return segments_[sphere]; }
  std::size_t segmentCount() const;  ///< the sum over all spheres

  std::size_t collisionCount() const { return collisions_.size(); }
  /// Number of collisions at `time` (s) or before. O(log of the number of collisions).
  std::size_t collisionsUntil(double time) const;
  /// All collisions in order of time.
  std::span<const Collision> collisions() const { return collisions_; }
  /// Returns the two events of a collision as SphereStepper::advanceTo returned them. O(1).
  Events events(std::size_t collision) const;
  /// Returns the events later than `after` (s) and not later than `until` (s), in order of time.
  std::vector<ImpulseEvent> eventsBetween(double after, double until) const;

  /// Hash (FNV-1a) over the bits of all events (time, impulse, position, bodyVelocity) and of the
  /// spheres' positions and velocities at end(), in order of ids. Equal runs have equal hashes;
  /// different runs hardly ever do.
  std::uint64_t trajectoryHash() const;

  // Functions that build a recording; called in the order in which things happen.

  /// Adds a segment: the sphere moves as `segment` says from its `since` on.
  void addSegment(std::uint32_t sphere, const Segment& segment);
  /// Adds the two events of one collision at `instant`, before the segments to which it leads.
  /// `impulse` in N s acts on the first body along the normal.
  void addCollision(const Events& events, const Instant& instant, double impulse);
  /// Adds a collision in compact form. `exception` (or null) holds its events where they differ
  /// from rebuilt().
  void addCollision(const Collision& collision, const Events* exception);
  /// Declares the run known until `time` (s), which must not be before end().
  void extendTo(double time) { end_ = time; }

  /// One entry per record since begin(): the sphere whose segment it is, or kNobody for a
  /// collision.
  std::span<const std::uint32_t> log() const { return log_; }
  std::span<const Events> exceptions() const { return exceptions_; }
  /// Returns the events as they follow from the states, whatever exceptions() says.
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

/// Calls visit(numbers) with a span of doubles for each floating-point field of the event, in the
/// order of declaration: kEventFields calls.
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
