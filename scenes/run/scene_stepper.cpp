#include "scenes/run/scene_stepper.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "scenes/run/bullet_only.h"
#include "scenes/run/bullet_stepper.h"
#include "scenes/run/jello_scene.h"

namespace carom::scenes {
namespace {

/// Returns the contact stiffness of a half-space of the
/// material in Pa, which Simultaneous::hertz uses.
double stiffnessOf(const Material& material) {
  return material.youngsModulus / (1.0 - material.poissonsRatio * material.poissonsRatio);
}

Sphere nativeSphere(BodyId id, const SceneBody& body, const SphereShape& shape) {
  const ContactTraits& contact = body.contact;
  return {.id = id,
          .radius = shape.radius,
          .mass = shape.mass,
          .restitution = body.material.restitution,
          .position = shape.position,
          .velocity = shape.velocity,
          .surface = body.surface,
          .restitutionLaw = contact.restitutionLaw,
          .friction = {.sliding = contact.friction,
                       .rolling = contact.rollingFriction,
                       .pivoting = contact.pivotingFriction,
                       .spin = shape.spin},
          .stiffness = stiffnessOf(body.material)};
}

Plane nativePlane(BodyId id, const SceneBody& body, const PlaneShape& shape) {
  return {.id = id,
          .normal = shape.normal,
          .offset = shape.offset,
          .restitution = body.material.restitution,
          .surface = body.surface,
          .velocity = shape.velocity,
          .oscillation = shape.oscillation,
          .restitutionLaw = body.contact.restitutionLaw,
          .friction = body.contact.friction,
          .stiffness = stiffnessOf(body.material)};
}

Box nativeBox(BodyId id, const SceneBody& body, const BlockShape& shape) {
  return {.id = id,
          .centre = shape.centre,
          .halfExtents = shape.halfExtents,
          .orientation = shape.orientation,
          .restitution = body.material.restitution,
          .surface = body.surface,
          .velocity = shape.velocity,
          .restitutionLaw = body.contact.restitutionLaw,
          .friction = body.contact.friction,
          .stiffness = stiffnessOf(body.material)};
}

/// Turns by a constant spin (rad/s, world frame) for a while (s).
Quat turned(const Quat& orientation, const Vec3& spin, double seconds) {
  const double angle = spin.norm() * seconds;
  if (!(angle > 0.0)) return orientation;
  return (Quat(Eigen::AngleAxisd(angle, spin.normalized())) * orientation).normalized();
}

class NativeSceneStepper : public LiveStepper {
 public:
  NativeSceneStepper(const Scene& scene, SphereStepper stepper)
      : stepper_(std::move(stepper)), gravity_(scene.gravity) {
    const std::vector<BodyId> rings = movingRings(scene);
    const SphereWorld world = sphereWorld(scene);
    for (std::size_t sphere = 0; sphere < world.spheres.size(); ++sphere) {
      const BodyId id = world.spheres[sphere].id;
      // A sphere that rings has the axes of the world, whatever its spin.
      const bool isRing = std::ranges::find(rings, id) != rings.end();
      all_.push_back({sphere, id, !isRing});
      all_.back().orientation = std::get<SphereShape>(scene.bodies[id].shape).orientation;
      all_.back().mass = world.spheres[sphere].mass;
      all_.back().spin = world.spheres[sphere].friction.spin;
      if (isRing) followed_.push_back(all_.back());
    }
  }

  void showAll() override { followed_ = all_; }

  std::span<const ImpulseEvent> advanceTo(double time) override {
    events_.clear();
    poses_.clear();
    // It goes on to a pose, so that what is known does not depend on `time`.
    const double end = followed_.empty() ? time : PoseInstants::from(time);
    while (stepper_.time() < end && events_.size() < kEventsAtATime && mayGoOn(stepper_.time())) {
      const double next = followed_.empty() ? end : std::min(end, instants_.next());
      const auto events = stepper_.advanceTo(next, kEventsAtATime);
      events_.insert(events_.end(), events.begin(), events.end());
      if (stepper_.time() >= instants_.next()) keepPoses();
    }
    count(events_, stepper_.time());
    return events_;
  }
  std::span<const BodyPose> poses() const override { return poses_; }
  double settledTime() const override { return stepper_.time(); }
  std::uint64_t jammed() const override { return stepper_.counters().jammed; }

