#include "carom/native/recording_format.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "native/math/contact_time.h"
#include "native/math/vector_math.h"
#include "native/recording/recording_archive.h"

namespace carom {

using namespace native;

namespace {

using RecordedSphere = Recording::Sphere;
using Wall = Recording::Wall;
using Segment = Recording::Segment;
using Collision = Recording::Collision;
using Events = Recording::Events;

// Flags of a record; see recording_format.h.
constexpr unsigned kIsCollision = 0x01;
constexpr unsigned kOfFirst = 0x02;
constexpr unsigned kOfSecond = 0x04;
constexpr unsigned kSegmentSameInstant = 0x08;
constexpr unsigned kPositionFollows = 0x10;
constexpr unsigned kVelocityFollows = 0x20;
constexpr unsigned kAccelerationStays = 0x40;
constexpr unsigned kMeets = 0x80;
constexpr unsigned kSegmentFlags = 0xFE;
constexpr unsigned kCollisionSameInstant = 0x02;
constexpr unsigned kInstantFollows = 0x04;
constexpr unsigned kImpactFollows = 0x08;
constexpr unsigned kRebuilt = 0x10;
constexpr unsigned kCollisionFlags = 0x1F;
// Flags of an event.
constexpr std::uint64_t kHasApplied = std::uint64_t{1} << kEventFields;
constexpr std::uint64_t kIdsFollow = kHasApplied << 1U;

/// Component along a normal, relative to gravity, up to which it is rounding.
constexpr double kLevel = 1e-15;
constexpr std::size_t kHeaderSize = kRecordingMagic.size() + sizeof(std::uint32_t);
constexpr std::size_t kChecksumSize = sizeof(std::uint64_t);

constexpr const char* kOutOfRange = "a number is out of range; expected at most 1e100 either way";

bool same(double one, double other) {
  return std::bit_cast<std::uint64_t>(one) == std::bit_cast<std::uint64_t>(other);
}
bool same(const Vec3& one, const Vec3& other) {
  return same(one.x(), other.x()) && same(one.y(), other.y()) && same(one.z(), other.z());
}
bool same(const Instant& one, const Instant& other) {
  return same(one.seconds, other.seconds) && same(one.rest, other.rest);
}

bool bounded(double value) {
  return std::abs(value) <= kLargestRecorded;
}
bool bounded(const Vec3& value) {
  return bounded(value.x()) && bounded(value.y()) && bounded(value.z());
}
bool sound(const Instant& instant) {
  return bounded(instant.seconds) && instant.seconds >= 0.0 && bounded(instant.rest) &&
         instant.seconds + instant.rest == instant.seconds;
}

/// The quantities of a plain collision, whose impulse is along the normal.
struct Impact {
  Vec3 normal = Vec3::UnitX();
  double approachSpeed = 0.0;
  double effectiveMass = 0.0;
  double change = 0.0;  ///< m/s, change of the relative velocity along the normal
  double impulse = 0.0;

  bool sameAs(const Collision& collision) const {
    return same(normal, collision.normal) && same(approachSpeed, collision.approachSpeed) &&
           same(effectiveMass, collision.effectiveMass) && same(impulse, collision.impulse);
  }
};

/// The two bodies of the last collision, and the velocities with which their next segments begin
/// unless their records say otherwise.
struct Aftermath {
  std::uint32_t first = Recording::kNobody;
  std::uint32_t second = Recording::kNobody;
  Instant time;
  Vec3 velocity = Vec3::Zero();       ///< m/s, of the first body
  Vec3 otherVelocity = Vec3::Zero();  ///< m/s, of the second body
};

/// One pass through the records: keeps the present segments of the spheres, and predicts what
/// follows from them.
class Pass {
 public:
  explicit Pass(const Recording& recording)
      : recording_(recording), current_(recording.sphereCount(), 0), last_{recording.begin(), 0.0} {
    const Vec3& gravity = recording.world().gravity;
    level_ = kLevel * std::sqrt(dotInOrder(gravity, gravity));
  }

  const Segment& segment(std::uint32_t sphere) const {
    return recording_.segments(sphere)[current_[sphere]];
  }
  const RecordedSphere& sphere(std::uint32_t index) const {
    return recording_.world().spheres[index];
  }
  const Wall& wall(std::uint32_t body) const {
    return recording_.world().walls[body - recording_.sphereCount()];
  }
  bool isSphere(std::uint32_t body) const { return body < recording_.sphereCount(); }
  std::uint32_t currentSegment(std::uint32_t sphere) const { return current_[sphere]; }
  const Instant& last() const { return last_; }
  const Aftermath& aftermath() const { return aftermath_; }

