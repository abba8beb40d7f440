// Stiff and extreme cases of Bullet worlds, by the events of the bridge. Bullet itself computes in
// float here unless it is built otherwise: bounds count in steps of float numbers.

#include <cmath>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "lab/stability/stability_cases.h"

#include "carom/bullet/bullet_bridge.h"
#include "scenes/run/bullet_scene.h"

namespace carom::lab {

using namespace scenes;
namespace {

using Measurements = std::vector<Measurement>;

constexpr double kEarth = 9.81;        // m/s^2
constexpr double kStep = 1.0 / 240.0;  // s
constexpr double kFloat = 0x1p-23;     // relative spacing of float numbers

template <class Shape>
SceneBody bodyOf(const Shape& shape, double restitution) {
  SceneBody body;
  body.material = {.name = "any",
                   .density = 1000.0,
                   .youngsModulus = 1e9,
                   .poissonsRatio = 0.3,
                   .restitution = restitution};
  body.shape = shape;
  return body;
}

SceneBody ballOf(const SphereShape& sphere, double restitution = 1.0) {
  return bodyOf(sphere, restitution);
}

SceneBody floorOf(double restitution = 1.0) {
  return bodyOf(PlaneShape{}, restitution);
}

SceneBody blockOf(const Vec3& centre, const Vec3& halfExtents, double restitution) {
  return bodyOf(BlockShape{.centre = centre, .halfExtents = halfExtents}, restitution);
}

/// A Bullet world with the bridge attached.
class Run {
 public:
  explicit Run(std::vector<SceneBody> bodies, double gravity = 0.0, double step = kStep)
      : step_(step) {
    Scene scene;
    scene.name = "stability";
    scene.stepper.type = StepperType::bullet;
    scene.stepper.step = step;
    scene.gravity = {0.0, -gravity, 0.0};
    scene.bodies = std::move(bodies);
    scene_ = std::make_unique<BulletScene>(scene);
    bridge_ = std::make_unique<BulletBridge>(
        orThrow(BulletBridge::attach(scene_->world(), {.restSpeed = scene.stepper.restSpeed})));
  }

  void advance(long steps) {
    for (long index = 0; index < steps; ++index)
      scene_->world().stepSimulation(static_cast<btScalar>(step_), 0);
  }
  void advanceFor(double seconds) { advance(std::lround(seconds / step_)); }
  /// Advances by so many steps, and drops the events on the way.
  void idle(long steps) {
    for (long index = 0; index < steps; ++index) {
      advance(1);
      bridge_->clear();
    }
  }

  BulletBridge& bridge() { return *bridge_; }
  std::span<const ImpulseEvent> events() {
    bridge_->flush();
    return bridge_->events();
  }
  Vec3 position(std::size_t body) const {
    return vectorOf(scene_->body(body).getWorldTransform().getOrigin());
  }
  Vec3 velocity(std::size_t body) const { return vectorOf(scene_->body(body).getLinearVelocity()); }
  void push(std::size_t body, const Vec3& velocity) {
    btRigidBody* rigid =
        btRigidBody::upcast(scene_->world().getCollisionObjectArray()[static_cast<int>(body)]);
    rigid->activate(true);
    rigid->setLinearVelocity({static_cast<btScalar>(velocity.x()),
                              static_cast<btScalar>(velocity.y()),
                              static_cast<btScalar>(velocity.z())});
  }
  /// Returns the mean load in N of all lasting contacts of a body since the last clear, over that
  /// time (s).
  double meanLoad(BodyId body, double seconds) const {
    double impulse = 0.0;
    for (const ContactState& contact : bridge_->contacts())
      if (contact.body == body || contact.other == body)
        impulse += contact.normalLoad * contact.duration;
    return impulse / seconds;
  }

 private:
  static Vec3 vectorOf(const btVector3& v) {
    return {static_cast<double>(v.x()), static_cast<double>(v.y()), static_cast<double>(v.z())};
  }