  double headTime() const override { return stepper_.time(); }
  void putState(Scene& scene) const override {
    for (const FollowedSphere& one : followed_) {
      auto& shape = std::get<SphereShape>(scene.bodies[one.id].shape);
      const SphereState state = stepper_.state(one.sphere);
      shape.position = state.position;
      shape.velocity = state.velocity;
      shape.spin = state.spin;
      shape.orientation = one.orientation;
    }
    moveSurfaces(scene, stepper_.time());
  }
  void push(BodyId body, const Vec3& velocityChange) override {
    for (const FollowedSphere& one : all_)
      if (one.id == body) stepper_.push(one.sphere, one.mass * velocityChange);
  }
  void pull(const std::optional<Pull>& pull) override { pull_ = pull; }

 private:
  struct FollowedSphere {
    std::size_t sphere = 0;  // in SphereWorld::spheres
    BodyId id = 0;
    bool isTurned = false;                // its orientation is followed too, for pictures
    Quat orientation = Quat::Identity();  // at the last pose
    Vec3 spin = Vec3::Zero();             // rad/s, at the last pose
    double mass = 0.0;                    // kg
  };

  void keepPoses() {
    const double since = instants_.next() > 0.0 ? kPoseStep : 0.0;  // s, the last poses
    for (FollowedSphere& one : followed_) {
      const SphereState state = stepper_.state(one.sphere);
      if (one.isTurned) {
        one.orientation = turned(one.orientation, 0.5 * (one.spin + state.spin), since);
        one.spin = state.spin;
      }
      poses_.push_back({one.id, {instants_.next(), state.position, one.orientation}});
    }
    instants_.pass();
    if (pull_) draw();
  }

  /// Draws the body that is pulled until the next poses.
  void draw() {
    for (const FollowedSphere& one : all_) {
      if (one.id != pull_->body) continue;
      const SphereState state = stepper_.state(one.sphere);
      push(one.id, pullOf(*pull_, {state.position, state.velocity}, gravity_, kPoseStep));
    }
  }