  Motion expected(std::uint32_t sphere, const Instant& instant) const;
  Instant contact(std::uint32_t first, std::uint32_t second) const;
  Impact impact(const Collision& collision, double restitution) const;

  void addSegment(std::uint32_t sphere, const Instant& instant) {
    ++current_[sphere];
    last_ = instant;
  }
  /// Adds a collision that changes the relative velocity along the normal by `change` (m/s).
  void addCollision(const Collision& collision, double change);
  /// Adds a contact that is too slow to be reported: see SphereStepper on rest.
  void meet(std::uint32_t sphere, std::uint32_t body, const Instant& instant);

 private:
  Instant wallContact(const Segment& segment, double radius, const Wall& wall) const;

  const Recording& recording_;
  std::vector<std::uint32_t> current_;  // by sphere: its present segment
  Instant last_;                        // instant of the last record
  Aftermath aftermath_;                 // result of the last collision
  double level_ = 0.0;                  // m/s^2
};

/// Motion of the sphere from `instant` on, unless its record says otherwise.
Motion Pass::expected(std::uint32_t sphere, const Instant& instant) const {
  Motion motion = segment(sphere).at(instant);
  if (!same(instant, aftermath_.time)) return motion;
  if (sphere == aftermath_.first) motion.velocity = aftermath_.velocity;
  if (sphere == aftermath_.second) motion.velocity = aftermath_.otherVelocity;
  return motion;
}

/// Instant at which the two bodies touch, if they have the same acceleration; otherwise never.
Instant Pass::contact(std::uint32_t first, std::uint32_t second) const {
  if (second == Recording::kNobody) return Instant::never();
  const Segment& one = segment(first);
  if (!isSphere(second)) return wallContact(one, sphere(first).radius, wall(second));
  const Segment& two = segment(second);
  if (!same(one.acceleration, two.acceleration)) return Instant::never();
  const double lag = elapsed(two.since, one.since);
  const bool later = lag >= 0.0;
  const Vec3& flown = later ? two.velocity : one.velocity;
  const double half = later ? 0.5 * lag : -0.5 * lag;
  Vec3 separation;
  Vec3 velocity;
  for (int axis = 0; axis < 3; ++axis) {
    separation[axis] = one.position[axis] - two.position[axis] -
                       lag * (flown[axis] + half * one.acceleration[axis]);
    velocity[axis] = one.velocity[axis] - two.velocity[axis] - lag * one.acceleration[axis];
  }
  const double wait =
      sphereContactTime(separation, velocity, sphere(first).radius + sphere(second).radius);
  return after(later ? one.since : two.since, wait);
}

Instant Pass::wallContact(const Segment& segment, double radius, const Wall& wall) const {
  const double speed = dotInOrder(wall.normal, wall.velocity);
  double height = dotInOrder(wall.normal, segment.position) - wall.offset - radius;
  if (speed != 0.0) height -= speed * elapsed(Instant{}, segment.since);
  const double along = dotInOrder(wall.normal, segment.acceleration);
  const double pull = std::abs(along) > level_ ? along : 0.0;
  const double velocity = dotInOrder(wall.normal, segment.velocity) - speed;
  return after(segment.since, planeContactTime(height, velocity, pull));
}

Impact Pass::impact(const Collision& collision, double restitution) const {
  const Motion motion = segment(collision.first).at(collision.time);
  const double mass = sphere(collision.first).mass;
  Impact impact;
  if (collision.second == Recording::kNobody) return impact;
  if (!isSphere(collision.second)) {
    const Wall& struck = wall(collision.second);
    const double speed = dotInOrder(struck.normal, struck.velocity);
    impact.normal = struck.normal;
    impact.approachSpeed = speed - dotInOrder(struck.normal, motion.velocity);
    impact.effectiveMass = mass;
    impact.change = impact.approachSpeed + restitution * impact.approachSpeed;
    impact.impulse = mass * impact.change;
    return impact;
  }
  const Motion other = segment(collision.second).at(collision.time);
  const double otherMass = sphere(collision.second).mass;
  const Vec3 separation = motion.position - other.position;
  const double distance = std::sqrt(dotInOrder(separation, separation));
  impact.normal = separation / distance;
  impact.approachSpeed = -dotInOrder(separation, motion.velocity - other.velocity) / distance;
  impact.effectiveMass = mass * (otherMass / (mass + otherMass));
  impact.change = (1.0 + restitution) * impact.approachSpeed;
  impact.impulse = impact.effectiveMass * impact.change;
  return impact;
}

void Pass::addCollision(const Collision& collision, double change) {
  last_ = collision.time;
  aftermath_ = {collision.first, collision.second, collision.time, Vec3::Zero(), Vec3::Zero()};
  aftermath_.velocity = segment(collision.first).at(collision.time).velocity;
  if (!isSphere(collision.second)) {
    aftermath_.velocity += change * collision.normal;
    return;
  }
  aftermath_.otherVelocity = segment(collision.second).at(collision.time).velocity;
  const double mass = sphere(collision.first).mass;
  const double otherMass = sphere(collision.second).mass;
  aftermath_.velocity += (otherMass / (mass + otherMass) * change) * collision.normal;
  aftermath_.otherVelocity -= (mass / (mass + otherMass) * change) * collision.normal;
}

/// Sets the usual velocities after a rest contact: spheres rebound as fast as they approach, and a
/// sphere does not rebound from a wall.
void Pass::meet(std::uint32_t sphere, std::uint32_t body, const Instant& instant) {
  aftermath_ = {sphere, body, instant, Vec3::Zero(), Vec3::Zero()};
  aftermath_.velocity = segment(sphere).at(instant).velocity;
  const Impact known = impact({.time = instant, .first = sphere, .second = body}, 1.0);
  if (!isSphere(body)) {
    aftermath_.velocity += known.approachSpeed * known.normal;
    return;
  }
  aftermath_.otherVelocity = segment(body).at(instant).velocity;
  const Vec3 velocityChange = known.normal / this->sphere(sphere).mass;
  const Vec3 otherVelocityChange = -known.normal / this->sphere(body).mass;
  const double impulse = (known.approachSpeed + known.approachSpeed) /
                         dotInOrder(known.normal, velocityChange - otherVelocityChange);
  aftermath_.velocity += impulse * velocityChange;
  aftermath_.otherVelocity += impulse * otherVelocityChange;
}

/// One function for each part of a recording, which writes it or reads it, depending on Archive.
template <class Archive>
class Parts {
 public:
  explicit Parts(Archive& archive) : archive_(archive) {}

