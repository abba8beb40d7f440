#include "scenes/run/bullet_stepper.h"

#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <variant>
#include <vector>

#include "carom/bullet/bullet_bridge.h"
#include "scenes/run/bullet_scene.h"
#include "scenes/run/native_only.h"

namespace carom::scenes {
namespace {

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
    for (ImpulseEvent& event : events_) {
      event.bodyOrientation = scene_->orientation(event.body, event.bodyOrientation);
      event.otherOrientation = scene_->orientation(event.other, event.otherOrientation);
    }
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

Result<std::unique_ptr<LiveStepper>> bulletStepper(const Scene& scene) {
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

}  // namespace carom::scenes
