#include "native/sphere_stepper.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>
#include <sstream>
#include <utility>

#include "native/agenda.h"
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

/// What a sphere is but for its size, and how it rests.
struct Substance {
  double mass = 0.0;         ///< kg
  double restitution = 0.0;  ///< 1
  SurfaceId surface = 0;
  double restSpeed = 0.0;           ///< m/s, its own, raised by a collapse
  double hopAllowance = 0.0;        ///< J/kg, taken by planes, which a resting hop may give back
  std::uint32_t rapidContacts = 0;  ///< in a row, kCollapseInterval apart or less
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
  std::size_t sphereCount() const { return bodies_.count(); }
  const SphereStepperCounters& counters() const { return counters_; }
  /// At time(), by position in SphereWorld::spheres.
  Motion motionOf(std::size_t listed) const { return motionAtTime(order_[listed]); }
  double kineticEnergy() const;
  double potentialEnergy() const;
  bool validate(std::string* why) const;

 private:
  Motion motionAtTime(std::size_t sphere) const { return bodies_.at(sphere, {time_, 0.0}); }
  double hopSpeed(const Substance& body, const Wall& wall) const;
  void grantFirstHop(std::size_t sphere);

  void step();
  void meetSphere(std::uint32_t sphere, std::uint32_t other);
  void collide(std::uint32_t sphere, Motion motion, std::uint32_t other, Motion otherMotion,
               const Vec3& normal, double approachSpeed);
  void meetWall(std::uint32_t sphere, const Wall& wall);
  void bounce(std::uint32_t sphere, Motion motion, const Wall& wall, double approachSpeed);
  void noteContact(std::uint32_t sphere);
  double restingRebound(Substance& body, const Wall& wall, double approachSpeed) const;
  double damp(Substance& body, const Wall& wall, double approachSpeed) const;
  void leave(std::uint32_t sphere, const Motion& motion);
  void report(const Side& first, const Side& second, const Impact& impact);

  bool validateSphere(std::size_t sphere, std::string* why) const;
  bool validateApart(std::size_t sphere, std::string* why) const;

  RestitutionTable restitutions_;
  std::vector<std::uint32_t> order_;  ///< by position in SphereWorld::spheres: which sphere it is
  Bodies bodies_;
  std::vector<Substance> substances_;  ///< by sphere
  Agenda agenda_;
  Instant now_;        ///< of the contact at hand
  double time_ = 0.0;  ///< s, where advanceTo stopped
  std::vector<ImpulseEvent> events_;
  SphereStepperCounters counters_;
};

namespace {

/// Positions in `spheres`, in order of the ids.
std::vector<std::uint32_t> byId(const std::vector<Sphere>& spheres) {
  std::vector<std::uint32_t> listed(spheres.size());
  std::iota(listed.begin(), listed.end(), 0U);
  std::ranges::sort(listed, {}, [&](std::uint32_t at) { return spheres[at].id; });
  return listed;
}

Bodies bodiesOf(const SphereWorld& world) {
  Bodies bodies;
  bodies.gravity = world.gravity;
  const double level = kLevel * std::sqrt(dotInOrder(world.gravity, world.gravity));
  for (const Plane& plane : world.planes) {
    const double acceleration = dotInOrder(plane.normal, world.gravity);
    bodies.walls.push_back({plane, std::abs(acceleration) > level ? acceleration : 0.0});
  }
  bodies.motions.reserve(world.spheres.size());
  bodies.radii.reserve(world.spheres.size());
  bodies.ids.reserve(world.spheres.size());
  for (const std::uint32_t listed : byId(world.spheres)) {
    const Sphere& sphere = world.spheres[listed];
    bodies.motions.push_back({sphere.position, sphere.velocity, Instant{}});
    bodies.radii.push_back(sphere.radius);
    bodies.ids.push_back(sphere.id);
  }
  return bodies;
}

}  // namespace

SphereStepper::Simulation::Simulation(const SphereWorld& world)
    : restitutions_(world.restitutions),
      order_(world.spheres.size()),
      bodies_(bodiesOf(world)),
      agenda_(bodies_) {
  substances_.reserve(world.spheres.size());
  for (const std::uint32_t listed : byId(world.spheres)) {
    const Sphere& sphere = world.spheres[listed];
    order_[listed] = static_cast<std::uint32_t>(substances_.size());
    substances_.push_back({sphere.mass, sphere.restitution, sphere.surface, world.restSpeed});
  }
  for (std::size_t sphere = 0; sphere < sphereCount(); ++sphere)
    grantFirstHop(sphere);
  for (std::uint32_t sphere = 0; sphere < sphereCount(); ++sphere)
    agenda_.predict(sphere, now_);
}