  void vector(Vec3& value) {
    for (double& component : value)
      archive_.number(component);
    archive_.check(bounded(value), kOutOfRange);
  }
  void vector(Vec3& value, const Vec3& known) {
    for (int axis = 0; axis < 3; ++axis)
      archive_.residual(value[axis], known[axis]);
    archive_.check(bounded(value), kOutOfRange);
  }
  void number(double& value) {
    archive_.number(value);
    archive_.check(bounded(value), kOutOfRange);
  }
  void index(std::uint32_t& value, std::uint64_t size, const char* what) {
    std::uint64_t coded = value;
    archive_.count(coded);
    if (archive_.check(coded < size, what)) value = static_cast<std::uint32_t>(coded);
  }
  void instant(Instant& value, const Instant& known) {
    archive_.residual(value.seconds, known.seconds);
    archive_.number(value.rest);
    archive_.check(sound(value), "an instant is no time from 0 on, with a rest of its rounding");
  }

  void span(double& begin, double& end) {
    number(begin);
    number(end);
    archive_.check(0.0 <= begin && begin <= end, "it ends before it begins, or begins before 0");
  }
  void sphere(RecordedSphere& value, const RecordedSphere* before) {
    const std::uint64_t least = before == nullptr ? 0 : std::uint64_t{before->id} + 1;
    std::uint64_t above = value.id - least;
    archive_.count(above);
    if (archive_.check(above <= kLastId && above + least <= kLastId, kNoId))
      value.id = static_cast<BodyId>(above + least);
    archive_.residual(value.radius, before == nullptr ? 0.0 : before->radius);
    archive_.residual(value.mass, before == nullptr ? 0.0 : before->mass);
    archive_.check(value.radius > 0.0 && bounded(value.radius), "a radius is not above 0");
    archive_.check(value.mass > 0.0 && bounded(value.mass), "a mass is not above 0");
  }
  void firstSegment(Segment& value, double begin) {
    instant(value.since, {begin, 0.0});
    archive_.check(value.since.seconds <= begin, "a sphere moves from after the beginning on");
    vector(value.position);
    vector(value.velocity);
    vector(value.acceleration);
  }
  void wall(Wall& value) {
    index(value.id, std::uint64_t{kLastId} + 1, kNoId);
    vector(value.normal);
    number(value.offset);
    vector(value.velocity);
  }

