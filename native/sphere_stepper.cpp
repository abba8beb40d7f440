#include "native/sphere_stepper.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <sstream>
#include <utility>

#include "native/contact_queue.h"
#include "native/contact_time.h"
#include "native/instant.h"
#include "native/world_check.h"

namespace carom {
namespace {

// These four define resting and are documented in SphereStepper.
constexpr double kHopTime = 0.5e-3;           ///< s, from a resting hop's start to its end, at most
constexpr double kCollapseInterval = 1e-6;    ///< s, contacts of one sphere closer than this ...
constexpr std::uint32_t kCollapseRun = 1000;  ///< ... so many times in a row are a collapse
constexpr double kCollapseRestSpeed = 0.001;  ///< m/s, rest speed of a sphere after a collapse

constexpr double kLeastRebound = 1e-15;  ///< of the speed: what its rounding cannot swallow
constexpr double kLevel = 1e-15;         ///< of gravity: below it a plane is parallel to gravity

constexpr double kOverlapTolerance = 1e-8;    ///< of the smaller radius, for validate()
constexpr double kRoundingTolerance = 1e-12;  ///< of the coordinates, for validate()

constexpr std::uint32_t kNobody = 0xFFFFFFFF;

/// A parabola: where a sphere was at its last contact, from which its present follows.
struct Motion {
  Vec3 position = Vec3::Zero();  ///< m, world frame, at `since`
  Vec3 velocity = Vec3::Zero();  ///< m/s, world frame, at `since`
  Instant since;
};

/// What a sphere is, and how it rests.
struct Body {
  BodyId id = 0;
  double mass = 0.0;         ///< kg
  double restitution = 0.0;  ///< 1
  SurfaceId surface = 0;
  double restSpeed = 0.0;           ///< m/s, its own, raised by a collapse
  double hopAllowance = 0.0;        ///< J/kg, taken by planes, which a resting hop may give back
  std::uint32_t rapidContacts = 0;  ///< in a row, kCollapseInterval apart or less
};

/// A plane, and the part of gravity along its normal.
struct Wall {
  Plane plane;
  double acceleration = 0.0;  ///< m/s^2, negative: pulls spheres towards the plane
};

/// What a sphere meets next. Its time is in the queue.
struct Contact {
  std::uint32_t partner = kNobody;    ///< a sphere, or the number of spheres + a wall
  std::uint32_t partnerContacts = 0;  ///< how many the partner had had when this was predicted
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

ImpulseEvent shareOf(const Side& body, const Side& other, const Impact& impact, double sign,
                     const Vec3& point, double time) {
  ImpulseEvent event;
  event.time = time;
  event.body = body.id;
  event.other = other.id;
  event.impulse = (sign * impact.impulse) * impact.normal;
  event.position = point;
  event.normal = sign * impact.normal;
  event.approachSpeed = impact.approachSpeed;
  event.effectiveMass = impact.effectiveMass;
  event.radius = body.radius;
  event.otherRadius = other.radius;
  event.bodyPosition = body.position;
  event.bodyVelocity = body.velocity;
  return event;
}

bool fail(std::string* why, const std::string& text) {
  if (why != nullptr) *why = text;
  return false;
}

}  // namespace

class SphereStepper::Simulation {
 public:
  explicit Simulation(const SphereWorld& world);

  void advanceTo(double time);

  const std::vector<ImpulseEvent>& events() const { return events_; }
  double time() const { return time_; }
  std::size_t sphereCount() const { return motions_.size(); }
  const SphereStepperCounters& counters() const { return counters_; }
  Motion motionAt(std::size_t sphere, const Instant& instant) const;
  Motion motionAtTime(std::size_t sphere) const { return motionAt(sphere, {time_, 0.0}); }
  double kineticEnergy() const;
  double potentialEnergy() const;
  bool validate(std::string* why) const;

 private:
  void addSphere(const Sphere& sphere);
  double hopSpeed(const Body& body, const Wall& wall) const;
  void grantFirstHop(std::size_t sphere);

