// Runs of scenes that would have no end, or take all memory: each ends at a limit, which is named,
// as soon as theory says. A spring at the end of its range.

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <numbers>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "lab/estimate/run_estimate.h"
#include "lab/stability/stability_cases.h"

#include "scenes/limits/machine_memory.h"
#include "scenes/limits/run_guard.h"
#include "scenes/run/scene_stepper.h"

namespace carom::lab {

using namespace scenes;
using namespace native;

namespace {

using Measurements = std::vector<Measurement>;

template <class Shape>
SceneBody bodyOf(const char* name, Shape shape) {
  SceneBody body;
  body.name = name;
  body.pointer = std::string("/bodies/") + name;
  body.material = {.name = "hard",
                   .density = 8000.0,
                   .youngsModulus = 2e11,
                   .poissonsRatio = 0.3,
                   .restitution = 1.0};
  body.shape = std::move(shape);
  return body;
}

Scene sceneFor(double duration) {
  Scene scene;
  scene.name = "stability";
  scene.duration = duration;
  scene.gravity = Vec3::Zero();
  scene.listeners = {{.name = "seat", .position = Vec3::UnitZ()}};
  return scene;
}

/// A ball that flies to and fro in a gap between two planes, without loss.
struct Rattle {
  double gap = 2e-7;     ///< m
  double speed = 100.0;  ///< m/s