  void segment(Segment& value, unsigned flags, const Pass& pass, std::uint32_t sphere) {
    if ((flags & kMeets) != 0) {
      value.since = pass.aftermath().time;
    } else if ((flags & kSegmentSameInstant) != 0) {
      value.since = pass.last();
    } else {
      instant(value.since, pass.last());
    }
    const Motion expected = pass.expected(sphere, value.since);
    follow(value.position, expected.position, flags & kPositionFollows);
    follow(value.velocity, expected.velocity, flags & kVelocityFollows);
    follow(value.acceleration, pass.segment(sphere).acceleration, flags & kAccelerationStays);
  }
  void collisionTime(Collision& value, unsigned flags, const Pass& pass) {
    if ((flags & kCollisionSameInstant) != 0) {
      value.time = pass.last();
    } else if ((flags & kInstantFollows) != 0) {
      value.time = pass.contact(value.first, value.second);
    } else {
      instant(value.time, pass.last());
    }
    archive_.check(sound(value.time), "a collision is at no time");
  }
  void impact(Collision& value, const Impact& known) {
    archive_.residual(value.approachSpeed, known.approachSpeed);
    archive_.residual(value.effectiveMass, known.effectiveMass);
    archive_.residual(value.impulse, known.impulse);
    vector(value.normal, known.normal);
  }
  /// Codes how an event differs from `rebuilt`; when it is read, `value` is equal to `rebuilt` at
  /// first.
  void event(ImpulseEvent& value, const ImpulseEvent& rebuilt) {
    std::uint64_t flags = Archive::kReads ? 0 : flagsOf(value, rebuilt);
    archive_.count(flags);
    value.hasAppliedImpulse = (flags & kHasApplied) != 0;
    if ((flags & kIdsFollow) != 0) {
      index(value.body, std::uint64_t{kLastId} + 1, kNoId);
      index(value.other, std::uint64_t{kLastId} + 1, kNoId);
    }
    const std::vector<double> known = numbersOf(rebuilt);
    unsigned field = 0;
    std::size_t at = 0;
    visitFields(value, [&](std::span<double> numbers) {
      const bool given = (flags >> field++ & 1U) != 0;
      for (double& number : numbers) {
        if (given) archive_.residual(number, known[at]);
        ++at;
      }
    });
  }
  void checkEvent(const ImpulseEvent& event, const Instant& instant) {
    archive_.check(same(event.time, instant.seconds), "an event is not at its collision's time");
    ImpulseEvent copy = event;
    for (double* const radius : {&copy.radius, &copy.otherRadius}) {
      archive_.check(*radius >= 0.0, "a radius of curvature is below 0");
      *radius = 0.0;  // the radius may be infinite
    }
    for (const double number : numbersOf(copy))
      archive_.check(bounded(number), kOutOfRange);
    archive_.check(event.approachSpeed >= 0.0 && event.effectiveMass >= 0.0,
                   "an approach speed or effective mass is below 0");
  }

 private:
  static constexpr BodyId kLastId = 0xFFFFFFFF;
  static constexpr const char* kNoId = "an id is out of range; expected at most 4294967295";

  void follow(Vec3& value, const Vec3& known, unsigned follows) {
    if (follows != 0) {
      value = known;
      archive_.check(bounded(value), kOutOfRange);
    } else {
      vector(value, known);
    }
  }
  static std::vector<double> numbersOf(ImpulseEvent event) {
    std::vector<double> all;
    visitFields(event, [&](std::span<const double> numbers) {
      all.insert(all.end(), numbers.begin(), numbers.end());
    });
    return all;
  }
  static std::uint64_t flagsOf(ImpulseEvent event, const ImpulseEvent& rebuilt) {
    std::uint64_t flags = event.hasAppliedImpulse ? kHasApplied : 0;
    if (event.body != rebuilt.body || event.other != rebuilt.other) flags |= kIdsFollow;
    const std::vector<double> known = numbersOf(rebuilt);
    unsigned field = 0;
    std::size_t at = 0;
    visitFields(event, [&](std::span<const double> numbers) {
      for (const double number : numbers) {
        if (!same(number, known[at++])) flags |= std::uint64_t{1} << field;
      }
      ++field;
    });
    return flags;
  }