  void predict(std::size_t sphere);
  void lookForWalls(const Motion& motion, double radius, double& soonest, Contact& contact) const;
  void lookForSpheres(std::size_t sphere, const Motion& motion, double& soonest,
                      Contact& contact) const;
  double contactTime(const Motion& motion, double radius, std::size_t other) const;
  BodyId idOf(const Contact& contact) const;

  void step();
  void meetSphere(std::size_t sphere, std::size_t other);
  void collide(std::size_t sphere, Motion motion, std::size_t other, Motion otherMotion,
               const Vec3& normal, double approachSpeed);
  void meetWall(std::size_t sphere, const Wall& wall);
  void bounce(std::size_t sphere, Motion motion, const Wall& wall, double approachSpeed);
  void noteContact(std::size_t sphere);
  double restingRebound(Body& body, const Wall& wall, double approachSpeed) const;
  double damp(Body& body, const Wall& wall, double approachSpeed) const;
  void leave(std::size_t sphere, const Motion& motion);
  void report(const Side& first, const Side& second, const Impact& impact);

  bool validateSphere(std::size_t sphere, std::string* why) const;
  bool validateApart(std::size_t sphere, std::string* why) const;

  Vec3 gravity_;
  RestitutionTable restitutions_;
  std::vector<Motion> motions_;  ///< this and the next four by sphere
  std::vector<double> radii_;    ///< m; with the motions all that a prediction reads
  std::vector<Body> bodies_;
  std::vector<Contact> contacts_;
  std::vector<std::uint32_t> contactCounts_;  ///< may wrap round: only compared for equality
  std::vector<Wall> walls_;
  ContactQueue queue_;
  Instant now_;        ///< of the contact at hand
  double time_ = 0.0;  ///< s, where advanceTo stopped
  std::vector<ImpulseEvent> events_;
  SphereStepperCounters counters_;
};

namespace {

std::vector<BodyId> idsOf(const std::vector<Sphere>& spheres) {
  std::vector<BodyId> ids;
  ids.reserve(spheres.size());
  for (const Sphere& sphere : spheres)
    ids.push_back(sphere.id);
  return ids;
}

}  // namespace

SphereStepper::Simulation::Simulation(const SphereWorld& world)
    : gravity_(world.gravity), restitutions_(world.restitutions), queue_(idsOf(world.spheres)) {
  const double level = kLevel * std::sqrt(dotInOrder(gravity_, gravity_));
  for (const Plane& plane : world.planes) {
    const double acceleration = dotInOrder(plane.normal, gravity_);
    walls_.push_back({plane, std::abs(acceleration) > level ? acceleration : 0.0});
  }
  for (const Sphere& sphere : world.spheres) {
    addSphere(sphere);
    bodies_.back().restSpeed = world.restSpeed;
  }
  for (std::size_t sphere = 0; sphere < sphereCount(); ++sphere)
    grantFirstHop(sphere);
  for (std::size_t sphere = 0; sphere < sphereCount(); ++sphere)
    predict(sphere);
}

void SphereStepper::Simulation::addSphere(const Sphere& sphere) {
  Body body;
  body.id = sphere.id;
  body.mass = sphere.mass;
  body.restitution = sphere.restitution;
  body.surface = sphere.surface;
  bodies_.push_back(body);
  motions_.push_back({sphere.position, sphere.velocity, Instant{}});
  radii_.push_back(sphere.radius);
  contacts_.emplace_back();
  contactCounts_.push_back(0);
}

Motion SphereStepper::Simulation::motionAt(std::size_t sphere, const Instant& instant) const {
  const Motion& motion = motions_[sphere];
  const double flight = elapsed(motion.since, instant);
  const Vec3 gained = flight * gravity_;
  return {motion.position + flight * (motion.velocity + 0.5 * gained), motion.velocity + gained,
          instant};
}

// ---- Prediction

BodyId SphereStepper::Simulation::idOf(const Contact& contact) const {
  const std::size_t count = sphereCount();
  if (contact.partner == kNobody) return kNobody;
  return contact.partner < count ? bodies_[contact.partner].id
                                 : walls_[contact.partner - count].plane.id;
}

void SphereStepper::Simulation::lookForWalls(const Motion& motion, double radius, double& soonest,
                                             Contact& contact) const {
  for (std::size_t index = 0; index < walls_.size(); ++index) {
    const Wall& wall = walls_[index];
    const double height = dotInOrder(wall.plane.normal, motion.position) - wall.plane.offset;
    const double wait = planeContactTime(
        height - radius, dotInOrder(wall.plane.normal, motion.velocity), wall.acceleration);
    if (wait > soonest || wait == kNever) continue;
    if (wait == soonest && wall.plane.id > idOf(contact)) continue;
    soonest = wait;
    contact = {static_cast<std::uint32_t>(sphereCount() + index), 0};
  }
}

double SphereStepper::Simulation::contactTime(const Motion& motion, double radius,
                                              std::size_t other) const {
  const Motion& base = motions_[other];
  const double flight = elapsed(base.since, motion.since);
  const Vec3 gained = flight * gravity_;
  const Vec3 separation =
      motion.position - (base.position + flight * (base.velocity + 0.5 * gained));
  const Vec3 velocity = motion.velocity - (base.velocity + gained);
  return sphereContactTime(separation, velocity, radius + radii_[other]);
}

void SphereStepper::Simulation::lookForSpheres(std::size_t sphere, const Motion& motion,
                                               double& soonest, Contact& contact) const {
  const double radius = radii_[sphere];
  for (std::size_t other = 0; other < sphereCount(); ++other) {
    if (other == sphere) continue;
    const double wait = contactTime(motion, radius, other);
    if (wait > soonest || wait == kNever) continue;
    // A partner that is due earlier looks for this sphere itself after that contact.
    if (!(wait < elapsed(motion.since, queue_.time(other)))) continue;
    if (wait == soonest && bodies_[other].id > idOf(contact)) continue;
    soonest = wait;
    contact = {static_cast<std::uint32_t>(other), contactCounts_[other]};
  }
}

/// Finds the sphere's next contact from now_ on. The partner is told, because it is the partner's
/// next contact too: so that others do not reckon with it any longer.
void SphereStepper::Simulation::predict(std::size_t sphere) {
  const Motion motion = motionAt(sphere, now_);
  double soonest = kNever;
  Contact contact;
  lookForWalls(motion, radii_[sphere], soonest, contact);
  lookForSpheres(sphere, motion, soonest, contact);
  const Instant due = after(now_, soonest);
  contacts_[sphere] = contact;
  queue_.setTime(sphere, due);
  if (contact.partner < sphereCount()) {
    contacts_[contact.partner] = {static_cast<std::uint32_t>(sphere), contactCounts_[sphere]};
    queue_.setTime(contact.partner, due);
  }
}

// ---- Contacts

void SphereStepper::Simulation::advanceTo(double time) {
  events_.clear();
  while (!queue_.empty() && queue_.time(queue_.earliest()).seconds <= time)
    step();
  time_ = time;
}

void SphereStepper::Simulation::step() {
  const std::size_t sphere = queue_.earliest();
  const Contact contact = contacts_[sphere];
  now_ = queue_.time(sphere);
  if (contact.partner >= sphereCount()) {
    meetWall(sphere, walls_[contact.partner - sphereCount()]);
  } else if (contact.partnerContacts == contactCounts_[contact.partner]) {
    const bool inOrder = bodies_[sphere].id < bodies_[contact.partner].id;
    meetSphere(inOrder ? sphere : contact.partner, inOrder ? contact.partner : sphere);
  } else {
    ++counters_.staleContacts;
    predict(sphere);
  }
}

void SphereStepper::Simulation::meetSphere(std::size_t sphere, std::size_t other) {
  const Motion motion = motionAt(sphere, now_);
  const Motion otherMotion = motionAt(other, now_);
  const Vec3 separation = motion.position - otherMotion.position;
  const double closing = -dotInOrder(separation, motion.velocity - otherMotion.velocity);
  if (closing > 0.0) {  // otherwise a pass so close that rounding decided
    noteContact(sphere);
    noteContact(other);
    const double distance = std::sqrt(dotInOrder(separation, separation));
    collide(sphere, motion, other, otherMotion, separation / distance, closing / distance);
  }
  predict(sphere);
  predict(other);
}

void SphereStepper::Simulation::collide(std::size_t sphere, Motion motion, std::size_t other,
                                        Motion otherMotion, const Vec3& normal,
                                        double approachSpeed) {
  const Body& body = bodies_[sphere];
  const Body& otherBody = bodies_[other];
  const bool resting = approachSpeed < std::max(body.restSpeed, otherBody.restSpeed);
  const double restitution = resting ? 1.0
                                     : restitutions_.of(body.surface, body.restitution,
                                                        otherBody.surface, otherBody.restitution);
  // The share of each in the change of velocity, so that equal masses swap theirs exactly.
  const double share = otherBody.mass / (body.mass + otherBody.mass);
  const double otherShare = body.mass / (body.mass + otherBody.mass);
  double change = (1.0 + restitution) * approachSpeed;
  if (resting) {  // it must part, or rounding finds the same contact again at the same instant
    const double speed = std::sqrt(dotInOrder(motion.velocity, motion.velocity)) +
                         std::sqrt(dotInOrder(otherMotion.velocity, otherMotion.velocity));
    change = std::max(change, approachSpeed + kLeastRebound * speed);
  }
  const double mass = body.mass * share;
  const Impact impact{normal, approachSpeed, mass, mass * change};
  if (resting) {
    ++counters_.restContacts;
  } else {
    report({body.id, radii_[sphere], motion.position, motion.velocity},
           {otherBody.id, radii_[other], otherMotion.position, otherMotion.velocity}, impact);
  }
  motion.velocity += (share * change) * normal;
  otherMotion.velocity -= (otherShare * change) * normal;
  leave(sphere, motion);
  leave(other, otherMotion);
}

void SphereStepper::Simulation::meetWall(std::size_t sphere, const Wall& wall) {
  const Motion motion = motionAt(sphere, now_);
  const double approachSpeed = -dotInOrder(wall.plane.normal, motion.velocity);
  // Where rounding has turned the last of a slow approach round, gravity still presses.
  if (approachSpeed >= 0.0 || wall.acceleration < 0.0) {
    noteContact(sphere);
    bounce(sphere, motion, wall, std::max(approachSpeed, 0.0));
  }
  predict(sphere);
}

void SphereStepper::Simulation::bounce(std::size_t sphere, Motion motion, const Wall& wall,
                                       double approachSpeed) {
  Body& body = bodies_[sphere];
  const Vec3& normal = wall.plane.normal;
  double rebound = 0.0;
  if (approachSpeed > 0.0 && approachSpeed >= body.restSpeed) {
    rebound = damp(body, wall, approachSpeed);
    const double impulse = body.mass * (approachSpeed + rebound);
    report({body.id, radii_[sphere], motion.position, motion.velocity},
           {wall.plane.id, kNever, motion.position - radii_[sphere] * normal, Vec3::Zero()},
           {normal, approachSpeed, body.mass, impulse});
  } else {
    ++counters_.restContacts;
    rebound = restingRebound(body, wall, approachSpeed);
    if (wall.acceleration < 0.0) {  // the next contact must be later, not at once
      const double speed = std::sqrt(dotInOrder(motion.velocity, motion.velocity));
      rebound = std::max(rebound, kLeastRebound * speed);
    }
  }
  motion.velocity += (approachSpeed + rebound) * normal;
  leave(sphere, motion);
}

/// Takes the sphere from now_ on along a new parabola; what others predicted with it is outdated.
void SphereStepper::Simulation::leave(std::size_t sphere, const Motion& motion) {
  motions_[sphere] = motion;
  ++contactCounts_[sphere];
  queue_.setTime(sphere, Instant::never());
}

void SphereStepper::Simulation::report(const Side& first, const Side& second,
                                       const Impact& impact) {
  ++counters_.collisions;
  const Vec3 point = first.position - first.radius * impact.normal;
  events_.push_back(shareOf(first, second, impact, 1.0, point, now_.seconds));
  events_.push_back(shareOf(second, first, impact, -1.0, point, now_.seconds));
}

// ---- Rest

double SphereStepper::Simulation::hopSpeed(const Body& body, const Wall& wall) const {
  return std::min(0.5 * body.restSpeed, 0.5 * kHopTime * -wall.acceleration);
}

/// A sphere that starts on a plane with less normal energy than a hop has may hop once.
void SphereStepper::Simulation::grantFirstHop(std::size_t sphere) {
  Body& body = bodies_[sphere];
  const Motion& motion = motions_[sphere];
  for (const Wall& wall : walls_) {
    if (!(wall.acceleration < 0.0)) continue;
    const double height =
        dotInOrder(wall.plane.normal, motion.position) - wall.plane.offset - radii_[sphere];
    const double speed = dotInOrder(wall.plane.normal, motion.velocity);
    const double hop = hopSpeed(body, wall);
    const double hopEnergy = 0.5 * hop * hop;
    const bool resting = 0.5 * speed * speed - wall.acceleration * height < hopEnergy;
    if (resting) body.hopAllowance = std::max(body.hopAllowance, hopEnergy);
  }
}

/// Watches for collapse; see SphereStepper.
void SphereStepper::Simulation::noteContact(std::size_t sphere) {
  Body& body = bodies_[sphere];
  const bool rapid = elapsed(motions_[sphere].since, now_) < kCollapseInterval;
  body.rapidContacts = rapid ? body.rapidContacts + 1 : 0;
  if (body.rapidContacts != kCollapseRun) return;
  ++counters_.collapses;
  body.restSpeed = std::max(body.restSpeed, kCollapseRestSpeed);
  body.hopAllowance = 0.125 * body.restSpeed * body.restSpeed;
  body.rapidContacts = 0;
}

/// Rebound speed of a reported contact; the plane owes the sphere a hop when it took that much.
double SphereStepper::Simulation::damp(Body& body, const Wall& wall, double approachSpeed) const {
  const double restitution =
      restitutions_.of(body.surface, body.restitution, wall.plane.surface, wall.plane.restitution);
  const double rebound = restitution * approachSpeed;
  const double taken = 0.5 * (approachSpeed - rebound) * (approachSpeed + rebound);
  const double highestHop = 0.125 * body.restSpeed * body.restSpeed;
  body.hopAllowance = std::min(body.hopAllowance + taken, highestHop);
  return rebound;
}

/// Rebound speed of an unreported contact.
double SphereStepper::Simulation::restingRebound(Body& body, const Wall& wall,
                                                 double approachSpeed) const {
  const double hop = hopSpeed(body, wall);
  if (approachSpeed >= hop) return approachSpeed;
  const double given = 0.5 * (hop - approachSpeed) * (hop + approachSpeed);
  if (given > body.hopAllowance) return approachSpeed;
  body.hopAllowance -= given;
  return hop;
}

// ---- Inspection

double SphereStepper::Simulation::kineticEnergy() const {
  double energy = 0.0;
  for (std::size_t sphere = 0; sphere < sphereCount(); ++sphere) {
    const Vec3 velocity = motionAtTime(sphere).velocity;
    energy += 0.5 * bodies_[sphere].mass * dotInOrder(velocity, velocity);
  }
  return energy;
}

double SphereStepper::Simulation::potentialEnergy() const {
  double energy = 0.0;
  for (std::size_t sphere = 0; sphere < sphereCount(); ++sphere) {
    energy -= bodies_[sphere].mass * dotInOrder(gravity_, motionAtTime(sphere).position);
  }
  return energy;
}

bool SphereStepper::Simulation::validate(std::string* why) const {
  if (!queue_.valid()) return fail(why, "the contact queue is out of order");
  for (std::size_t sphere = 0; sphere < sphereCount(); ++sphere) {
    if (!validateSphere(sphere, why) || !validateApart(sphere, why)) return false;
  }
  return true;
}

bool SphereStepper::Simulation::validateSphere(std::size_t sphere, std::string* why) const {
  const std::string name = "sphere " + std::to_string(bodies_[sphere].id);
  const Motion& motion = motions_[sphere];
  if (!motion.position.allFinite() || !motion.velocity.allFinite()) {
    return fail(why, name + ": position or velocity is not finite");
  }
  const Instant& due = queue_.time(sphere);
  if (due < motion.since) return fail(why, name + ": next contact is before its last");
  if (due.seconds <= time_ && time_ > 0.0) return fail(why, name + ": a contact is overdue");
  const bool partner = contacts_[sphere].partner < sphereCount() + walls_.size();
  if (partner == (due == Instant::never())) {
    return fail(why, name + ": partner and time of the next contact disagree");
  }
  return true;
}

bool SphereStepper::Simulation::validateApart(std::size_t sphere, std::string* why) const {
  const std::string name = "sphere " + std::to_string(bodies_[sphere].id);
  const Vec3 position = motionAtTime(sphere).position;
  const double rounding = kRoundingTolerance * position.cwiseAbs().maxCoeff();
  for (std::size_t other = sphere + 1; other < sphereCount(); ++other) {
    const double distance = (position - motionAtTime(other).position).norm();
    const double allowed = kOverlapTolerance * std::min(radii_[sphere], radii_[other]) + rounding;
    if (distance + allowed < radii_[sphere] + radii_[other]) {
      return fail(why, name + ": overlaps sphere " + std::to_string(bodies_[other].id));
    }
  }
  for (const Wall& wall : walls_) {
    const double height = dotInOrder(wall.plane.normal, position) - wall.plane.offset;
    const double allowed = kOverlapTolerance * radii_[sphere] + rounding;
    if (height + allowed < radii_[sphere]) {
      return fail(why, name + ": overlaps plane " + std::to_string(wall.plane.id));
    }
  }
  return true;
}

// ---- Public face

Result<SphereStepper> SphereStepper::create(SphereWorld world) {
  Result<SphereWorld> checked = checkedWorld(std::move(world));
  if (!checked) return checked.error();
  return SphereStepper(std::make_unique<Simulation>(*checked));
}

SphereStepper::SphereStepper(std::unique_ptr<Simulation> simulation)
    : simulation_(std::move(simulation)) {}
SphereStepper::SphereStepper(SphereStepper&& other) noexcept = default;
SphereStepper& SphereStepper::operator=(SphereStepper&& other) noexcept = default;
SphereStepper::~SphereStepper() = default;

std::span<const ImpulseEvent> SphereStepper::advanceTo(double time) {
  const bool ahead = std::isfinite(time) && time >= simulation_->time();
  assert(ahead && "SphereStepper::advanceTo: time must be finite and not before time()");
  if (!ahead) return {};
  simulation_->advanceTo(time);
  return simulation_->events();
}

double SphereStepper::time() const {
  return simulation_->time();
}

std::size_t SphereStepper::sphereCount() const {
  return simulation_->sphereCount();
}

SphereState SphereStepper::state(std::size_t sphere) const {
  assert(sphere < simulation_->sphereCount());
  const Motion motion = simulation_->motionAtTime(sphere);
  return {motion.position, motion.velocity};
}

const SphereStepperCounters& SphereStepper::counters() const {
  return simulation_->counters();
}

double SphereStepper::kineticEnergy() const {
  return simulation_->kineticEnergy();
}

double SphereStepper::potentialEnergy() const {
  return simulation_->potentialEnergy();
}

bool SphereStepper::validate(std::string* why) const {
  return simulation_->validate(why);
}

}  // namespace carom
