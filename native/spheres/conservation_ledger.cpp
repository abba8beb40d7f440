#include "native/spheres/conservation_ledger.h"

#include <cmath>

#include "native/math/vector_math.h"

namespace carom::native {
namespace {

constexpr double kTurnoverRounding = 1e-12;  ///< allowed error, relative to the turnover
constexpr double kStateRounding = 1e-11;     ///< allowed error, relative to momentum or energy
/// Rounding of a coordinate over kTurnoverRounding: a way is the difference of two coordinates, so
/// its error may exceed its size where a stiff force has short steps.
constexpr double kCoordinateRounding = 0x1p-52 / kTurnoverRounding;

double sizeOf(const Vec3& vector) {
  return std::abs(vector.x()) + std::abs(vector.y()) + std::abs(vector.z());
}

}  // namespace

void ConservationLedger::open() {
  sums_ = {};
  for (std::size_t sphere = 0; sphere < bodies_.count(); ++sphere) {
    const Motion& motion = bodies_.motions[sphere];
    const double mass = properties_.mass(sphere);
    sums_.momentum += mass * motion.velocity;
    sums_.energy += mass * (0.5 * dotInOrder(motion.velocity, motion.velocity) -
                            dotInOrder(bodies_.gravity, motion.position));
  }
}

void ConservationLedger::recordChange(std::uint32_t sphere, const Vec3& before, const Vec3& after) {
  const Vec3 change = properties_.mass(sphere) * (after - before);
  const double work = 0.5 * dotInOrder(change, before + after);
  sums_.momentum += change;
  sums_.energy += work;
  sums_.momentumTurnover += sizeOf(change);
  sums_.energyTurnover += sizeOf(change) * (sizeOf(before) + sizeOf(after));
}

/// Adds the impulse and work of all forces but gravity in the flight that ends with `now`.
void ConservationLedger::addForces(std::uint32_t sphere, const Motion& now, Sums& sums) const {
  const Motion& then = bodies_.motions[sphere];
  const Vec3 force = properties_.mass(sphere) * (bodies_.accelerations[sphere] - bodies_.gravity);
  const Vec3 impulse = elapsed(then.since, now.since) * force;
  const Vec3 way = now.position - then.position;
  sums.momentum += impulse;
  sums.energy += dotInOrder(force, way);
  sums.momentumTurnover += sizeOf(impulse);
  sums.energyTurnover += sizeOf(force) * (sizeOf(way) + kCoordinateRounding * sizeOf(now.position));
}

void ConservationLedger::recordCollision(const PairCollision& collision) {
  const Vec3 change = properties_.mass(collision.sphere) * (collision.after - collision.before);
  const Vec3 otherChange =
      properties_.mass(collision.other) * (collision.otherAfter - collision.otherBefore);
  sums_.unbalanced += change + otherChange;
  sums_.unexplained +=
      0.5 * (dotInOrder(change, collision.after + collision.before) +
             dotInOrder(otherChange, collision.otherAfter + collision.otherBefore)) +
      collision.taken;
}

/// The sums with the shares of gravity and of the flights that have not ended at `time` s.
ConservationLedger::Sums ConservationLedger::expectedAt(double time) const {
  Sums sums = sums_;
  for (std::uint32_t sphere = 0; sphere < bodies_.count(); ++sphere) {
    if (bodies_.accelerations[sphere] != bodies_.gravity)
      addForces(sphere, bodies_.at(sphere, {time, 0.0}), sums);
    sums.momentum += properties_.mass(sphere) * time * bodies_.gravity;
  }
  return sums;
}

ConservationLedger::Present ConservationLedger::presentAt(double time) const {
  Present present;
  for (std::uint32_t sphere = 0; sphere < bodies_.count(); ++sphere) {
    const Motion now = bodies_.at(sphere, {time, 0.0});
    const double mass = properties_.mass(sphere);
    present.momentum += mass * now.velocity;
    present.energy += mass * (0.5 * dotInOrder(now.velocity, now.velocity) -
                              dotInOrder(bodies_.gravity, now.position));
    present.momentumSize += mass * (sizeOf(now.velocity) + time * sizeOf(bodies_.gravity));
    present.energySize += mass * (dotInOrder(now.velocity, now.velocity) +
                                  sizeOf(bodies_.gravity) * sizeOf(now.position));
  }
  return present;
}

Status ConservationLedger::checkConservation(double time) const {
  const Sums sums = expectedAt(time);
  const Present present = presentAt(time);
  const double allowed =
      kTurnoverRounding * sums.momentumTurnover + kStateRounding * present.momentumSize;
  const double energyAllowed =
      kTurnoverRounding * sums.energyTurnover + kStateRounding * present.energySize;
  if (!(sizeOf(present.momentum - sums.momentum) <= allowed))
    return Error{"momentum is not what its changes add up to"};
  if (!(std::abs(present.energy - sums.energy) <= energyAllowed))
    return Error{"energy is not what its changes add up to"};
  if (!(sizeOf(sums.unbalanced) <= allowed)) return Error{"collisions have not kept momentum"};
  if (!(std::abs(sums.unexplained) <= energyAllowed))
    return Error{"collisions have changed energy by more than their restitution takes"};
  return std::monostate{};
}

}  // namespace carom::native
