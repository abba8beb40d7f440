#include "native/spheres/rest_tracker.h"

#include <algorithm>

#include "native/math/vector_math.h"

namespace carom::native {
namespace {

// These constants define rest, too, and are documented in SphereStepper.
constexpr double kFirstHops = 10.0;           ///< hops of kLeastHopTime that a sphere has unpaid
constexpr double kCollapseInterval = 1e-6;    ///< s, a shorter interval between contacts is rapid
constexpr std::uint16_t kCollapseRun = 1000;  ///< rapid contacts in a row that are a collapse
constexpr std::uint16_t kJamRun = 5000;       ///< rapid contacts in a row that may have no way out
constexpr double kJamInterval = 1e-9;         ///< s, no way out below; moving surfaces give energy
constexpr double kStuckInterval = 1e-10;      ///< s, no way out below, if no surface moves
constexpr double kCollapseRestSpeed = 0.005;  ///< m/s, rest speed of a sphere after a collapse
constexpr double kRestingDrift = 0.25;        ///< relative to the rest speed: slower is at rest
constexpr double kRetryTime = 0.005;          ///< s, between two attempts to sleep

}  // namespace

RestTracker::RestTracker(const Parts& parts, double restSpeed)
    : bodies_(parts.bodies),
      properties_(parts.properties),
      trajectories_(parts.trajectories),
      counters_(parts.counters),
      restSpeed_(restSpeed),
      records_(parts.bodies.count()) {
  const double speed = 0.5 * kLeastHopTime * lengthOf(bodies_.gravity);
  for (std::size_t sphere = 0; sphere < records_.size(); ++sphere) {
    records_[sphere].bounceEnergyBudget =
        kFirstHops * 0.5 * properties_.mass(sphere) * speed * speed;
  }
}

double RestTracker::restSpeed(std::uint32_t sphere) const {
  return records_[sphere].collapsed ? std::max(restSpeed_, kCollapseRestSpeed) : restSpeed_;
}

double RestTracker::restSpeed(std::uint32_t sphere, std::uint32_t other) const {
  return std::max(restSpeed(sphere), restSpeed(other));
}

double RestTracker::contactGap(double radius) const {
  const double speed = std::max(restSpeed_, kCollapseRestSpeed);
  return std::min(0.01 * radius, speed * speed / lengthOf(bodies_.gravity)) + 1e-9 * radius;
}

// ---- Energy of bounces

/// Energy in J with which the sphere takes off at half its rest speed.
double RestTracker::longHopEnergy(std::uint32_t sphere) const {
  const double fastest = restSpeed(sphere);
  return 0.125 * properties_.mass(sphere) * fastest * fastest;
}

void RestTracker::addBounceEnergy(std::uint32_t sphere, double energy) {
  double& budget = records_[sphere].bounceEnergyBudget;
  budget = std::max(budget, std::min(budget + energy, longHopEnergy(sphere)));
}

bool RestTracker::payForBounce(std::uint32_t sphere, double energy) {
  double& budget = records_[sphere].bounceEnergyBudget;
  if (energy > budget) return false;
  budget -= energy;
  return true;
}

bool RestTracker::payForBounce(std::uint32_t sphere, std::uint32_t other, double energy) {
  double& budget = records_[sphere].bounceEnergyBudget;
  double& otherBudget = records_[other].bounceEnergyBudget;
  if (energy > budget + otherBudget) return false;
  const double paid = std::min(energy, budget);
  budget -= paid;
  otherBudget -= energy - paid;
  return true;
}

// ---- Contacts

bool RestTracker::recordContact(std::uint32_t sphere, const Motion& motion) {
  if (bodies_.isAsleep(sphere)) return false;
  recordPlace(sphere, motion.position);
  Record& record = records_[sphere];
  const double interval = elapsed(bodies_.motions[sphere].since, trajectories_.now());
  const bool rapid = interval < kCollapseInterval;
  record.rapidContacts = rapid ? static_cast<std::uint16_t>(record.rapidContacts + 1) : 0;
  if (!rapid || record.rapidContacts % kCollapseRun != 0) return false;
  collapse(sphere, interval);
  return true;
}

/// Begins a new rest if the sphere has left its resting place. Linked spheres never rest.
void RestTracker::recordPlace(std::uint32_t sphere, const Vec3& position) {
  Record& record = records_[sphere];
  const Vec3 moved = position - record.restingPlace;
  const double drift = kRestingDrift * restSpeed(sphere) * kRestingTime;
  const bool resting = record.restingSince != kNever && dotInOrder(moved, moved) <= drift * drift;
  if (resting || trajectories_.isLinked(sphere)) return;
  record.restingSince = trajectories_.now().seconds;
  record.restingPlace = position;
}

/// Raises the rest speed of the sphere, whose last contact is `interval` s ago, and lets it hop
/// once without payment.
void RestTracker::collapse(std::uint32_t sphere, double interval) {
  ++counters_.collapses;
  Record& record = records_[sphere];
  record.collapsed = true;
  record.bounceEnergyBudget = longHopEnergy(sphere);
  if (record.rapidContacts != kJamRun) return;
  record.rapidContacts = kJamRun - kCollapseRun;
  giveUp(sphere, interval);
}

/// Gives up a sphere whose contacts leave it no time between them, the last one `interval` s,
/// though it has been stopped. If surfaces move or it is linked, it is jammed: nothing touches it
/// any more. Otherwise it is put to sleep.
void RestTracker::giveUp(std::uint32_t sphere, double interval) {
  const bool pressed = std::ranges::any_of(
      bodies_.walls, [](const Wall& wall) { return wall.speed != 0.0 || wall.oscillates(); });
  if (interval >= (pressed ? kJamInterval : kStuckInterval)) return;
  const bool linked = trajectories_.isLinked(sphere);
  if (pressed || linked) {
    ++counters_.jammed;
    trajectories_.removeFromContacts(sphere);
  } else {
    ++counters_.putToSleep;
  }
  trajectories_.setAsleep(sphere, !linked);  // it stays where it is
}

void RestTracker::stop(std::uint32_t sphere, Motion& motion) {
  if (bodies_.gravity == Vec3::Zero()) return;
  motion.velocity.setZero();
  records_[sphere].restingSince = trajectories_.now().seconds - kRestingTime;
}

double RestTracker::restingTime(std::uint32_t sphere) const {
  return trajectories_.now().seconds - records_[sphere].restingSince;
}

void RestTracker::postponeSleep(std::uint32_t sphere) {
  records_[sphere].restingSince = trajectories_.now().seconds - kRestingTime + kRetryTime;
}

}  // namespace carom::native
