#include "scenes/run/scene_stepper.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "carom/bullet/bullet_bridge.h"
#include "scenes/run/bullet_only.h"
#include "scenes/run/bullet_scene.h"
#include "scenes/run/jello_scene.h"
#include "scenes/run/native_only.h"

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

class BulletSceneStepper : public LiveStepper {
 public:
  BulletSceneStepper(std::unique_ptr<BulletScene> scene, BulletBridge bridge,
                     const Scene& described)
      : scene_(std::move(scene)),
        bridge_(std::move(bridge)),
        step_(described.stepper.step),
        gravity_(described.gravity),
        bodies_(movingBodies(described)),
        followed_(movingRings(described)),
        stepsPerPose_(static_cast<std::int64_t>(std::ceil(kLeastPoseStep / step_))) {
    keepPoses();
  }

  std::span<const ImpulseEvent> advanceTo(double time) override {
    bridge_.clear();
    if (steps_ > 0) poses_.clear();  // the first ones are of the start
    while (bridge_.settledTime() < time &&
           mayGoOn(bridge_.settledTime())) {  // with blocks, a substep behind the clock
      if (pull_) draw();
      scene_->world().stepSimulation(static_cast<btScalar>(step_), 0);
      if (++steps_ % stepsPerPose_ == 0) keepPoses();
    }
    count(bridge_.events(), bridge_.settledTime());
    contacts_.assign(bridge_.contacts().begin(), bridge_.contacts().end());
    if (!scene_->hasTurnedFrames()) return bridge_.events();
    for (ContactState& contact : contacts_)
      turn(contact);
    return inFramesOfTheScene(bridge_.events());
  }
  std::span<const ContactState> contacts() const override { return contacts_; }
  bool reportsContacts() const override { return true; }
  std::span<const BodyPose> poses() const override { return poses_; }
  void showAll() override {
    followed_ = std::move(bodies_);
    poses_.clear();
    keepPoses();
  }
  double settledTime() const override { return bridge_.settledTime(); }

  double headTime() const override { return static_cast<double>(steps_) * step_; }
  void putState(Scene& scene) const override {
    for (const BodyId id : movingBodies(scene)) {
      const btRigidBody& body = scene_->body(id);
      const Vec3 position = fromBullet(body.getCenterOfMassPosition());
      const Quat orientation =
          scene_->orientation(id, fromBullet(body.getCenterOfMassTransform().getRotation()));
      const auto put = [&](auto& shape) {
        shape.position = position;
        shape.orientation = orientation;
        shape.velocity = fromBullet(body.getLinearVelocity());
        shape.spin = fromBullet(body.getAngularVelocity());
      };
      if (auto* sphere = std::get_if<SphereShape>(&scene.bodies[id].shape)) put(*sphere);
      if (auto* solid = std::get_if<SolidShape>(&scene.bodies[id].shape)) put(*solid);
    }
    moveSurfaces(scene, headTime());
  }
  void push(BodyId id, const Vec3& velocityChange) override {
    btRigidBody& body = scene_->body(id);
    if (body.getInvMass() <= 0) return;
    body.activate(true);
    body.setLinearVelocity(body.getLinearVelocity() + toBullet(velocityChange));
  }
  void pull(const std::optional<Pull>& pull) override { pull_ = pull; }

 private:
  void draw() {
    const btRigidBody& body = scene_->body(pull_->body);
    push(pull_->body,
         pullOf(*pull_,
                {fromBullet(body.getCenterOfMassPosition()), fromBullet(body.getLinearVelocity())},
                gravity_, step_));
  }

  void keepPoses() {
    for (const BodyId id : followed_) {
      const btTransform& transform = scene_->body(id).getCenterOfMassTransform();
      const Quat bullet = fromBullet(transform.getRotation());
      poses_.push_back({id,
                        {static_cast<double>(steps_) * step_, fromBullet(transform.getOrigin()),
                         scene_->orientation(id, bullet)}});
    }
  }

  // Turns a contact from Bullet's frames of the bodies to the scene's: orientations by
  // `orientation`, points of paths, which are in these frames, by its inverse.
  void turn(ContactState& contact) const {
    const Quat axes = scene_->orientation(contact.body, Quat::Identity()).conjugate();
    const Quat otherAxes = scene_->orientation(contact.other, Quat::Identity()).conjugate();
    contact.bodyOrientation = scene_->orientation(contact.body, contact.bodyOrientation);
    contact.otherOrientation = scene_->orientation(contact.other, contact.otherOrientation);
    for (Vec3* point : {&contact.pathStart, &contact.pathEnd})
      *point = axes * *point;
    for (Vec3* point : {&contact.otherPathStart, &contact.otherPathEnd})
      *point = otherAxes * *point;
  }

  std::span<const ImpulseEvent> inFramesOfTheScene(std::span<const ImpulseEvent> events) {
    events_.assign(events.begin(), events.end());
    for (ImpulseEvent& event : events_)
      event.bodyOrientation = scene_->orientation(event.body, event.bodyOrientation);
    return events_;
  }

  std::unique_ptr<BulletScene> scene_;  // before the bridge, which it must outlive
  BulletBridge bridge_;
  std::vector<ContactState> contacts_;  // of the last advanceTo
  std::vector<ImpulseEvent> events_;    // of the last advanceTo, if turned
  double step_;
  Vec3 gravity_;
  std::optional<Pull> pull_;
  std::vector<BodyId> bodies_;
  std::vector<BodyId> followed_;  // whose poses are kept
  std::int64_t stepsPerPose_;
  std::int64_t steps_ = 0;
  std::vector<BodyPose> poses_;  // of the last advanceTo
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
  if (const Status valid = validateForBullet(scene); !valid)
    return Error{scene.name + ": " + valid.error().message};
  auto bulletScene = std::make_unique<BulletScene>(scene);
  // The impulses that Bullet applied are known when it has finished with an impact, some steps
  // after the bodies touch.
  const EventDelivery delivery = scene.sound.impulse == ImpulseChoice::applied
                                     ? EventDelivery::complete
                                     : EventDelivery::prompt;
  Result<BulletBridge> bridge = BulletBridge::attach(
      bulletScene->world(), {.restSpeed = scene.stepper.restSpeed, .delivery = delivery});
  if (!bridge) return Error{scene.name + ": " + bridge.error().message};
  return std::unique_ptr<LiveStepper>(
      new BulletSceneStepper(std::move(bulletScene), *std::move(bridge), scene));
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
