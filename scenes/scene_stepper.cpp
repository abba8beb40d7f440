#include "scenes/scene_stepper.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "bullet_bridge/bullet_bridge.h"
#include "scenes/bullet_scene.h"

namespace carom {
namespace {

SphereWorld sphereWorld(const Scene& scene) {
  SphereWorld world;
  world.gravity = scene.gravity;
  world.restSpeed = scene.stepper.restSpeed;
  world.restitutions = scene.restitutions;
  for (std::size_t index = 0; index < scene.bodies.size(); ++index) {
    const SceneBody& body = scene.bodies[index];
    const auto id = static_cast<BodyId>(index);
    const double restitution = body.material.restitution;
    if (const auto* sphere = std::get_if<SphereShape>(&body.shape)) {
      world.spheres.push_back({id, sphere->radius, sphere->mass, restitution, sphere->position,
                               sphere->velocity, body.surface});
    } else {
      const auto& plane = std::get<PlaneShape>(body.shape);
      world.planes.push_back({id, plane.normal, plane.offset, restitution, body.surface});
    }
  }
  return world;
}

class NativeSceneStepper : public SceneStepper {
 public:
  explicit NativeSceneStepper(SphereStepper stepper) : stepper_(std::move(stepper)) {}

  std::span<const ImpulseEvent> advanceTo(double time) override { return stepper_.advanceTo(time); }
  double settledTime() const override { return stepper_.time(); }

 private:
  SphereStepper stepper_;
};

class BulletSceneStepper : public SceneStepper {
 public:
  BulletSceneStepper(std::unique_ptr<BulletScene> scene, BulletBridge bridge, double step)
      : scene_(std::move(scene)), bridge_(std::move(bridge)), step_(step) {}

  std::span<const ImpulseEvent> advanceTo(double time) override {
    bridge_.clear();
    while (bridge_.time() < time)
      scene_->world().stepSimulation(static_cast<btScalar>(step_), 0);
    return bridge_.events();
  }
  double settledTime() const override { return bridge_.settledTime(); }

 private:
  std::unique_ptr<BulletScene> scene_;  // before the bridge: it must outlive it
  BulletBridge bridge_;
  double step_;
};

}  // namespace

Result<std::unique_ptr<SceneStepper>> makeStepper(const Scene& scene) {
  if (scene.stepper.type == StepperType::native) {
    Result<SphereStepper> stepper = nativeStepper(scene);
    if (!stepper) return stepper.error();
    return std::unique_ptr<SceneStepper>(new NativeSceneStepper(*std::move(stepper)));
  }
  auto bulletScene = std::make_unique<BulletScene>(scene);
  Result<BulletBridge> bridge = BulletBridge::attach(
      bulletScene->world(),
      {.restSpeed = scene.stepper.restSpeed, .delivery = EventDelivery::prompt});
  if (!bridge) return Error{scene.name + ": " + bridge.error().message};
  return std::unique_ptr<SceneStepper>(
      new BulletSceneStepper(std::move(bulletScene), *std::move(bridge), scene.stepper.step));
}

Result<SphereStepper> nativeStepper(const Scene& scene) {
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
  }
  std::erase_if(events, [&](const ImpulseEvent& event) { return event.time > scene.duration; });
  std::stable_sort(events.begin(), events.end(),
                   [](const ImpulseEvent& a, const ImpulseEvent& b) { return a.time < b.time; });
  return events;
}

}  // namespace carom