  Archive& archive_;
};

double firstRestitution(const Recording::World& world) {
  return world.restitutions.empty() ? 1.0 : world.restitutions.front();
}

// ---- Writing

class Encoder {
 public:
  Encoder(const Recording& recording, std::vector<std::byte>& bytes)
      : recording_(recording), archive_(bytes), parts_(archive_), pass_(recording) {}

  /// Writes the recording. Returns why it cannot be written; empty if it could.
  std::string run() {
    world();
    std::uint64_t count = recording_.log().size();
    archive_.count(count);
    std::size_t collision = 0;
    const auto log = recording_.log();
    for (std::size_t record = 0; record < log.size(); ++record) {
      if (log[record] == Recording::kNobody) {
        writeCollision(recording_.collisions()[collision++]);
      } else {
        writeSegment(log[record], record + 1 < log.size() ? log[record + 1] : Recording::kNobody);
      }
    }
    return archive_.fault();
  }

 private:
  void world();
  void writeSegment(std::uint32_t sphere, std::uint32_t next);
  std::uint32_t metBy(std::uint32_t sphere, std::uint32_t next, const Instant& instant) const;
  unsigned flagsOf(const Segment& segment, std::uint32_t sphere) const;
  void writeCollision(Collision collision);
  std::uint32_t restitutionOf(const Collision& collision) const;
  void writeEvents(const Collision& collision);