// ---- Contacts

void SphereStepper::Simulation::advanceTo(double time) {
  events_.clear();
  while (!agenda_.empty() && agenda_.firstTime().seconds <= time)
    step();
  time_ = time;
}

void SphereStepper::Simulation::step() {
  const std::uint32_t sphere = agenda_.first();
  now_ = agenda_.firstTime();
  if (agenda_.firstCrosses()) {
    agenda_.cross(sphere, now_);
    return;
  }
  const Agenda::Contact contact = agenda_.contact(sphere);
  if (contact.partner >= sphereCount()) {
    meetWall(sphere, bodies_.walls[contact.partner - sphereCount()]);
  } else if (agenda_.upToDate(contact)) {
    meetSphere(std::min(sphere, contact.partner), std::max(sphere, contact.partner));
  } else {
    ++counters_.staleContacts;
    agenda_.predict(sphere, now_);
  }
}

void SphereStepper::Simulation::meetSphere(std::uint32_t sphere, std::uint32_t other) {
  const Motion motion = bodies_.at(sphere, now_);
  const Motion otherMotion = bodies_.at(other, now_);
  const Vec3 separation = motion.position - otherMotion.position;
  const double closing = -dotInOrder(separation, motion.velocity - otherMotion.velocity);
  if (closing > 0.0) {
    noteContact(sphere);
    noteContact(other);
    const double distance = std::sqrt(dotInOrder(separation, separation));
    collide(sphere, motion, other, otherMotion, separation / distance, closing / distance);
  } else {  // a pass so close that rounding decided: predicted from here it is one
    leave(sphere, motion);
    leave(other, otherMotion);
  }
  agenda_.predict(sphere, now_);
  agenda_.predict(other, now_);
}

void SphereStepper::Simulation::collide(std::uint32_t sphere, Motion motion, std::uint32_t other,
                                        Motion otherMotion, const Vec3& normal,
                                        double approachSpeed) {
  const Substance& body = substances_[sphere];
  const Substance& otherBody = substances_[other];
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
    report({bodies_.ids[sphere], bodies_.radii[sphere], motion.position, motion.velocity},
           {bodies_.ids[other], bodies_.radii[other], otherMotion.position, otherMotion.velocity},
           impact);
  }
  motion.velocity += (share * change) * normal;
  otherMotion.velocity -= (otherShare * change) * normal;
  leave(sphere, motion);
  leave(other, otherMotion);
}

void SphereStepper::Simulation::meetWall(std::uint32_t sphere, const Wall& wall) {
  const Motion motion = bodies_.at(sphere, now_);
  const double approachSpeed = -dotInOrder(wall.plane.normal, motion.velocity);
  // Where rounding has turned the last of a slow approach round, gravity still presses.
  if (approachSpeed >= 0.0 || wall.acceleration < 0.0) {
    noteContact(sphere);
    bounce(sphere, motion, wall, std::max(approachSpeed, 0.0));
  } else {  // so slow that rounding decided
    leave(sphere, motion);
  }
  agenda_.predict(sphere, now_);
}

