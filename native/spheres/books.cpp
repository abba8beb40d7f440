// Conservation check: the part of Simulation that accounts for momentum and energy.

#include <cmath>

#include "native/math/contact_time.h"
#include "native/spheres/simulation.h"

namespace carom::native {
namespace {

constexpr double kBookRounding = 1e-12;   ///< allowed error, relative to the turnover
constexpr double kStateRounding = 1e-11;  ///< allowed error, relative to momentum or energy

double sizeOf(const Vec3& vector) {
  return std::abs(vector.x()) + std::abs(vector.y()) + std::abs(vector.z());
}

bool fail(std::string* why, const char* text) {
  if (why != nullptr) *why = text;
  return false;
}

}  // namespace

void Simulation::openBooks() {
  books_ = {};
  for (std::size_t sphere = 0; sphere < sphereCount(); ++sphere) {
    const Motion& motion = bodies_.motions[sphere];
    const double mass = substances_[sphere].mass;
    books_.momentum += mass * motion.velocity;
    books_.energy += mass * (0.5 * dotInOrder(motion.velocity, motion.velocity) -
                             dotInOrder(bodies_.gravity, motion.position));
  }
}

/// Accounts for a change of velocity at one instant.
void Simulation::book(std::uint32_t sphere, const Vec3& before, const Vec3& after) {
  const Vec3 change = substances_[sphere].mass * (after - before);
  const double work = 0.5 * dotInOrder(change, before + after);
  books_.momentum += change;
  books_.energy += work;
  books_.momentumTurnover += sizeOf(change);
  books_.energyTurnover += sizeOf(change) * (sizeOf(before) + sizeOf(after));
}

/// Accounts for the work of all forces but gravity in the flight that ends with `now`.
void Simulation::bookForces(std::uint32_t sphere, const Motion& now, Books& books) const {
  const Motion& then = bodies_.motions[sphere];
  const Vec3 force = substances_[sphere].mass * (bodies_.accelerations[sphere] - bodies_.gravity);
  const Vec3 impulse = elapsed(then.since, now.since) * force;
  const Vec3 way = now.position - then.position;
  books.momentum += impulse;
  books.energy += dotInOrder(force, way);
  books.momentumTurnover += sizeOf(impulse);
  books.energyTurnover += sizeOf(force) * sizeOf(way);
}

/// Checks a collision of two spheres that nothing else takes part in: momentum must be kept, and
/// their restitution takes `taken` J.
void Simulation::audit(const Pair& pair, const Motion& motion, const Motion& otherMotion,
                       double taken) {
  const Vec3 change = substances_[pair.sphere].mass * (motion.velocity - pair.motion.velocity);
  const Vec3 otherChange =
      substances_[pair.other].mass * (otherMotion.velocity - pair.otherMotion.velocity);
  books_.unbalanced += change + otherChange;
  books_.unexplained +=
      0.5 * (dotInOrder(change, motion.velocity + pair.motion.velocity) +
             dotInOrder(otherChange, otherMotion.velocity + pair.otherMotion.velocity)) +
      taken;
}

bool Simulation::validateBooks(std::string* why) const {
  Books books = books_;
  Vec3 momentum = Vec3::Zero();
  double energy = 0.0;
  double size = 0.0;
  double energySize = 0.0;
  for (std::uint32_t sphere = 0; sphere < sphereCount(); ++sphere) {
    const Motion now = motionAtTime(sphere);
    const double mass = substances_[sphere].mass;
    if (bodies_.accelerations[sphere] != bodies_.gravity) bookForces(sphere, now, books);
    books.momentum += mass * time_ * bodies_.gravity;
    momentum += mass * now.velocity;
    energy += mass * (0.5 * dotInOrder(now.velocity, now.velocity) -
                      dotInOrder(bodies_.gravity, now.position));
    size += mass * (sizeOf(now.velocity) + time_ * sizeOf(bodies_.gravity));
    energySize += mass * (dotInOrder(now.velocity, now.velocity) +
                          sizeOf(bodies_.gravity) * sizeOf(now.position));
  }
  const double allowed = kBookRounding * books.momentumTurnover + kStateRounding * size;
  const double energyAllowed = kBookRounding * books.energyTurnover + kStateRounding * energySize;
  if (!(sizeOf(momentum - books.momentum) <= allowed))
    return fail(why, "momentum is not what its changes add up to");
  if (!(std::abs(energy - books.energy) <= energyAllowed))
    return fail(why, "energy is not what its changes add up to");
  if (!(sizeOf(books.unbalanced) <= allowed)) return fail(why, "collisions have not kept momentum");
  if (!(std::abs(books.unexplained) <= energyAllowed))
    return fail(why, "collisions have changed energy by more than their restitution takes");
  return true;
}

}  // namespace carom::native