  double step_;
  std::unique_ptr<BulletScene> scene_;  // before the bridge, which it must outlive
  std::unique_ptr<BulletBridge> bridge_;
};

/// A ball that flies to a floor: its event has a closed form.
struct Drop {
  double radius = 0.05;  // m
  double mass = 1.0;     // kg
  double speed = 1.0;    // m/s
  double restitution = 1.0;
  double time = 10.44 * kStep;  // s, of the contact: within a step
};

struct LandingErrors {
  Worst events;   // deviation from the number of one collision
  Worst time;     // in float steps of position over speed, and of time
  Worst impulse;  // relative error

  void look(const Drop& drop) {
    const double gap = drop.speed * drop.time;
    Run run({ballOf({.radius = drop.radius,
                     .mass = drop.mass,
                     .position = {0.0, drop.radius + gap, 0.0},
                     .velocity = {0.0, -drop.speed, 0.0}},
                    drop.restitution),
             floorOf(drop.restitution)});
    run.advance(30);
    const auto heard = run.events();
    events.add(std::abs(static_cast<double>(heard.size()) - 2.0));
    if (heard.empty()) return;
    const double rounding = kFloat * ((drop.radius + gap) / drop.speed + drop.time);
    time.add(std::abs(heard[0].time - drop.time) / rounding);
    // Below 0.2 m/s Bullet does not bounce.
    const double e = drop.speed < 0.2 ? 0.0 : drop.restitution;
    impulse.addShare(heard[0].impulse.norm(), (1.0 + e) * drop.mass * drop.speed);
  }
  Measurements measured() const {
    return {atMost("events_beside_one_collision", events.value(), 0.0),
            atMost("time_error_in_float_steps", time.value(), 16.0),
            atMost("impulse_share", impulse.value(), 1e-5)};
  }
};

Measurements speed(StabilityForm /*form*/) {
  LandingErrors errors;
  for (const double speed : {0.01, 0.1, 1.0, 10.0, 100.0, 1e3, 1e4})
    errors.look({.speed = speed});
  Measurements found = errors.measured();
  double heard = 0.0;
  Worst moved;
  for (const double speed : {1e-9, 1e-6, 1e-3}) {  // rest
    Run run({ballOf({.radius = 0.05,
                     .mass = 1.0,
                     .position = {0.0, 0.05, 0.0},
                     .velocity = {0.0, -speed, 0.0}}),
             floorOf()});
    run.advance(240);
    heard += static_cast<double>(run.events().size());
    moved.add(std::abs(run.position(0).y() - 0.05));
  }
  found.push_back(exactly("events_below_the_speed_of_rest", heard, 0.0));
  found.push_back(atMost("moved_below_the_speed_of_rest", moved.value(), 1e-3, "m"));
  return found;
}

Measurements radius(StabilityForm /*form*/) {
  LandingErrors errors;
  for (const double radius : {1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0, 10.0})
    errors.look({.radius = radius, .mass = 4000.0 * radius * radius * radius});
  return errors.measured();
}

Measurements restitution(StabilityForm /*form*/) {
  LandingErrors errors;
  for (const double e : {0.0, 1e-6, 0.5, 1.0})
    errors.look({.restitution = e});
  return errors.measured();
}

Measurements massRatio(StabilityForm /*form*/) {
  Worst events;
  Worst impulse;
  for (const double ratio : {1.0, 1e3, 1e6, 1e9}) {
    for (const double e : {0.0, 0.5, 1.0}) {
      Run run({ballOf({.radius = 0.05,
                       .mass = 1.0,
                       .position = {0.1435, 0.0, 0.0},
                       .velocity = {-1.0, 0.0, 0.0}},
                      e),
               ballOf({.radius = 0.05, .mass = ratio}, e)});
      run.advance(30);
      const auto heard = run.events();
      events.add(std::abs(static_cast<double>(heard.size()) - 2.0));
      if (heard.empty()) continue;
      impulse.addShare(heard[0].impulse.norm(), (1.0 + e) * ratio / (1.0 + ratio));
    }
  }
  return {atMost("events_beside_one_collision", events.value(), 0.0),
          atMost("impulse_share", impulse.value(), 1e-5)};
}

std::vector<SceneBody> passing(double offset) {
  return {ballOf({.radius = 0.5,
                  .mass = 1.0,
                  .position = {-1.5, offset, 0.0},
                  .velocity = {1.0, 0.0, 0.0}}),
          ballOf({.radius = 0.5, .mass = 1.0})};
}

Measurements grazing(StabilityForm /*form*/) {
  Worst missed;
  Worst touched;
  Worst speeds;
  for (const double depth : {1e-1, 1e-2, 1e-3, 1e-4, 2e-5}) {
    Run inside(passing(1.0 - depth));
    inside.advance(480);
    const auto hits = inside.events();
    // Cosine of the angle between normal and path; half a
    // float step in the offset is the only error.
    const double expected = std::sqrt(depth * (2.0 - depth));
    missed.add(std::abs(static_cast<double>(hits.size()) - 2.0));
    if (!hits.empty())
      speeds.add(std::abs(hits[0].approachSpeed - expected) / (kFloat * (2.0 + 1.0 / expected)));
    Run outside(passing(1.0 + depth));
    outside.advance(480);
    touched.add(static_cast<double>(outside.events().size()));
  }
  return {atMost("hits_missed_or_doubled", missed.value(), 0.0),
          atMost("misses_that_hit", touched.value(), 0.0),
          atMost("approach_speed_error_in_float_steps", speeds.value(), 4.0)};
}

Measurements simultaneous(StabilityForm /*form*/) {
  std::vector<SceneBody> bodies = {floorOf()};
  constexpr int kCount = 64;
  for (int ball = 0; ball < kCount; ++ball)
    bodies.push_back(ballOf({.radius = 0.05,
                             .mass = 1.0,
                             .position = {0.2 * (ball % 8), 0.1, 0.2 * std::floor(ball / 8.0)},
                             .velocity = {0.0, -1.0, 0.0}}));
  Run run(std::move(bodies));
  run.advance(30);
  const auto heard = run.events();
  Worst time;
  Worst impulse;
  for (const ImpulseEvent& event : heard) {
    time.add(std::abs(event.time - 0.05));
    impulse.addShare(event.impulse.norm(), 2.0);
  }
  return {exactly("events", static_cast<double>(heard.size()), 2.0 * kCount),
          atMost("time_error", time.value(), 1e-7, "s"),
          atMost("impulse_share", impulse.value(), 1e-5)};
}

SceneBody boxAt(double half, double mass, double height) {
  SolidShape box;
  box.form = BoxForm{Vec3::Constant(half)};
  box.mass = mass;
  box.inertia = Eigen::Matrix3d::Identity() * (mass * half * half * 2.0 / 3.0);
  box.position = {0.0, height, 0.0};
  SceneBody body = bodyOf(box, 0.0);
  body.contact.friction = 0.5;
  return body;
}

/// A column of boxes on a block.
std::vector<SceneBody> columnOf(int count) {
  std::vector<SceneBody> bodies = {blockOf({0.0, -0.5, 0.0}, {2.0, 0.5, 2.0}, 0.0)};
  bodies[0].contact.friction = 0.5;
  for (int box = 0; box < count; ++box)
    bodies.push_back(boxAt(0.05, 1.0, 0.05 + 0.1 * box));
  return bodies;
}

// A column of boxes, each of which carries those above it. No
// more than three: higher columns creep (docs/stability.md).
Measurements stack(StabilityForm /*form*/) {
  constexpr int kCount = 3;
  Run run(columnOf(kCount), kEarth);
  run.idle(960);
  run.advanceFor(1.0);
  const double load = run.meanLoad(0, 1.0);
  Worst sunk;
  Worst aside;
  for (int box = 0; box < kCount; ++box) {
    const Vec3 place = run.position(static_cast<std::size_t>(box) + 1);
    sunk.add(0.05 + 0.1 * box - place.y());
    aside.add(std::hypot(place.x(), place.z()));
  }
  return {nearly("load_on_the_floor", load, kCount * kEarth, 0.01, "N"),
          atMost("sunk_after_5_s", sunk.value(), 0.001, "m"),
          atMost("aside_after_5_s", aside.value(), 0.01, "m"),
          exactly("events_in_the_last_second", static_cast<double>(run.events().size()), 0.0)};
}

// Balls poured into a box of blocks, without friction: the floor carries them all.
Measurements pile(StabilityForm form) {
  const int side = form == StabilityForm::brief ? 3 : 4;
  const double half = 0.11 * side / 2.0 + 0.02;
  std::vector<SceneBody> bodies = {blockOf({0.0, -0.5, 0.0}, {2.0, 0.5, 2.0}, 0.3)};
  for (const double sign : {1.0, -1.0}) {
    bodies.push_back(blockOf({sign * (half + 0.5), 2.0, 0.0}, {0.5, 2.0, 2.0}, 0.3));
    bodies.push_back(blockOf({0.0, 2.0, sign * (half + 0.5)}, {2.0, 2.0, 0.5}, 0.3));
  }
  const std::size_t first = bodies.size();
  const int count = side * side * side;
  for (int ball = 0; ball < count; ++ball) {
    const int row = ball / side;
    const int layer = row / side;
    const Vec3 place((ball % side - 0.5 * (side - 1)) * 0.11 + 0.001 * (layer % 2),
                     0.06 + 0.12 * layer, (row % side - 0.5 * (side - 1)) * 0.11);
    bodies.push_back(ballOf({.radius = 0.05, .mass = 0.5, .position = place}, 0.3));
  }
  Run run(std::move(bodies), kEarth);
  run.idle(1920);
  run.advanceFor(2.0);
  Worst sunk;
  Worst overlap;
  for (int ball = 0; ball < count; ++ball) {
    const Vec3 place = run.position(first + static_cast<std::size_t>(ball));
    sunk.add(0.05 - place.y());
    for (int other = 0; other < ball; ++other)
      overlap.add(0.1 - (place - run.position(first + static_cast<std::size_t>(other))).norm());
  }
  return {nearly("load_on_the_floor", run.meanLoad(0, 2.0), 0.5 * kEarth * count, 0.02, "N"),
          atMost("sunk_into_the_floor", sunk.value(), 0.005, "m"),
          atMost("deepest_overlap", overlap.value(), 0.005, "m")};
}

// A host that runs for a day: checks the clock, and a collision at its end.
Measurements day(StabilityForm form) {
  constexpr double kCoarse = 0.1;  // s, rounded to btScalar
  const double seconds = form == StabilityForm::brief ? 3600.0 : 86400.0;
  Run run({ballOf({.radius = 0.05, .mass = 1.0, .position = {0.0, 0.5, 0.0}}), floorOf()}, 0.0,
          kCoarse);
  const auto steps = std::lround(seconds / kCoarse);
  run.idle(steps);
  const double clock = static_cast<double>(static_cast<btScalar>(kCoarse));
  const long double expected = static_cast<long double>(steps) * static_cast<long double>(clock);
  const double drift = std::abs(static_cast<double>(run.bridge().time() - expected));
  run.push(0, {0.0, -1.0, 0.0});
  run.advance(20);
  const auto heard = run.events();
  const double late =
      heard.empty() ? seconds : heard[0].time - static_cast<double>(expected) - 0.45;
  return {atMost("clock_error", drift, 1e-9, "s"),
          exactly("events", static_cast<double>(heard.size()), 2.0),
          atMost("time_error_of_a_touch_then", std::abs(late), 1e-7, "s")};
}

// Balls so fast that Bullet finds them on one side of each
// other in a step, and on the other in the next.
Measurements tunnelling(StabilityForm /*form*/) {
  Worst doubled;
  Worst time;
  double told = 0.0;
  double balls = 0.0;
  for (const double speed : {50.0, 1e3, 1e4}) {
    for (const double phase : {0.1, 0.35, 0.6, 0.85}) {
      const double touch = (10.0 + phase) * kStep;
      Run run({ballOf({.radius = 0.05,
                       .mass = 1.0,
                       .position = {-0.1 - speed * touch, 0.0, 0.0},
                       .velocity = {speed, 0.0, 0.0}}),
               ballOf({.radius = 0.05, .mass = 1.0})});
      run.advance(30);
      const auto heard = run.events();
      balls += 1.0;
      if (heard.size() > 2) doubled.add(static_cast<double>(heard.size()) - 2.0);
      if (heard.empty()) continue;
      told += 1.0;
      time.add(std::abs(heard[0].time - touch));
    }
  }
  return {atMost("told_twice", doubled.value(), 0.0), exactly("share_told", told / balls, 1.0),
          atMost("time_error_of_what_is_told", time.value(), 1e-6, "s")};
}

// Values that a host may give to Bullet by mistake.
Measurements nonsense(StabilityForm /*form*/) {
  Worst odd;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinite = std::numeric_limits<double>::infinity();
  for (const double value : {nan, infinite, -infinite, 1e30}) {
    Run run({ballOf({.radius = 0.05, .mass = 1.0, .position = {0.0, 0.5, 0.0}}), floorOf()},
            kEarth);
    run.advance(2);
    run.push(0, {value, -1.0, 0.0});
    run.advance(240);
    double notFinite = 0.0;
    for (const ImpulseEvent& event : run.events())
      if (!std::isfinite(event.time) || !event.impulse.allFinite()) notFinite += 1.0;
    for (const ContactState& contact : run.bridge().contacts())
      if (!std::isfinite(contact.normalLoad)) notFinite += 1.0;
    odd.add(notFinite);
  }
  const Scene empty;
  BulletScene world(empty);
  double attached = 0.0;
  for (const double value : {nan, infinite, -1.0})
    if (BulletBridge::attach(world.world(), {.restSpeed = value})) attached += 1.0;
  return {exactly("events_that_are_not_finite", odd.value(), 0.0),
          exactly("settings_taken", attached, 0.0)};
}

}  // namespace

void addBulletCases(std::vector<StabilityCase>& cases) {
  const std::string landing =
      "gap over speed, within a step, to the precision of float; an impulse of (1 + e) m v, once";
  const std::vector<StabilityCase> all = {
      {"bullet.speed", "speed", "balls fly to a floor at 0.01 to 1e4 m/s, and at 1e-9 to 1e-3 m/s",
       landing + "; below the speed of rest nothing", speed},
      {"bullet.radius", "radius", "balls of 10 um to 10 m fly to a floor at 1 m/s", landing,
       radius},
      {"bullet.restitution", "restitution", "balls of restitution 0 to 1 fly to a floor", landing,
       restitution},
      {"bullet.mass_ratio", "mass ratio", "head-on collisions of mass ratios 1 to 1e9",
       "an impulse of (1 + e) m M / (m + M) v, once", massRatio},
      {"bullet.grazing", "grazing",
       "a ball passes another off its centre by 1 -+ 0.1 to 2e-5 of the sum of their radii",
       "inside it touches at v sqrt(1 - b^2), outside it does not", grazing},
      {"bullet.simultaneous", "simultaneous contacts", "64 balls land at one instant",
       "each is told, at that instant, with 2 m v", simultaneous},
      {"bullet.stack", "stacks and piles", "a column of three boxes for 5 s",
       "the floor bears all weights; nothing sinks or is heard, nor goes aside by a tenth of an "
       "edge",
       stack},
      {"bullet.pile", "stacks and piles", "27 balls (full: 64) poured into a box, without friction",
       "the floor bears all weights; nothing sinks or overlaps by more than a tenth of a radius",
       pile},
      {"bullet.day", "24 hours", "an hour (full: a day) of steps, then a touch",
       "the clock is the sum of all steps; the touch is where gap over speed puts it", day},
      {"bullet.tunnelling", "speed", "a ball flies at another at 50 to 1e4 m/s, up to 42 m a step",
       "told once, at gap over speed, though Bullet itself sees nothing", tunnelling},
      {"bullet.nonsense", "nonsense", "velocities that are no numbers, infinite, or 1e30 m/s",
       "no event that is not finite", nonsense},
  };
  cases.insert(cases.end(), all.begin(), all.end());
}

}  // namespace carom::lab