  const Recording& recording_;
  ByteWriter archive_;
  Parts<ByteWriter> parts_;
  Pass pass_;
};

void Encoder::world() {
  double begin = recording_.begin();
  double end = recording_.end();
  parts_.span(begin, end);
  Recording::World world = recording_.world();
  parts_.vector(world.gravity);
  std::string payload = recording_.payload();
  archive_.text(payload);
  std::uint64_t spheres = world.spheres.size();
  archive_.count(spheres);
  for (std::size_t sphere = 0; sphere < spheres; ++sphere) {
    parts_.sphere(world.spheres[sphere], sphere == 0 ? nullptr : &world.spheres[sphere - 1]);
    Segment segment = recording_.segments(sphere).front();
    parts_.firstSegment(segment, begin);
  }
  std::uint64_t walls = world.walls.size();
  archive_.count(walls);
  for (Wall& wall : world.walls)
    parts_.wall(wall);
  std::uint64_t restitutions = world.restitutions.size();
  archive_.count(restitutions);
  for (double& restitution : world.restitutions)
    parts_.number(restitution);
}

/// Returns the body whose contact with the sphere at `instant` follows from the motions: the sphere
/// of the next record, or a wall; kNobody if it is neither.
std::uint32_t Encoder::metBy(std::uint32_t sphere, std::uint32_t next,
                             const Instant& instant) const {
  const Aftermath& aftermath = pass_.aftermath();
  if (same(instant, aftermath.time) && (sphere == aftermath.first || sphere == aftermath.second))
    return Recording::kNobody;
  if (next != Recording::kNobody && next != sphere && same(pass_.contact(sphere, next), instant))
    return next;
  const auto bodies =
      static_cast<std::uint32_t>(recording_.sphereCount() + recording_.world().walls.size());
  for (auto wall = static_cast<std::uint32_t>(recording_.sphereCount()); wall < bodies; ++wall) {
    if (same(pass_.contact(sphere, wall), instant)) return wall;
  }
  return Recording::kNobody;
}

unsigned Encoder::flagsOf(const Segment& segment, std::uint32_t sphere) const {
  const Motion expected = pass_.expected(sphere, segment.since);
  unsigned flags = 0;
  if (same(segment.since, pass_.last())) flags |= kSegmentSameInstant;
  if (same(segment.position, expected.position)) flags |= kPositionFollows;
  if (same(segment.velocity, expected.velocity)) flags |= kVelocityFollows;
  if (same(segment.acceleration, pass_.segment(sphere).acceleration)) flags |= kAccelerationStays;
  return flags;
}

void Encoder::writeSegment(std::uint32_t sphere, std::uint32_t next) {
  Segment segment = recording_.segments(sphere)[pass_.currentSegment(sphere) + 1];
  std::uint32_t met = metBy(sphere, next, segment.since);
  unsigned flags = 0;
  if (met != Recording::kNobody) {
    flags = kMeets;
    pass_.meet(sphere, met, segment.since);
  } else if (sphere == pass_.aftermath().first) {
    flags = kOfFirst;
  } else if (sphere == pass_.aftermath().second) {
    flags = kOfSecond;
  }
  flags |= flagsOf(segment, sphere);
  archive_.byte(flags);
  std::uint32_t body = sphere;
  if ((flags & (kOfFirst | kOfSecond)) == 0) parts_.index(body, recording_.sphereCount(), "");
  if ((flags & kMeets) != 0) parts_.index(met, Recording::kNobody, "");
  parts_.segment(segment, flags, pass_, sphere);
  pass_.addSegment(sphere, segment.since);
}

/// Index of the restitution with which the impact follows from the states; the number of all
/// restitutions if there is none.
std::uint32_t Encoder::restitutionOf(const Collision& collision) const {
  const std::vector<double>& all = recording_.world().restitutions;
  const auto found = std::ranges::find_if(all, [&](double restitution) {
    return pass_.impact(collision, restitution).sameAs(collision);
  });
  return static_cast<std::uint32_t>(found - all.begin());
}

void Encoder::writeCollision(Collision collision) {
  const std::vector<double>& restitutions = recording_.world().restitutions;
  std::uint32_t restitution = restitutionOf(collision);
  unsigned flags = kIsCollision;
  if (same(collision.time, pass_.last())) flags |= kCollisionSameInstant;
  if (same(collision.time, pass_.contact(collision.first, collision.second)))
    flags |= kInstantFollows;
  if (restitution < restitutions.size()) flags |= kImpactFollows;
  if (collision.exception == Recording::kNobody) flags |= kRebuilt;
  archive_.byte(flags);
  parts_.index(collision.first, recording_.sphereCount(), "");
  std::uint32_t second = collision.second + 1;  // kNobody becomes 0
  parts_.index(second, Recording::kNobody, "");
  parts_.collisionTime(collision, flags, pass_);
  double change = collision.impulse / collision.effectiveMass;
  if ((flags & kImpactFollows) != 0) {
    parts_.index(restitution, restitutions.size(), "");
    change = pass_.impact(collision, restitutions[restitution]).change;
  } else {
    parts_.impact(collision, pass_.impact(collision, firstRestitution(recording_.world())));
  }
  writeEvents(collision);
  pass_.addCollision(collision, change);
}

void Encoder::writeEvents(const Collision& collision) {
  const Events rebuilt = recording_.rebuilt(collision);
  if (collision.exception == Recording::kNobody) {
    for (const ImpulseEvent& event : rebuilt)
      parts_.checkEvent(event, collision.time);
    return;
  }
  Events events = recording_.exceptions()[collision.exception];
  for (std::size_t share = 0; share < events.size(); ++share) {
    parts_.event(events[share], rebuilt[share]);
    parts_.checkEvent(events[share], collision.time);
  }
}

// ---- Reading

class Decoder {
 public:
  explicit Decoder(std::span<const std::byte> bytes) : archive_(bytes), parts_(archive_) {}

  Result<Recording> run(std::string_view name);

 private:
  void world();
  void readRecords();
  void readSegment(unsigned flags, Pass& pass);
  void readMeeting(std::uint32_t sphere, Pass& pass);
  void readCollision(unsigned flags, Pass& pass);
  std::uint32_t readSecond(std::uint32_t first);
  double readImpact(Collision& collision, unsigned flags, const Pass& pass);
  void readEvents(const Collision& collision, unsigned flags);
  void checkTime(const Instant& instant, const Pass& pass);