  SphereStepper stepper_;
  Vec3 gravity_;
  std::optional<Pull> pull_;
  std::vector<FollowedSphere> all_;
  std::vector<FollowedSphere> followed_;  // whose poses are kept
  PoseInstants instants_;
  std::vector<ImpulseEvent> events_;  // of the last advanceTo
  std::vector<BodyPose> poses_;       // of the last advanceTo
};

}  // namespace

std::vector<BodyId> movingBodies(const Scene& scene) {
  std::vector<BodyId> bodies;
  for (std::size_t index = 0; index < scene.bodies.size(); ++index) {
    const auto* solid = std::get_if<SolidShape>(&scene.bodies[index].shape);
    if (isSphere(scene.bodies[index]) || (solid != nullptr && solid->canMove()))
      bodies.push_back(static_cast<BodyId>(index));
  }
  return bodies;
}

std::vector<BodyId> movingRings(const Scene& scene) {
  std::vector<BodyId> rings = movingBodies(scene);
  std::erase_if(rings, [&](BodyId id) { return !scene.bodies[id].ringing; });
  return rings;
}

SphereWorld sphereWorld(const Scene& scene) {
  SphereWorld world;
  world.gravity = scene.gravity;
  world.restSpeed = scene.stepper.restSpeed;
  world.restitutions = scene.restitutions;
  world.simultaneous = scene.mechanics.simultaneous;
  world.rods = scene.mechanics.rods;
  world.springs = scene.mechanics.springs;
  world.fields = scene.mechanics.fields;
  world.drag = scene.mechanics.drag;
  world.forceStep = scene.mechanics.forceStep;
  for (std::size_t index = 0; index < scene.bodies.size(); ++index) {
    const SceneBody& body = scene.bodies[index];
    const auto id = static_cast<BodyId>(index);
    if (const auto* sphere = std::get_if<SphereShape>(&body.shape)) {
      world.spheres.push_back(nativeSphere(id, body, *sphere));
    } else if (const auto* plane = std::get_if<PlaneShape>(&body.shape)) {
      world.planes.push_back(nativePlane(id, body, *plane));
    } else if (const auto* block = std::get_if<BlockShape>(&body.shape)) {
      world.boxes.push_back(nativeBox(id, body, *block));
    }
  }
  return world;
}

Vec3 pullOf(const Pull& pull, const BodyMotion& motion, const Vec3& gravity, double step) {
  // By the implicit rule, which is stable for any step: v' = v + h (w^2 (p - x - h v') - 2 w v').
  const double rate = pull.rate;
  const Vec3 wanted = rate * rate * (pull.place - motion.position) * step + motion.velocity;
  const Vec3 velocity = wanted / (1.0 + 2.0 * rate * step + rate * rate * step * step);
  return velocity - motion.velocity - step * gravity;
}

void moveSurfaces(Scene& scene, double time) {
  for (SceneBody& body : scene.bodies) {
    if (auto* plane = std::get_if<PlaneShape>(&body.shape)) {
      plane->offset += time * plane->velocity.dot(plane->normal);
      plane->oscillation.phase += 2.0 * std::numbers::pi * plane->oscillation.frequency * time;
    }
    if (auto* block = std::get_if<BlockShape>(&body.shape)) block->centre += time * block->velocity;
  }
}

Result<std::unique_ptr<SceneStepper>> makeStepper(const Scene& scene, RunGuard* guard) {
  Result<std::unique_ptr<LiveStepper>> stepper = makeLiveStepper(scene, guard);
  if (!stepper) return stepper.error();
  return std::unique_ptr<SceneStepper>(*std::move(stepper));
}

Result<std::unique_ptr<LiveStepper>> makeLiveStepper(const Scene& scene, RunGuard* guard) {
  if (scene.stepper.type == StepperType::native && jelloOf(scene) != nullptr) {
    auto stepper = JelloSceneStepper::create(scene, {}, guard);
    if (!stepper) return stepper.error();
    return std::unique_ptr<LiveStepper>(*std::move(stepper));
  }
  if (scene.stepper.type == StepperType::native) {
    Result<SphereStepper> stepper = nativeStepper(scene);
    if (!stepper) return stepper.error();
    return std::unique_ptr<LiveStepper>(new NativeSceneStepper(scene, *std::move(stepper)));
  }
  return bulletStepper(scene);
}

Result<SphereStepper> nativeStepper(const Scene& scene) {
  if (const Status valid = validateForNative(scene); !valid)
    return Error{scene.name + ": " + valid.error().message};
  if (jelloOf(scene) != nullptr)
    return Error{scene.name + ": has a jello; expected a scene without, for this"};
  Result<SphereStepper> stepper = SphereStepper::create(sphereWorld(scene));
  if (!stepper) return Error{scene.name + ": " + stepper.error().message};
  return stepper;
}

Result<std::vector<ImpulseEvent>> sceneEvents(const Scene& scene) {
  Result<std::unique_ptr<SceneStepper>> stepper = makeStepper(scene);
  if (!stepper) return stepper.error();
  std::vector<ImpulseEvent> events;
  while ((*stepper)->settledTime() < scene.duration) {
    const auto known = (*stepper)->advanceTo(scene.duration);
    events.insert(events.end(), known.begin(), known.end());
    if (const std::string failure = (*stepper)->failure(); !failure.empty())
      return Error{scene.name + ": " + failure};
  }
  std::erase_if(events, [&](const ImpulseEvent& event) { return event.time > scene.duration; });
  std::stable_sort(events.begin(), events.end(),
                   [](const ImpulseEvent& a, const ImpulseEvent& b) { return a.time < b.time; });
  return events;
}

}  // namespace carom::scenes
