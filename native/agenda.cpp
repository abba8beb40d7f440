#include "native/agenda.h"

#include <algorithm>
#include <cmath>

#include "native/contact_time.h"

namespace carom {
namespace {

constexpr double kRounding = 1e-9;  ///< what certainly covers it

std::vector<Vec3> positionsOf(const Bodies& bodies) {
  std::vector<Vec3> positions;
  positions.reserve(bodies.count());
  for (const Motion& motion : bodies.motions)
    positions.push_back(motion.position);
  return positions;
}

double lengthOf(const Vec3& vector) {
  return std::sqrt(dotInOrder(vector, vector));
}

const Instant& earlierOf(const Instant& one, const Instant& other) {
  return other < one ? other : one;
}

/// The instant of first touch of two spheres under the same acceleration; never before the later of
/// the instants since which they move as they do.
Instant straightContact(const Motion& motion, const Motion& other, const Vec3& acceleration,
                        double radiusSum) {
  const double lag = elapsed(other.since, motion.since);
  const Vec3 gained = lag * acceleration;
  Vec3 separation = motion.position - other.position;
  // The earlier one is taken to the instant of the later one. `velocity` is that of both, always.
  const Vec3 velocity = motion.velocity - other.velocity - gained;
  if (lag >= 0.0) {
    separation -= lag * (other.velocity + 0.5 * gained);
  } else {
    separation -= lag * (motion.velocity - 0.5 * gained);
  }
  const double wait = sphereContactTime(separation, velocity, radiusSum);
  if (wait == kNever) return Instant::never();
  return after(lag >= 0.0 ? motion.since : other.since, wait);
}

/// As above, under different accelerations; never, too, if it is certainly not before `best`.
Instant curvedContact(const Motion& motion, const Vec3& acceleration, const Motion& other,
                      const Vec3& otherAcceleration, double radiusSum, const Instant& best) {
  const bool later = elapsed(other.since, motion.since) >= 0.0;
  const Instant& from = later ? motion.since : other.since;
  const Motion here = later ? motion : motion.at(from, acceleration);
  const Motion there = later ? other.at(from, otherAcceleration) : other;
  const Vec3 separation = here.position - there.position;
  const Vec3 velocity = here.velocity - there.velocity;
  const Vec3 relative = acceleration - otherAcceleration;
  const double horizon = elapsed(from, best) * (1.0 + kRounding);
  const double way = horizon * (lengthOf(velocity) + horizon * lengthOf(relative));
  const double reach = (radiusSum + way) * (1.0 + kRounding);
  if (dotInOrder(separation, separation) > reach * reach) return Instant::never();
  const double wait = sphereContactTime(separation, velocity, relative, radiusSum, horizon);
  return wait == kNever ? Instant::never() : after(from, wait);
}

}  // namespace

Agenda::Agenda(const Bodies& bodies)
    : bodies_(bodies),
      grid_(positionsOf(bodies), bodies.radii),
      futures_(bodies.count()),
      queue_(bodies.count()) {
  const auto& radii = bodies.radii;
  const bool equal = std::ranges::adjacent_find(radii, std::ranges::not_equal_to{}) == radii.end();
  if (!radii.empty() && equal) radius_ = radii.front();
}

bool Agenda::firstCrosses() const {
  const Future& future = futures_[first()];
  return future.crossing < future.contact.time;
}

bool Agenda::upToDate(const Contact& contact) const {
  return contact.partnerChanges == futures_[contact.partner].changes;
}

void Agenda::forget(std::uint32_t sphere) {
  Future& future = futures_[sphere];
  ++future.changes;
  if (future.contact.partner != kNobody) future.lastPartner = future.contact.partner;
  future.contact = {};
}

BodyId Agenda::idOf(const Contact& contact) const {
  if (contact.partner == kNobody) return kNobody;
  const std::size_t count = bodies_.count();
  return contact.partner < count ? bodies_.ids[contact.partner]
                                 : bodies_.walls[contact.partner - count].plane.id;
}

void Agenda::lookForWalls(std::uint32_t sphere, const Instant& now, Contact& best) const {
  const Motion& motion = bodies_.motions[sphere];
  const Vec3& pull = bodies_.accelerations[sphere];
  for (std::uint32_t index = 0; index < bodies_.walls.size(); ++index) {
    if (bodies_.holds[sphere].has(index)) continue;
    const Wall& wall = bodies_.walls[index];
    const Vec3& normal = wall.plane.normal;
    const double wait = planeContactTime(
        bodies_.height(sphere, wall, motion.position, motion.since),
        dotInOrder(normal, motion.velocity) - wall.speed, bodies_.alongNormal(normal, pull));
    if (wait == kNever) continue;
    const Instant time = std::max(after(motion.since, wait), now);
    if (best.time < time || (best.time == time && wall.plane.id > idOf(best))) continue;
    best = {time, static_cast<std::uint32_t>(bodies_.count() + index), 0};
  }
}

/// Whether it is sooner than the best, and now the best itself.
inline bool Agenda::lookAt(std::uint32_t sphere, std::uint32_t other, const Instant& now,
                           Contact& best) const {
  const double radiusSum =
      radius_ > 0.0 ? 2.0 * radius_ : bodies_.radii[sphere] + bodies_.radii[other];
  const Motion& motion = bodies_.motions[sphere];
  const Motion& otherMotion = bodies_.motions[other];
  const Vec3& pull = bodies_.accelerations[sphere];
  Instant time = bodies_.apart == 0 || pull == bodies_.accelerations[other]
                     ? straightContact(motion, otherMotion, pull, radiusSum)
                     : curvedContact(motion, pull, otherMotion, bodies_.accelerations[other],
                                     radiusSum, best.time);
  if (!(time < Instant::never())) return false;
  time = std::max(time, now);
  if (best.time < time || (best.time == time && bodies_.ids[other] >= idOf(best))) return false;
  // A partner that is due earlier looks for this sphere itself after that contact.
  if (!(time < futures_[other].contact.time)) return false;
  best = {time, other, futures_[other].changes};
  return true;
}

/// Looks at all those that `visitAll` visits, as long as they may be sooner than the best.
template <class VisitAll>
void Agenda::lookAround(std::uint32_t sphere, const Motion& motion, Contact& best,
                        const VisitAll& visitAll) const {
  const double speed = lengthOf(motion.velocity);
  const double pull = lengthOf(bodies_.accelerations[sphere]);
  const auto way = [&] {
    const double time = elapsed(motion.since, best.time);
    return time < kNever ? time * (speed + time * pull) : kNever;
  };
  CellGrid::Probe probe{motion.position, bodies_.radii[sphere], way()};
  visitAll(probe, [&](std::uint32_t other) {
    if (lookAt(sphere, other, motion.since, best)) probe.way = way();
  });
}

void Agenda::predict(std::uint32_t sphere, const Instant& now) {
  const Motion motion = bodies_.at(sphere, now);
  Contact best;
  lookForWalls(sphere, now, best);
  // Whom it met last it often meets next, and soon, as while it hops: nobody later is looked at.
  const std::uint32_t last = futures_[sphere].lastPartner;
  if (bodies_.apart > 0 && last < bodies_.count()) lookAt(sphere, last, now, best);
  lookAround(sphere, motion, best, [&](const CellGrid::Probe& probe, const auto& visit) {
    grid_.visitNear(sphere, probe, visit);
  });
  predictCrossing(sphere, motion);
  futures_[sphere].contact = best;
  claim(sphere, best);
  schedule(sphere);
}

void Agenda::predictCrossing(std::uint32_t sphere, const Motion& motion) {
  if (grid_.levelCount() == 0) return;
  const CellGrid::Crossing crossing =
      grid_.nextCrossing(sphere, {motion.position, motion.velocity, bodies_.accelerations[sphere]});
  Future& future = futures_[sphere];
  future.crossing = after(motion.since, crossing.wait);
  future.axis = crossing.axis;
  future.up = crossing.up;
}

void Agenda::cross(std::uint32_t sphere, const Instant& now) {
  Future& future = futures_[sphere];
  const CellGrid::Crossing crossing{0.0, future.axis, future.up};
  const Motion motion = bodies_.at(sphere, now);
  grid_.cross(sphere, crossing);
  predictCrossing(sphere, motion);
  Contact best = future.contact;
  lookAround(sphere, motion, best, [&](const CellGrid::Probe& probe, const auto& visit) {
    grid_.visitNew(sphere, crossing, probe, visit);
  });
  if (best.time < future.contact.time) {
    future.contact = best;
    claim(sphere, best);
  }
  schedule(sphere);
}

/// A sphere's next contact is its partner's too: so that others do not reckon with it any longer.
void Agenda::claim(std::uint32_t sphere, const Contact& found) {
  if (found.partner >= bodies_.count()) return;
  futures_[found.partner].contact = {found.time, sphere, futures_[sphere].changes};
  schedule(found.partner);
}

void Agenda::schedule(std::uint32_t sphere) {
  const Future& future = futures_[sphere];
  queue_.setTime(sphere, earlierOf(future.contact.time, future.crossing));
}

bool Agenda::validate(std::uint32_t sphere, double time, std::string* why) const {
  const auto fail = [&](const char* text) {
    if (why != nullptr) *why = text;
    return false;
  };
  const Future& future = futures_[sphere];
  const Motion& motion = bodies_.motions[sphere];
  if (queue_.time(sphere) != earlierOf(future.contact.time, future.crossing))
    return fail("the queue has another time than its next contact or crossing");
  if (future.contact.time < motion.since) return fail("next contact is before its last");
  if (future.contact.time.seconds <= time && time > 0.0) return fail("a contact is overdue");
  const bool partner = future.contact.partner < bodies_.count() + bodies_.walls.size();
  if (partner == (future.contact.time == Instant::never()))
    return fail("partner and time of the next contact disagree");
  const Vec3 position = bodies_.at(sphere, {time, 0.0}).position;
  if (!grid_.holds(sphere, position, 1e-12 * position.cwiseAbs().maxCoeff() + 1e-12))
    return fail("it is not in the cell where it should be");
  return true;
}

}  // namespace carom