  ByteReader archive_;
  Parts<ByteReader> parts_;
  Recording recording_;
};

Result<Recording> Decoder::run(std::string_view name) {
  world();
  if (!archive_.failed()) readRecords();
  archive_.check(archive_.atEnd(), "there is more after the last record");
  if (!archive_.failed()) return std::move(recording_);
  return Error{std::string(name) + ": byte " + std::to_string(kHeaderSize + archive_.faultAt()) +
               ": " + archive_.fault()};
}

void Decoder::world() {
  double begin = 0.0;
  double end = 0.0;
  parts_.span(begin, end);
  Recording::World world;
  parts_.vector(world.gravity);
  std::string payload;
  archive_.text(payload);
  std::uint64_t spheres = 0;
  archive_.count(spheres);
  std::vector<Segment> segments;
  for (std::uint64_t sphere = 0; sphere < spheres && !archive_.failed(); ++sphere) {
    RecordedSphere next;
    parts_.sphere(next, world.spheres.empty() ? nullptr : &world.spheres.back());
    world.spheres.push_back(next);
    parts_.firstSegment(segments.emplace_back(), begin);
  }
  std::uint64_t walls = 0;
  archive_.count(walls);
  for (std::uint64_t wall = 0; wall < walls && !archive_.failed(); ++wall)
    parts_.wall(world.walls.emplace_back());
  std::uint64_t restitutions = 0;
  archive_.count(restitutions);
  for (std::uint64_t number = 0; number < restitutions && !archive_.failed(); ++number)
    parts_.number(world.restitutions.emplace_back());
  recording_ = Recording(std::move(world), begin, segments);
  recording_.setPayload(std::move(payload));
  recording_.extendTo(end);
}

void Decoder::readRecords() {
  Pass pass(recording_);
  std::uint64_t records = 0;
  archive_.count(records);
  for (std::uint64_t record = 0; record < records && !archive_.failed(); ++record) {
    unsigned flags = 0;
    archive_.byte(flags);
    if ((flags & kIsCollision) != 0) {
      readCollision(flags, pass);
    } else {
      readSegment(flags, pass);
    }
  }
}

void Decoder::checkTime(const Instant& instant, const Pass& pass) {
  archive_.check(!(instant < pass.last()), "an instant is before the one of the record before");
  archive_.check(instant.seconds <= recording_.end(), "an instant is after the end");
}

void Decoder::readSegment(unsigned flags, Pass& pass) {
  const unsigned whose = flags & (kOfFirst | kOfSecond);
  archive_.check((flags & ~kSegmentFlags) == 0 && whose != (kOfFirst | kOfSecond) &&
                     (whose == 0 || (flags & kMeets) == 0),
                 "a segment has flags that mean nothing");
  std::uint32_t sphere = whose == kOfFirst ? pass.aftermath().first : pass.aftermath().second;
  if (whose == 0)
    parts_.index(sphere, recording_.sphereCount(), "a segment is of no sphere that is known");
  if (!archive_.check(pass.isSphere(sphere), "a segment is of no sphere")) return;
  if ((flags & kMeets) != 0) readMeeting(sphere, pass);
  if (archive_.failed()) return;
  Segment segment;
  parts_.segment(segment, flags, pass, sphere);
  checkTime(segment.since, pass);
  if (archive_.failed()) return;
  recording_.addSegment(sphere, segment);
  pass.addSegment(sphere, segment.since);
}

void Decoder::readMeeting(std::uint32_t sphere, Pass& pass) {
  std::uint32_t body = 0;
  const std::size_t bodies = recording_.sphereCount() + recording_.world().walls.size();
  parts_.index(body, bodies, "a sphere meets no body that is known");
  archive_.check(body != sphere, "a sphere meets itself");
  if (archive_.failed()) return;
  const Instant instant = pass.contact(sphere, body);
  archive_.check(sound(instant), "a sphere meets a body at no time");
  checkTime(instant, pass);
  if (!archive_.failed()) pass.meet(sphere, body, instant);
}

std::uint32_t Decoder::readSecond(std::uint32_t first) {
  std::uint32_t second = 0;
  const std::size_t bodies = recording_.sphereCount() + recording_.world().walls.size();
  parts_.index(second, bodies + 1, "a collision is with no body that is known");
  archive_.check(second != first + 1, "a sphere collides with itself");
  return second - 1;  // 0 becomes kNobody
}

void Decoder::readCollision(unsigned flags, Pass& pass) {
  archive_.check((flags & ~kCollisionFlags) == 0, "a collision has flags that mean nothing");
  Collision collision;
  parts_.index(collision.first, recording_.sphereCount(), "a collision is of no sphere");
  collision.second = readSecond(collision.first);
  if (archive_.failed()) return;
  parts_.collisionTime(collision, flags, pass);
  checkTime(collision.time, pass);
  if (archive_.failed()) return;
  const double change = readImpact(collision, flags, pass);
  if (archive_.failed()) return;
  collision.firstSegment = pass.currentSegment(collision.first);
  if (pass.isSphere(collision.second))
    collision.secondSegment = pass.currentSegment(collision.second);
  readEvents(collision, flags);
  pass.addCollision(collision, change);
}

/// Returns the change of velocity along the normal, m/s.
double Decoder::readImpact(Collision& collision, unsigned flags, const Pass& pass) {
  const std::vector<double>& restitutions = recording_.world().restitutions;
  if ((flags & kImpactFollows) == 0) {
    parts_.impact(collision, pass.impact(collision, firstRestitution(recording_.world())));
    return collision.impulse / collision.effectiveMass;
  }
  std::uint32_t restitution = 0;
  parts_.index(restitution, restitutions.size(),
               "a collision is with no restitution that is known");
  if (archive_.failed()) return 0.0;
  const Impact impact = pass.impact(collision, restitutions[restitution]);
  collision.normal = impact.normal;
  collision.approachSpeed = impact.approachSpeed;
  collision.effectiveMass = impact.effectiveMass;
  collision.impulse = impact.impulse;
  return impact.change;
}

void Decoder::readEvents(const Collision& collision, unsigned flags) {
  Events events = recording_.rebuilt(collision);
  const bool plain = (flags & kRebuilt) != 0;
  archive_.check(!plain || collision.second != Recording::kNobody,
                 "a collision is with nobody; expected what its events say of the other body");
  if (!plain) {
    const Events rebuilt = events;
    for (std::size_t share = 0; share < events.size(); ++share)
      parts_.event(events[share], rebuilt[share]);
  }
  for (const ImpulseEvent& event : events)
    parts_.checkEvent(event, collision.time);
  if (!archive_.failed()) recording_.addCollision(collision, plain ? nullptr : &events);
}

void appendFixed(std::vector<std::byte>& bytes, std::uint64_t value, unsigned size) {
  ByteWriter(bytes).fixed(value, size);
}

}  // namespace

std::uint64_t recordingChecksum(std::span<const std::byte> bytes) {
  std::uint64_t hash = 0xCBF29CE484222325ULL;  // FNV-1a
  for (const std::byte byte : bytes)
    hash = (hash ^ std::to_integer<std::uint64_t>(byte)) * 0x100000001B3ULL;
  return hash;
}

bool looksLikeRecording(std::span<const std::byte> bytes) {
  return bytes.size() >= kRecordingMagic.size() &&
         std::equal(kRecordingMagic.begin(), kRecordingMagic.end(), bytes.begin(),
                    [](char letter, std::byte byte) {
                      return static_cast<unsigned char>(letter) ==
                             std::to_integer<unsigned char>(byte);
                    });
}

Result<std::vector<std::byte>> encoded(const Recording& recording) {
  std::vector<std::byte> bytes;
  for (const char letter : kRecordingMagic)
    bytes.push_back(static_cast<std::byte>(letter));
  appendFixed(bytes, kRecordingVersion, sizeof kRecordingVersion);
  const std::string fault = Encoder(recording, bytes).run();
  if (!fault.empty()) return Error{"the run cannot be recorded: " + fault};
  appendFixed(bytes, recordingChecksum(bytes), kChecksumSize);
  return bytes;
}

Result<Recording> decoded(std::span<const std::byte> bytes, std::string_view name) {
  const auto refuse = [name](const std::string& why) {
    return Error{std::string(name) + ": " + why};
  };
  if (!looksLikeRecording(bytes))
    return refuse("is no recording; expected a file that 'carom record' has written");
  if (bytes.size() < kHeaderSize + kChecksumSize)
    return refuse("ends after " + std::to_string(bytes.size()) +
                  " bytes; expected a whole recording");
  const auto content = bytes.subspan(0, bytes.size() - kChecksumSize);
  ByteReader version(content.subspan(kRecordingMagic.size()));
  const std::uint64_t number = version.fixed(sizeof kRecordingVersion);
  if (number != kRecordingVersion) {
    return refuse("is a recording of version " + std::to_string(number) + "; expected version " +
                  std::to_string(kRecordingVersion));
  }
  if (ByteReader(bytes.last(kChecksumSize)).fixed(kChecksumSize) != recordingChecksum(content))
    return refuse(
        "is damaged or cut off: its checksum does not fit; expected it as it was written");
  return Decoder(content.subspan(kHeaderSize)).run(name);
}

}  // namespace carom
