#include "native/spheres/simulation.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "native/math/contact_time.h"
#include "native/math/vector_math.h"

namespace carom::native {
namespace {

constexpr double kLevel = 1e-15;  ///< relative to gravity: below it a plane is parallel to gravity

constexpr double kOverlapTolerance = 1e-8;    ///< relative to the smaller radius, for validate()
constexpr double kRoundingTolerance = 1e-12;  ///< relative to the coordinates, for validate()

bool fail(std::string* why, const std::string& text) {
  if (why != nullptr) *why = text;
  return false;
}

/// Returns positions in `spheres`, in order of the ids.
std::vector<std::uint32_t> byId(const std::vector<Sphere>& spheres) {
  std::vector<std::uint32_t> listed(spheres.size());
  std::iota(listed.begin(), listed.end(), 0U);
  std::ranges::sort(listed, {}, [&](std::uint32_t at) { return spheres[at].id; });
  return listed;
}

Wall wallOf(const Plane& plane) {
  return {plane,
          dotInOrder(plane.normal, plane.velocity),
          {dotInOrder(plane.normal, plane.oscillation.amplitude), plane.oscillation.frequency,
           plane.oscillation.phase / kWholeTurn}};
}

/// Adds the box, and its faces to the walls.
void addBox(const Box& box, Bodies& bodies) {
  Solid solid{box, columnsOf(box.orientation), lengthOf(box.halfExtents),
              static_cast<std::uint32_t>(bodies.walls.size())};
  for (std::size_t axis = 0; axis < solid.axes.size(); ++axis) {
    for (const double side : {1.0, -1.0}) {
      const Vec3 normal = side * solid.axes[axis];
      const double offset =
          dotInOrder(normal, box.centre) + box.halfExtents[static_cast<Eigen::Index>(axis)];
      Plane plane{box.id, normal, offset, box.restitution, box.surface, box.velocity};
      plane.restitutionLaw = box.restitutionLaw;
      plane.friction = box.friction;
      plane.stiffness = box.stiffness;
      Wall face = wallOf(plane);
      face.box = static_cast<std::uint32_t>(bodies.solids.size());
      bodies.walls.push_back(face);
    }
  }
  bodies.solids.push_back(solid);
}

void addWalls(const SphereWorld& world, Bodies& bodies) {
  for (const bool oscillating : {false, true}) {
    for (const Plane& plane : world.planes) {
      const Wall wall = wallOf(plane);
      if (wall.oscillates() == oscillating) bodies.walls.push_back(wall);
    }
    if (!oscillating) bodies.steady = static_cast<std::uint32_t>(bodies.walls.size());
  }
  bodies.faces = static_cast<std::uint32_t>(bodies.walls.size());
  for (const Box& box : world.boxes)
    addBox(box, bodies);
}

Bodies bodiesOf(const SphereWorld& world) {
  Bodies bodies;
  bodies.gravity = world.gravity;
  bodies.level = kLevel * lengthOf(world.gravity);
  addWalls(world, bodies);
  const std::size_t count = world.spheres.size();
  bodies.motions.reserve(count);
  bodies.radii.reserve(count);
  bodies.ids.reserve(count);
  for (const std::uint32_t listed : byId(world.spheres)) {
    const Sphere& sphere = world.spheres[listed];
    bodies.motions.push_back({sphere.position, sphere.velocity, Instant{}});
    bodies.radii.push_back(sphere.radius);
    bodies.ids.push_back(sphere.id);
  }
  bodies.accelerations.assign(count, world.gravity);
  bodies.holds.resize(count);
  return bodies;
}

}  // namespace

Simulation::Simulation(const SphereWorld& world)
    : restitutions_(world.restitutions),
      restSpeed_(world.restSpeed),
      order_(world.spheres.size()),
      bodies_(bodiesOf(world)),
      linkage_(world, bodies_.ids),
      scheduler_(bodies_) {
  substances_.reserve(world.spheres.size());
  for (const std::uint32_t listed : byId(world.spheres)) {
    const Sphere& sphere = world.spheres[listed];
    order_[listed] = static_cast<std::uint32_t>(substances_.size());
    Substance& substance = substances_.emplace_back();
    substance.mass = sphere.mass;
    substance.restitution = sphere.restitution;
    substance.surface = sphere.surface;
    if (world.simultaneous == Simultaneous::hertz) stiffnesses_.push_back(sphere.stiffness);
  }
  takeMechanics(world);
  for (std::uint32_t group = 0; group < linkage_.groupCount(); ++group)
    settleRods(group);
  grantFirstHops();
  openBooks();
  restartGroups();
  changed_.clear();
  for (std::uint32_t sphere = 0; sphere < sphereCount(); ++sphere)
    scheduler_.predict(sphere, now_);
}

void Simulation::advanceTo(double time) {
  events_.clear();
  for (std::uint32_t first = scheduler_.first();
       first != EventScheduler::kNobody && scheduler_.time(first).seconds <= time;
       first = scheduler_.first())
    step(first);
  time_ = time;
}

void Simulation::push(std::size_t listed, const Vec3& impulse) {
  const std::uint32_t sphere = order_[listed];
  now_ = {time_, 0.0};
  wake(sphere);
  Motion motion = bodies_.at(sphere, now_);
  motion.velocity += impulse / substances_[sphere].mass;
  leave(sphere, motion);
  if (linkage_.hasRods(sphere)) settleRods(linkage_.groupOf(sphere));
  predictChanged();
}

/// Carries out the next event of the sphere, which is the earliest of all.
void Simulation::step(std::uint32_t sphere) {
  now_ = scheduler_.time(sphere);
  if (scheduler_.turns(sphere)) {
    turn(sphere);
    return;
  }
  if (scheduler_.crosses(sphere)) {
    scheduler_.cross(sphere, now_);
    return;
  }
  const EventScheduler::Contact contact = scheduler_.contact(sphere);
  tied_ = scheduler_.tied(sphere);
  if (contact.partner >= sphereCount()) {
    meetImmovable(sphere, static_cast<std::uint32_t>(contact.partner - sphereCount()));
  } else if (scheduler_.upToDate(contact)) {
    meetSphere(std::min(sphere, contact.partner), std::max(sphere, contact.partner));
  } else {
    ++counters_.staleContacts;
    scheduler_.predict(sphere, now_);
  }
}

/// Puts the sphere on a new course from now_ on; predictions that others made with it become
/// outdated.
void Simulation::leave(std::uint32_t sphere, const Motion& motion) {
  rebase(sphere, motion);
  if (linked(sphere)) restarts_.push_back(linkage_.groupOf(sphere));
}

void Simulation::rebase(std::uint32_t sphere, const Motion& motion) {
  if (!spins_.empty()) spins_[sphere] = {spinAt(sphere, motion.since), Vec3::Zero()};
  const Motion before = bodies_.at(sphere, motion.since);
  if (bodies_.accelerations[sphere] != bodies_.gravity) bookForces(sphere, before, books_);
  bodies_.motions[sphere] = motion;
  keepHolds(sphere, bodies_.motions[sphere]);
  roll(sphere);
  book(sphere, before.velocity, bodies_.motions[sphere].velocity);
  scheduler_.forget(sphere);
  changed_.push_back(sphere);
}

void Simulation::predictChanged() {
  if (!restarts_.empty()) restartGroups();
  std::ranges::sort(changed_);
  // Not std::ranges::unique: Clang 14 does not compile that of libstdc++ 12.
  changed_.erase(std::unique(changed_.begin(), changed_.end()), changed_.end());
  for (const std::uint32_t sphere : changed_) {
    if (recording_ != nullptr) record(sphere);
    scheduler_.predict(sphere, now_);
  }
  changed_.clear();
}

void Simulation::report(const Side& first, const Side& second, const Impact& impact) {
  ++counters_.collisions;
  const Recording::Events events = eventsOf(first, second, impact, now_.seconds);
  events_.insert(events_.end(), events.begin(), events.end());
  if (recording_ != nullptr) recording_->addCollision(events, now_, impact.impulse);
}

// ---- Spheres

/// The side of an event for a sphere that has arrived along `motion`.
Side Simulation::sideOf(std::uint32_t sphere, const Motion& motion) const {
  return {bodies_.ids[sphere], bodies_.radii[sphere], motion.position,
          motion.velocity,     Quat::Identity(),      spinAt(sphere, now_)};
}

void Simulation::meetSphere(std::uint32_t sphere, std::uint32_t other) {
  Pair pair{bodies_.at(sphere, now_), bodies_.at(other, now_), {}, 0.0, sphere, other};
  const Vec3 separation = pair.motion.position - pair.otherMotion.position;
  const double distance = lengthOf(separation);
  pair.normal = separation / distance;
  pair.approachSpeed =
      -dotInOrder(separation, pair.motion.velocity - pair.otherMotion.velocity) / distance;
  const double slowest = std::max(restSpeed(sphere), restSpeed(other));
  if (pair.approachSpeed >= slowest && pair.approachSpeed > 0.0) {
    if (pair.approachSpeed >= kWakeSpeed * slowest) {
      wake(sphere);
      wake(other);
    }
    if (!meetTogether(sphere, other)) collide(pair);
  } else if (pair.approachSpeed > 0.0 || pull(sphere, other, pair.normal) > 0.0) {
    pair.approachSpeed = std::max(pair.approachSpeed, 0.0);
    touch(pair);
  } else {  // a near miss that rounding took for a contact; predicted anew it is a miss
    leave(sphere, pair.motion);
    leave(other, pair.otherMotion);
  }
  predictChanged();
}

double Simulation::restitutionOf(std::uint32_t sphere, std::uint32_t other,
                                 double approachSpeed) const {
  const Substance& one = substances_[sphere];
  const Substance& two = substances_[other];
  if (laws_.empty())
    return restitutions_.of(one.surface, one.restitution, two.surface, two.restitution);
  return restitutions_.of(one.surface, restitutionAt(one.restitution, laws_[sphere], approachSpeed),
                          two.surface, restitutionAt(two.restitution, laws_[other], approachSpeed));
}

/// Resolves a collision of two spheres of which at least one has rods.
void Simulation::collideLinked(const Pair& pair, double restitution) {
  const Give give = giveOf(pair);
  const double compliance = dotInOrder(pair.normal, give.yield - give.otherYield);
  Motion motion = pair.motion;
  Motion otherMotion = pair.otherMotion;
  if (compliance > 0.0) {
    const double impulse = (1.0 + restitution) * pair.approachSpeed / compliance;
    reportPair(pair, 1.0 / compliance, impulse);
    motion.velocity += impulse * give.yield;
    otherMotion.velocity += impulse * give.otherYield;
    drag(give, impulse);
  }
  leave(pair.sphere, motion);
  leave(pair.other, otherMotion);
}

void Simulation::reportPair(const Pair& pair, double mass, double impulse) {
  report(sideOf(pair.sphere, pair.motion), sideOf(pair.other, pair.otherMotion),
         {pair.normal, pair.approachSpeed, mass, impulse});
}

void Simulation::collide(const Pair& pair) {
  Substance& one = substances_[pair.sphere];
  Substance& two = substances_[pair.other];
  noteContact(pair.sphere, pair.motion);
  noteContact(pair.other, pair.otherMotion);
  const double restitution = restitutionOf(pair.sphere, pair.other, pair.approachSpeed);
  if (linkage_.hasRods(pair.sphere) || linkage_.hasRods(pair.other)) {
    collideLinked(pair, restitution);
    return;
  }
  // Shares of the two in the change of velocity, formed so that equal masses swap theirs exactly.
  double share = two.mass / (one.mass + two.mass);
  double otherShare = one.mass / (one.mass + two.mass);
  double mass = one.mass * share;
  if (one.asleep || two.asleep) {  // a sphere that sleeps on does not yield
    share = two.asleep ? 1.0 : 0.0;
    otherShare = two.asleep ? 0.0 : 1.0;
    mass = two.asleep ? one.mass : two.mass;
  }
  const double change = (1.0 + restitution) * pair.approachSpeed;
  const double taken = 0.5 * mass * (1.0 - restitution) * (1.0 + restitution) * pair.approachSpeed *
                       pair.approachSpeed;
  allowHop(pair.sphere, 0.5 * taken);
  allowHop(pair.other, 0.5 * taken);
  reportPair(pair, mass, mass * change);
  Motion motion = pair.motion;
  Motion otherMotion = pair.otherMotion;
  motion.velocity += (share * change) * pair.normal;
  otherMotion.velocity -= (otherShare * change) * pair.normal;
  if (!one.asleep && !two.asleep) audit(pair, motion, otherMotion, taken);
  rub(pair, mass * change, motion, otherMotion);
  leave(pair.sphere, motion);
  leave(pair.other, otherMotion);
}

/// Resolves a contact slower than restSpeed: elastic, except for a hop, and unreported. A sleeping
/// sphere does not yield, nor does one on a wall towards that wall.
void Simulation::touch(const Pair& pair) {
  ++counters_.restContacts;
  const bool stuck = noteContact(pair.sphere, pair.motion);
  const bool otherStuck = noteContact(pair.other, pair.otherMotion);
  const Give give = giveOf(pair);
  const double compliance = dotInOrder(pair.normal, give.yield - give.otherYield);
  Motion motion = pair.motion;
  Motion otherMotion = pair.otherMotion;
  if (compliance > 0.0) {
    const double speed = lengthOf(motion.velocity) + lengthOf(otherMotion.velocity);
    // The pair must part, or rounding finds the same contact again at the same instant.
    const double rebound = std::max(restingRebound(pair, 1.0 / compliance), kLeastRebound * speed);
    const double impulse = (pair.approachSpeed + rebound) / compliance;
    motion.velocity += impulse * give.yield;
    otherMotion.velocity += impulse * give.otherYield;
    drag(give, impulse);
  }
  if (stuck) stop(pair.sphere, motion);
  if (otherStuck) stop(pair.other, otherMotion);
  leave(pair.sphere, motion);
  leave(pair.other, otherMotion);
  trySleep(pair.sphere);
  trySleep(pair.other);
}

// ---- Walls

/// Resolves a contact with a wall or, counted after the walls, a box.
void Simulation::meetImmovable(std::uint32_t sphere, std::uint32_t index) {
  if (index < bodies_.steady) {
    meetWall(sphere, index);
  } else if (index < bodies_.faces) {
    meetOscillating(sphere, index);
  } else if (index < bodies_.walls.size()) {
    passBorder(sphere, index);
  } else {
    meetBox(sphere, static_cast<std::uint32_t>(index - bodies_.walls.size()));
  }
}

void Simulation::meetWall(std::uint32_t sphere, std::uint32_t index) {
  wake(sphere);
  const Wall& wall = bodies_.walls[index];
  const Motion motion = bodies_.at(sphere, now_);
  const Vec3& normal = wall.plane.normal;
  const double approachSpeed = wall.speed - dotInOrder(normal, motion.velocity);
  if (approachSpeed > 0.0 && approachSpeed >= restSpeed(sphere) &&
      meetTogether(sphere, static_cast<std::uint32_t>(sphereCount() + index))) {
    predictChanged();
    return;
  }
  // Gravity still presses where rounding has reversed the end of a slow approach.
  if (approachSpeed >= 0.0 || bodies_.alongNormal(normal, bodies_.accelerations[sphere]) < 0.0) {
    noteContact(sphere, motion);
    bounce(sphere, motion, index, std::max(approachSpeed, 0.0));
  } else {  // the contact is so slow that rounding decided
    leave(sphere, motion);
  }
  predictChanged();
}

/// The side of an event for a wall that is struck at `point`: a plane is placed there, a face where
/// its box is.
Side Simulation::wallSide(const Wall& wall, const Vec3& point) const {
  if (wall.box == Wall::kNoBox) return {wall.plane.id, kNever, point, wall.plane.velocity};
  const Solid& solid = bodies_.solids[wall.box];
  return {solid.box.id, kNever, solid.centreAt(now_), solid.box.velocity, solid.box.orientation};
}

void Simulation::bounce(std::uint32_t sphere, Motion motion, std::uint32_t index,
                        double approachSpeed) {
  const Substance& body = substances_[sphere];
  const Wall& wall = bodies_.walls[index];
  const Vec3& normal = wall.plane.normal;
  const double rebound = wallRebound(sphere, index, approachSpeed);
  Give give{normal / body.mass, Vec3::Zero(), {}};
  double mass = body.mass;
  const bool rods = linkage_.hasRods(sphere);
  if (rods) {
    give = giveOf({motion, {}, normal, approachSpeed, sphere, EventScheduler::kNobody});
    const double compliance = dotInOrder(normal, give.yield);
    mass = compliance > 0.0 ? 1.0 / compliance : 0.0;
  }
  const double impulse = mass * (approachSpeed + rebound);
  if (approachSpeed > 0.0 && approachSpeed >= restSpeed(sphere)) {
    report(sideOf(sphere, motion), wallSide(wall, motion.position - bodies_.radii[sphere] * normal),
           {normal, approachSpeed, mass, impulse});
    rubOnWall(sphere, wall.plane, impulse, motion);
  } else {
    ++counters_.restContacts;
  }
  if (rods) {
    motion.velocity += impulse * give.yield;
    drag(give, impulse);
  } else {
    // A held sphere gets exactly the speed of the wall, so that it does not leave by the rounding
    // of a speed that has vanished.
    const double onto = wall.speed - dotInOrder(normal, motion.velocity);
    motion.velocity += (rebound == 0.0 ? onto : approachSpeed + rebound) * normal;
  }
  if (rebound == 0.0 && !rods) hold(sphere, motion, index);
  leave(sphere, motion);
}

// ---- Inspection

double Simulation::kineticEnergy() const {
  double energy = 0.0;
  for (std::size_t sphere = 0; sphere < sphereCount(); ++sphere) {
    const Vec3 velocity = motionAtTime(sphere).velocity;
    energy += 0.5 * substances_[sphere].mass * dotInOrder(velocity, velocity);
    const Vec3 rim = bodies_.radii[sphere] * spinAt(sphere, {time_, 0.0});
    energy += 0.2 * substances_[sphere].mass * dotInOrder(rim, rim);
  }
  return energy;
}

double Simulation::potentialEnergy() const {
  double energy = 0.0;
  for (std::size_t sphere = 0; sphere < sphereCount(); ++sphere) {
    energy -= substances_[sphere].mass * dotInOrder(bodies_.gravity, motionAtTime(sphere).position);
  }
  for (std::uint32_t group = 0; group < linkage_.groupCount(); ++group)
    energy += linkage_.potentialEnergy(group, motionsOf(group, {time_, 0.0}));
  return energy;
}

bool Simulation::validate(std::string* why) const {
  if (!scheduler_.queueValid()) return fail(why, "the contact queue is out of order");
  std::size_t apart = 0;
  for (std::size_t sphere = 0; sphere < sphereCount(); ++sphere) {
    if (bodies_.accelerations[sphere] != bodies_.gravity) ++apart;
    if (!validateSphere(sphere, why) || !validateApart(sphere, why)) return false;
  }
  if (apart != bodies_.apart)
    return fail(why, "the count of the spheres not in free fall is wrong");
  return validateBooks(why);
}

bool Simulation::validateSphere(std::size_t sphere, std::string* why) const {
  const std::string name = "sphere " + std::to_string(bodies_.ids[sphere]);
  const Motion& motion = bodies_.motions[sphere];
  if (!motion.position.allFinite() || !motion.velocity.allFinite() ||
      !bodies_.accelerations[sphere].allFinite()) {
    return fail(why, name + ": position, velocity or acceleration is not finite");
  }
  std::string what;
  if (!scheduler_.validate(static_cast<std::uint32_t>(sphere), time_, &what))
    return fail(why, name + ": " + what);
  const Motion present = motionAtTime(sphere);
  for (const std::uint32_t index : bodies_.holds[sphere].all()) {
    const Wall& wall = bodies_.walls[index];
    const double height = bodies_.height(sphere, wall, present.position, present.since);
    const double allowed = kOverlapTolerance * bodies_.radii[sphere] +
                           kRoundingTolerance * present.position.cwiseAbs().maxCoeff();
    if (std::abs(height) > allowed)
      return fail(why,
                  name + ": is off plane " + std::to_string(wall.plane.id) + ", which it holds");
  }
  const bool still =
      present.velocity == Vec3::Zero() && bodies_.accelerations[sphere] == Vec3::Zero();
  if (substances_[sphere].asleep && !still) return fail(why, name + ": moves in its sleep");
  return true;
}

bool Simulation::validateApart(std::size_t sphere, std::string* why) const {
  const std::string name = "sphere " + std::to_string(bodies_.ids[sphere]);
  if (scheduler_.removed(static_cast<std::uint32_t>(sphere))) return true;
  const Motion present = motionAtTime(sphere);
  const double rounding = kRoundingTolerance * present.position.cwiseAbs().maxCoeff();
  for (std::size_t other = sphere + 1; other < sphereCount(); ++other) {
    if (scheduler_.removed(static_cast<std::uint32_t>(other))) continue;
    const double distance = (present.position - motionAtTime(other).position).norm();
    const double allowed =
        kOverlapTolerance * std::min(bodies_.radii[sphere], bodies_.radii[other]) + rounding;
    if (distance + allowed < bodies_.radii[sphere] + bodies_.radii[other]) {
      return fail(why, name + ": overlaps sphere " + std::to_string(bodies_.ids[other]));
    }
  }
  return validateOutside(sphere, why);
}

/// True if the sphere is outside of planes and boxes.
bool Simulation::validateOutside(std::size_t sphere, std::string* why) const {
  const std::string name = "sphere " + std::to_string(bodies_.ids[sphere]);
  const Motion present = motionAtTime(sphere);
  const double allowed = kOverlapTolerance * bodies_.radii[sphere] +
                         kRoundingTolerance * present.position.cwiseAbs().maxCoeff();
  for (const Wall& wall : std::span(bodies_.walls).first(bodies_.faces)) {
    if (bodies_.clearance(sphere, wall, present.position, present.since) < -allowed)
      return fail(why, name + ": overlaps plane " + std::to_string(wall.plane.id));
  }
  for (const Solid& solid : bodies_.solids) {
    const BoxNearest nearest = bodies_.nearest(solid, present.position, present.since);
    if (nearest.distance < bodies_.radii[sphere] - allowed)
      return fail(why, name + ": overlaps box " + std::to_string(solid.box.id));
  }
  return true;
}

}  // namespace carom::native
