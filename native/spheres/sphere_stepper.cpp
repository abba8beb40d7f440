#include "carom/native/sphere_stepper.h"

#include <cassert>
#include <cmath>
#include <utility>

#include "carom/native/recording.h"
#include "native/spheres/simulation.h"
#include "native/spheres/world_check.h"

namespace carom {

using namespace native;

Result<SphereStepper> SphereStepper::create(SphereWorld world) {
  Result<SphereWorld> checked = checkedWorld(std::move(world));
  if (!checked) return checked.error();
  return SphereStepper(std::make_unique<native::Simulation>(*checked));
}

SphereStepper::SphereStepper(std::unique_ptr<native::Simulation> simulation)
    : simulation_(std::move(simulation)) {}
SphereStepper::SphereStepper(SphereStepper&& other) noexcept = default;
SphereStepper& SphereStepper::operator=(SphereStepper&& other) noexcept = default;
SphereStepper::~SphereStepper() = default;

std::span<const ImpulseEvent> SphereStepper::advanceTo(double time, std::size_t mostEvents) {
  const bool ahead = std::isfinite(time) && time >= simulation_->time();
  assert(ahead && "SphereStepper::advanceTo: time must be finite and not before time()");
  if (!ahead) return {};
  simulation_->advanceTo(time, mostEvents);
  return simulation_->events();
}

void SphereStepper::push(std::size_t sphere, const Vec3& impulse) {
  const bool isOne = sphere < simulation_->sphereCount() && impulse.allFinite();
  assert(isOne && "SphereStepper::push: a sphere, and a finite impulse");
  if (isOne) simulation_->push(sphere, impulse);
}

void SphereStepper::startRecording() {
  simulation_->startRecording();
}

Recording SphereStepper::takeRecording() {
  return simulation_->takeRecording();
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
  return {motion.position, motion.velocity, simulation_->spinOf(sphere)};
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

Status SphereStepper::validate() const {
  return simulation_->validate();
}

}  // namespace carom