void SphereStepper::Simulation::bounce(std::uint32_t sphere, Motion motion, const Wall& wall,
                                       double approachSpeed) {
  Substance& body = substances_[sphere];
  const Vec3& normal = wall.plane.normal;
  double rebound = 0.0;
  if (approachSpeed > 0.0 && approachSpeed >= body.restSpeed) {
    rebound = damp(body, wall, approachSpeed);
    const double impulse = body.mass * (approachSpeed + rebound);
    report({bodies_.ids[sphere], bodies_.radii[sphere], motion.position, motion.velocity},
           {wall.plane.id, kNever, motion.position - bodies_.radii[sphere] * normal, Vec3::Zero()},
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
void SphereStepper::Simulation::leave(std::uint32_t sphere, const Motion& motion) {
  bodies_.motions[sphere] = motion;
  agenda_.forget(sphere);
}

void SphereStepper::Simulation::report(const Side& first, const Side& second,
                                       const Impact& impact) {
  ++counters_.collisions;
  const Vec3 point = first.position - first.radius * impact.normal;
  events_.push_back(shareOf(first, second, impact, 1.0, point, now_.seconds));
  events_.push_back(shareOf(second, first, impact, -1.0, point, now_.seconds));
}

// ---- Rest

double SphereStepper::Simulation::hopSpeed(const Substance& body, const Wall& wall) const {
  return std::min(0.5 * body.restSpeed, 0.5 * kHopTime * -wall.acceleration);
}

/// A sphere that starts on a plane with less normal energy than a hop has may hop once.
void SphereStepper::Simulation::grantFirstHop(std::size_t sphere) {
  Substance& body = substances_[sphere];
  const Motion& motion = bodies_.motions[sphere];
  for (const Wall& wall : bodies_.walls) {
    if (!(wall.acceleration < 0.0)) continue;
    const double height =
        dotInOrder(wall.plane.normal, motion.position) - wall.plane.offset - bodies_.radii[sphere];
    const double speed = dotInOrder(wall.plane.normal, motion.velocity);
    const double hop = hopSpeed(body, wall);
    const double hopEnergy = 0.5 * hop * hop;
    const bool resting = 0.5 * speed * speed - wall.acceleration * height < hopEnergy;
    if (resting) body.hopAllowance = std::max(body.hopAllowance, hopEnergy);
  }
}

/// Watches for collapse; see SphereStepper.
void SphereStepper::Simulation::noteContact(std::uint32_t sphere) {
  Substance& body = substances_[sphere];
  const bool rapid = elapsed(bodies_.motions[sphere].since, now_) < kCollapseInterval;
  body.rapidContacts = rapid ? body.rapidContacts + 1 : 0;
  if (body.rapidContacts != kCollapseRun) return;
  ++counters_.collapses;
  body.restSpeed = std::max(body.restSpeed, kCollapseRestSpeed);
  body.hopAllowance = 0.125 * body.restSpeed * body.restSpeed;
  body.rapidContacts = 0;
}

/// Rebound speed of a reported contact; the plane owes the sphere a hop when it took that much.
double SphereStepper::Simulation::damp(Substance& body, const Wall& wall,
                                       double approachSpeed) const {
  const double restitution =
      restitutions_.of(body.surface, body.restitution, wall.plane.surface, wall.plane.restitution);
  const double rebound = restitution * approachSpeed;
  const double taken = 0.5 * (approachSpeed - rebound) * (approachSpeed + rebound);
  const double highestHop = 0.125 * body.restSpeed * body.restSpeed;
  body.hopAllowance = std::min(body.hopAllowance + taken, highestHop);
  return rebound;
}

/// Rebound speed of an unreported contact.
double SphereStepper::Simulation::restingRebound(Substance& body, const Wall& wall,
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
    energy += 0.5 * substances_[sphere].mass * dotInOrder(velocity, velocity);
  }
  return energy;
}

double SphereStepper::Simulation::potentialEnergy() const {
  double energy = 0.0;
  for (std::size_t sphere = 0; sphere < sphereCount(); ++sphere) {
    energy -= substances_[sphere].mass * dotInOrder(bodies_.gravity, motionAtTime(sphere).position);
  }
  return energy;
}

bool SphereStepper::Simulation::validate(std::string* why) const {
  if (!agenda_.queueValid()) return fail(why, "the contact queue is out of order");
  for (std::size_t sphere = 0; sphere < sphereCount(); ++sphere) {
    if (!validateSphere(sphere, why) || !validateApart(sphere, why)) return false;
  }
  return true;
}

bool SphereStepper::Simulation::validateSphere(std::size_t sphere, std::string* why) const {
  const std::string name = "sphere " + std::to_string(bodies_.ids[sphere]);
  const Motion& motion = bodies_.motions[sphere];
  if (!motion.position.allFinite() || !motion.velocity.allFinite()) {
    return fail(why, name + ": position or velocity is not finite");
  }
  std::string what;
  if (!agenda_.validate(static_cast<std::uint32_t>(sphere), time_, &what))
    return fail(why, name + ": " + what);
  return true;
}

bool SphereStepper::Simulation::validateApart(std::size_t sphere, std::string* why) const {
  const std::string name = "sphere " + std::to_string(bodies_.ids[sphere]);
  const Vec3 position = motionAtTime(sphere).position;
  const double rounding = kRoundingTolerance * position.cwiseAbs().maxCoeff();
  for (std::size_t other = sphere + 1; other < sphereCount(); ++other) {
    const double distance = (position - motionAtTime(other).position).norm();
    const double allowed =
        kOverlapTolerance * std::min(bodies_.radii[sphere], bodies_.radii[other]) + rounding;
    if (distance + allowed < bodies_.radii[sphere] + bodies_.radii[other]) {
      return fail(why, name + ": overlaps sphere " + std::to_string(bodies_.ids[other]));
    }
  }
  for (const Wall& wall : bodies_.walls) {
    const double height = dotInOrder(wall.plane.normal, position) - wall.plane.offset;
    const double allowed = kOverlapTolerance * bodies_.radii[sphere] + rounding;
    if (height + allowed < bodies_.radii[sphere]) {
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
  const Motion motion = simulation_->motionOf(sphere);
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