  /// Time in s of a collision, the first one at half of the gap.
  double timeOf(double collision) const { return (collision - 0.5) * gap / speed; }
  Scene scene() const {
    constexpr double kRadius = 0.01;  // m
    Scene scene = sceneFor(3600.0);
    scene.bodies = {
        bodyOf("ball", SphereShape{.radius = kRadius,
                                   .mass = 0.03,
                                   .position = {0.0, kRadius + 0.5 * gap, 0.0},
                                   .velocity = {0.0, speed, 0.0}}),
        bodyOf("floor", PlaneShape{.normal = Vec3::UnitY(), .offset = 0.0}),
        bodyOf("lid", PlaneShape{.normal = -Vec3::UnitY(), .offset = -2.0 * kRadius - gap})};
    return scene;
  }
};

/// A ball that swings on a spring about the origin, from 1 m.
Scene swinging(double stiffness, double mass, double duration) {
  Scene scene = sceneFor(duration);
  scene.bodies = {
      bodyOf("ball", SphereShape{.radius = 0.01, .mass = mass, .position = Vec3::UnitX()})};
  scene.mechanics.springs = {{.sphere = 0, .stiffness = stiffness}};
  return scene;
}

Scene stiffJello() {
  JelloShape jello;
  jello.lattice = {.count = 8, .pointMass = 1e-3, .stiffness = 1e12};
  jello.contact.stiffness = 1e12;
  jello.positions = restingPoints(jello.lattice, Vec3::Zero());
  jello.velocities.assign(jello.positions.size(), Vec3::UnitX());
  Scene scene = sceneFor(3600.0);
  scene.bodies = {bodyOf("cube", std::make_shared<const JelloShape>(std::move(jello)))};
  return scene;
}

/// Balls that bounce on a floor in Bullet, without loss.
Scene bouncingOnBullet() {
  Scene scene = sceneFor(1e6);
  scene.stepper.type = StepperType::bullet;
  scene.gravity = {0.0, -9.81, 0.0};
  for (int ball = 0; ball < 8; ++ball)
    scene.bodies.push_back(bodyOf(
        "ball", SphereShape{.radius = 0.05, .mass = 1.0, .position = {0.2 * ball, 0.3, 0.0}}));
  scene.bodies.push_back(bodyOf("floor", PlaneShape{}));
  return scene;
}

struct Ending {
  EndedEarly why;  ///< without a limit if the run came to its end
  std::uint64_t events = 0;
};

/// Runs a scene up to its end, or to the limit that ends it.
Ending endingOf(const Scene& scene, const RunLimits& limits) {
  RunGuard guard(scene, limits);
  Ending ending;
  if (const auto stepper = makeStepper(scene, &guard)) {
    (*stepper)->watch(&guard);
    while (!guard.ended() && (*stepper)->settledTime() < scene.duration &&
           (*stepper)->failure().empty())
      (*stepper)->advanceTo((*stepper)->settledTime() + 1.0);
  } else if (!guard.ended()) {
    throw std::runtime_error(stepper.error().message);
  }
  if (guard.ended()) ending.why = *guard.ended();
  ending.events = guard.events();
  return ending;
}

// ---- Rattles

Measurements rattle(StabilityForm /*form*/) {
  constexpr std::uint64_t kBudget = 100'000;  // events
  Worst endless;
  Worst budget;
  double otherwise = 0.0;
  double asleep = 0.0;
  double expected = 0.0;  // to be put to sleep
  const std::uint64_t before = residentMemory();
  for (const double gap : {2e-9, 2e-8, 2e-7, 2e-6})
    for (const double speed : {10.0, 100.0, 1e4}) {
      const Rattle rattle{gap, speed};
      const Ending ending = endingOf(rattle.scene(), {});
      // After 5000 collisions less than 100 ps apart the ball has no way out, and is put to sleep.
      if (gap / speed < 1e-10) {
        expected += 1.0;
        if (ending.why.limit.empty() && ending.events == 10'000) asleep += 1.0;
        continue;
      }
      if (ending.why.limit != "rattle" || ending.why.pointer != "/bodies/ball") otherwise += 1.0;
      endless.addShare(ending.why.time, rattle.timeOf(RunGuard::kRattle));
      const Ending bounded = endingOf(rattle.scene(), {.events = kBudget});
      if (bounded.why.limit != "events" || bounded.events != kBudget) otherwise += 1.0;
      budget.addShare(bounded.why.time, rattle.timeOf(0.5 * kBudget));
    }
  const double grown = static_cast<double>(residentMemory()) - static_cast<double>(before);
  return {exactly("runs_that_ended_otherwise", otherwise, 0.0),
          exactly("balls_put_to_sleep", asleep, expected),
          atMost("time_of_the_end_without_a_budget_share", endless.value(), 1e-3),
          atMost("time_of_the_end_with_a_budget_share", budget.value(), 1e-3),
          atMost("memory_grown", grown, 200e6, "bytes")};
}

// ---- Limits

/// Counts runs that a limit does not end, or whose sentence does not say what to change.
class Ended {
 public:
  void look(const Scene& scene, const RunLimits& limits, const std::string& limit) {
    const EndedEarly why = endingOf(scene, limits).why;
    runs_ += 1.0;
    if (why.limit != limit || why.what.find("--max-" + limit) == std::string::npos) wrong_ += 1.0;
    // A run may come to its limit of memory before there is an event to name a body.
    if (limit != "memory" && why.pointer.empty()) placeless_ += 1.0;
  }
  Measurements measured(double runs) const {
    return {exactly("runs", runs_, runs), exactly("that_ended_otherwise", wrong_, 0.0),
            exactly("without_a_place", placeless_, 0.0)};
  }

 private:
  double runs_ = 0.0;
  double wrong_ = 0.0;
  double placeless_ = 0.0;
};

Measurements limits(StabilityForm /*form*/) {
  constexpr double kTime = 0.05;                     // s
  constexpr std::uint64_t kAny = 1'000'000'000'000;  // events, which let a rattle go on
  Ended ended;
  for (const Scene& scene : {Rattle{}.scene(), bouncingOnBullet()}) {
    ended.look(scene, {.memory = 1, .events = kAny}, "memory");
    ended.look(scene, {.time = kTime, .events = kAny}, "time");
    ended.look(scene, {.events = 1000}, "events");
  }
  ended.look(stiffJello(), {.time = kTime}, "time");
  ended.look(stiffJello(), {.memory = 1}, "memory");
  // A spring has no events that could name its body.
  const EndedEarly why = endingOf(swinging(1e12, 1.0, 3600.0), {.time = kTime}).why;
  Measurements found = ended.measured(8.0);
  found.push_back(
      exactly("spring_of_1e12_N/m_ended_by_time", why.limit == "time" ? 1.0 : 0.0, 1.0));
  found.push_back(
      exactly("warned_of_before",
              (longRunWarning(estimateRun(swinging(1e12, 1.0, 3600.0))).empty() ? 0.0 : 1.0) +
                  (longRunWarning(estimateRun(stiffJello())).empty() ? 0.0 : 1.0) +
                  (longRunWarning(estimateRun(Rattle{}.scene())).empty() ? 0.0 : 1.0),
              3.0));
  return found;
}

// ---- Springs

// A hundred swings of x'' = -w^2 x: the leapfrog's frequency is off by (w h)^2 / 24.
Measurements springs(StabilityForm /*form*/) {
  Worst place;
  Worst energy;
  for (const double stiffness : {1e-9, 1.0, 1e12})
    for (const double mass : {1e-21, 1.0, 1e18}) {
      const double frequency = std::sqrt(stiffness / mass);  // rad/s
      SphereStepper stepper = orThrow(nativeStepper(swinging(stiffness, mass, 1.0)));
      for (const double turns : {10.0, 100.0}) {
        stepper.advanceTo(2.0 * std::numbers::pi * (turns + 0.1) / frequency);
        place.add(std::abs(stepper.state(0).position.x() - std::cos(0.2 * std::numbers::pi)));
        const double elastic = 0.5 * stiffness * stepper.state(0).position.squaredNorm();
        energy.addShare(stepper.kineticEnergy() + elastic, 0.5 * stiffness);
      }
    }
  return {atMost("place_after_100_swings", place.value(), 1e-3, "m"),
          atMost("energy_share", energy.value(), 1e-4)};
}

}  // namespace

void addRunCases(std::vector<StabilityCase>& cases) {
  const std::vector<StabilityCase> all = {
      {"run.rattle", "limits of runs",
       "a ball of 10 m/s to 10 km/s in a gap of 2 nm to 2 um, without loss, for an hour",
       "it is named an endless rattle, or ends at its budget: after so many times gap over speed, "
       "and takes no memory; where that is less than 100 ps, it is put to sleep",
       rattle},
      {"run.limits", "limits of runs",
       "a rattle, a jello and a spring of 1e12 N/m, and balls on Bullet, for an hour, with limits "
       "of "
       "memory, time and events",
       "each run ends at its limit, which the sentence names with the body; they are warned of "
       "before",
       limits},
      {"run.springs", "stiffness", "springs of 1e-9 to 1e12 N/m with 1e-21 to 1e18 kg",
       "x'' = -w^2 x for 100 swings; energy stays", springs},
  };
  cases.insert(cases.end(), all.begin(), all.end());
}

}  // namespace carom::lab
