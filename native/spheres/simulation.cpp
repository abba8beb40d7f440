#include "native/spheres/simulation.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "native/math/vector_math.h"

namespace carom::native {
namespace {

constexpr double kOverlapTolerance = 1e-8;    ///< relative to the smaller radius, for validate()
constexpr double kRoundingTolerance = 1e-12;  ///< relative to the coordinates, for validate()

/// Returns positions in `spheres`, in order of the ids.
std::vector<std::uint32_t> byId(const std::vector<Sphere>& spheres) {
  std::vector<std::uint32_t> listed(spheres.size());
  std::iota(listed.begin(), listed.end(), 0U);
  std::ranges::sort(listed, {}, [&](std::uint32_t at) { return spheres[at].id; });
  return listed;
}

/// Returns, by position in the list, at which place of `listed` this position is.
std::vector<std::uint32_t> inverseOf(const std::vector<std::uint32_t>& listed) {
  std::vector<std::uint32_t> order(listed.size());
  for (std::uint32_t sphere = 0; sphere < listed.size(); ++sphere)
    order[listed[sphere]] = sphere;
  return order;
}

}  // namespace

Simulation::Simulation(const SphereWorld& world) : Simulation(world, byId(world.spheres)) {}

Simulation::Simulation(const SphereWorld& world, std::vector<std::uint32_t> listed)
    : order_(inverseOf(listed)),
      bodies_(bodiesOf(world, listed)),
      properties_(world, listed),
      linkage_(world, bodies_.ids),
      scheduler_(bodies_),
      ledger_(bodies_, properties_),
      recorder_(bodies_, properties_),
      trajectories_({bodies_, properties_, linkage_, scheduler_, ledger_, recorder_}),
      rest_({bodies_, properties_, trajectories_, counters_}, world.restSpeed),
      sleep_({bodies_, scheduler_, trajectories_, rest_, counters_}),
      reporter_({bodies_, trajectories_, recorder_, counters_}),
      responses_({bodies_, properties_, linkage_, trajectories_}),
      parts_{bodies_,       properties_, linkage_, scheduler_, responses_,
             trajectories_, rest_,       sleep_,   reporter_,  ledger_},
      clusters_(parts_),
      sphereContacts_(parts_, clusters_),
      wallContacts_(parts_, clusters_),
      edgeContacts_(parts_),
      oscillatingContacts_(parts_) {
  trajectories_.begin();
}

void Simulation::advanceTo(double time, std::size_t mostEvents) {
  constexpr std::size_t kPerEvent = SphereStepper::kWorkPerEvent;
  reporter_.clear();
  std::size_t done = 0;
  for (std::uint32_t first = scheduler_.first();
       first != EventScheduler::kNobody && scheduler_.time(first).seconds <= time;
       first = scheduler_.first()) {
    step(first);
    if (reporter_.events().size() < mostEvents && ++done / kPerEvent < mostEvents) continue;
    time_ = trajectories_.now().seconds;
    return;
  }
  time_ = time;
}

void Simulation::push(std::size_t listed, const Vec3& impulse) {
  const std::uint32_t sphere = order_[listed];
  // One that is jammed meets nothing any more, and stays where it is.
  if (scheduler_.removed(sphere) && !trajectories_.isLinked(sphere)) return;
  trajectories_.setNow({time_, 0.0});
  sleep_.wake(sphere);
  Motion motion = trajectories_.motion(sphere);
  motion.velocity += impulse / properties_.mass(sphere);
  trajectories_.changeMotion(sphere, motion);
  trajectories_.settleRods(sphere);
  trajectories_.predictChanged();
}

/// Carries out the next event of the sphere, which is the earliest of all.
void Simulation::step(std::uint32_t sphere) {
  const Instant now = scheduler_.time(sphere);
  trajectories_.setNow(now);
  if (scheduler_.turns(sphere)) {
    trajectories_.turn(sphere);
    trajectories_.predictChanged();
  } else if (scheduler_.crosses(sphere)) {
    scheduler_.cross(sphere, now);
  } else {
    meet(sphere, scheduler_.contact(sphere));
  }
}

/// Carries out a contact, or predicts it anew if its partner moves otherwise than was predicted.
void Simulation::meet(std::uint32_t sphere, const EventScheduler::Contact& contact) {
  const bool tied = scheduler_.tied(sphere);
  const std::uint32_t partner = contact.partner;
  if (partner >= sphereCount()) {
    meetImmovable(sphere, static_cast<std::uint32_t>(partner - sphereCount()), tied);
  } else if (scheduler_.upToDate(contact)) {
    sphereContacts_.meet(std::min(sphere, partner), std::max(sphere, partner), tied);
  } else {
    ++counters_.staleContacts;
    scheduler_.predict(sphere, trajectories_.now());
    return;
  }
  trajectories_.predictChanged();
}

/// Resolves a contact with a wall or, counted after the walls, a box. A wall that is a box's face
/// means that the sphere, which this face holds, reaches its border.
void Simulation::meetImmovable(std::uint32_t sphere, std::uint32_t index, bool tied) {
  if (index < bodies_.steady) {
    wallContacts_.meet(sphere, index, tied);
  } else if (index < bodies_.faces) {
    oscillatingContacts_.meet(sphere, index);
  } else if (index < bodies_.walls.size()) {
    edgeContacts_.passBorder(sphere, index);
  } else {
    meetBox(sphere, bodies_.solids[index - bodies_.walls.size()], tied);
  }
}

void Simulation::meetBox(std::uint32_t sphere, const Solid& solid, bool tied) {
  const Vec3 position = trajectories_.motion(sphere).position;
  const BoxNearest nearest = bodies_.nearest(solid, position, trajectories_.now());
  if (nearest.feature == BoxFeature::face) {
    wallContacts_.meet(sphere, solid.firstFace + static_cast<std::uint32_t>(nearest.face), tied);
  } else {
    edgeContacts_.meet(sphere, solid, solid.toWorld(nearest.normal));
  }
}

// ---- Inspection

Vec3 Simulation::spinOf(std::size_t listed) const {
  return trajectories_.spin(order_[listed], {time_, 0.0});
}

double Simulation::kineticEnergy() const {
  double energy = 0.0;
  for (std::size_t sphere = 0; sphere < sphereCount(); ++sphere) {
    const Vec3 velocity = present(sphere).velocity;
    energy += 0.5 * properties_.mass(sphere) * dotInOrder(velocity, velocity);
    const Vec3 rim = bodies_.radii[sphere] * trajectories_.spin(sphere, {time_, 0.0});
    energy += 0.2 * properties_.mass(sphere) * dotInOrder(rim, rim);
  }
  return energy;
}

double Simulation::potentialEnergy() const {
  double energy = 0.0;
  for (std::size_t sphere = 0; sphere < sphereCount(); ++sphere) {
    energy -= properties_.mass(sphere) * dotInOrder(bodies_.gravity, present(sphere).position);
  }
  for (std::uint32_t group = 0; group < linkage_.groupCount(); ++group)
    energy += linkage_.potentialEnergy(group, trajectories_.groupMotions(group, {time_, 0.0}));
  return energy;
}

Status Simulation::validate() const {
  if (!scheduler_.isQueueValid()) return Error{"the contact queue is out of order"};
  std::size_t apart = 0;
  for (std::size_t sphere = 0; sphere < sphereCount(); ++sphere) {
    if (bodies_.accelerations[sphere] != bodies_.gravity) ++apart;
    if (Status valid = validateSphere(sphere); !valid) return valid;
    if (Status valid = validateApart(sphere); !valid) return valid;
  }
  if (apart != bodies_.apart) return Error{"the count of the spheres not in free fall is wrong"};
  return ledger_.checkConservation(time_);
}

Status Simulation::validateSphere(std::size_t sphere) const {
  const std::string name = "sphere " + std::to_string(bodies_.ids[sphere]);
  const Motion& motion = bodies_.motions[sphere];
  if (!motion.position.allFinite() || !motion.velocity.allFinite() ||
      !bodies_.accelerations[sphere].allFinite()) {
    return Error{name + ": position, velocity or acceleration is not finite"};
  }
  const Status scheduled = scheduler_.validate(static_cast<std::uint32_t>(sphere), time_);
  if (!scheduled) return Error{name + ": " + scheduled.error().message};
  const Motion now = present(sphere);
  const bool still = now.velocity == Vec3::Zero() && bodies_.accelerations[sphere] == Vec3::Zero();
  if (bodies_.isAsleep(sphere) && !still) return Error{name + ": moves in its sleep"};
  return validateHolds(sphere);
}

/// Refuses a sphere that is off a wall that holds it.
Status Simulation::validateHolds(std::size_t sphere) const {
  const Motion now = present(sphere);
  for (const std::uint32_t index : bodies_.holds[sphere].all()) {
    const Wall& wall = bodies_.walls[index];
    const double height = bodies_.height(sphere, wall, now.position, now.since);
    const double allowed = kOverlapTolerance * bodies_.radii[sphere] +
                           kRoundingTolerance * now.position.cwiseAbs().maxCoeff();
    if (std::abs(height) > allowed) {
      return Error{"sphere " + std::to_string(bodies_.ids[sphere]) + ": is off plane " +
                   std::to_string(wall.plane.id) + ", which holds it"};
    }
  }
  return std::monostate{};
}

/// Refuses a sphere that overlaps a later one, a plane or a box.
Status Simulation::validateApart(std::size_t sphere) const {
  const std::string name = "sphere " + std::to_string(bodies_.ids[sphere]);
  if (scheduler_.removed(static_cast<std::uint32_t>(sphere))) return std::monostate{};
  const Motion now = present(sphere);
  const double rounding = kRoundingTolerance * now.position.cwiseAbs().maxCoeff();
  for (std::size_t other = sphere + 1; other < sphereCount(); ++other) {
    if (scheduler_.removed(static_cast<std::uint32_t>(other))) continue;
    const double distance = (now.position - present(other).position).norm();
    const double allowed =
        kOverlapTolerance * std::min(bodies_.radii[sphere], bodies_.radii[other]) + rounding;
    if (distance + allowed < bodies_.radii[sphere] + bodies_.radii[other]) {
      return Error{name + ": overlaps sphere " + std::to_string(bodies_.ids[other])};
    }
  }
  return validateOutside(sphere);
}

/// Refuses a sphere that overlaps a plane or a box.
Status Simulation::validateOutside(std::size_t sphere) const {
  const std::string name = "sphere " + std::to_string(bodies_.ids[sphere]);
  const Motion now = present(sphere);
  const double allowed = kOverlapTolerance * bodies_.radii[sphere] +
                         kRoundingTolerance * now.position.cwiseAbs().maxCoeff();
  for (const Wall& wall : std::span(bodies_.walls).first(bodies_.faces)) {
    if (bodies_.clearance(sphere, wall, now.position, now.since) < -allowed)
      return Error{name + ": overlaps plane " + std::to_string(wall.plane.id)};
  }
  for (const Solid& solid : bodies_.solids) {
    const BoxNearest nearest = bodies_.nearest(solid, now.position, now.since);
    if (nearest.distance < bodies_.radii[sphere] - allowed)
      return Error{name + ": overlaps box " + std::to_string(solid.box.id)};
  }
  return std::monostate{};
}

}  // namespace carom::native
