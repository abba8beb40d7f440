#include "scenes/plan.h"

#include <algorithm>
#include <utility>

namespace carom {
namespace {

class PlanBuilder {
 public:
  void stage(std::string name, bool needed, std::string whyNot) {
    if (needed) {
      plan_.needed.push_back(std::move(name));
    } else {
      plan_.leftOut.push_back({std::move(name), std::move(whyNot)});
    }
  }
  Plan take() { return std::move(plan_); }

 private:
  Plan plan_;
};

}  // namespace

Plan makePlan(const Scene& scene) {
  const auto spheres = std::count_if(
      scene.bodies.begin(), scene.bodies.end(),
      [](const SceneBody& body) { return std::holds_alternative<SphereShape>(body.shape); });
  const bool planes = static_cast<std::size_t>(spheres) < scene.bodies.size();
  const bool bullet = scene.stepper.type == StepperType::bullet;

  PlanBuilder plan;
  plan.stage("native_stepper", !bullet, "the scene runs on Bullet");
  plan.stage("bullet_world", bullet, "the scene runs on the native stepper");
  plan.stage("bullet_bridge", bullet, "the native stepper's events are exact as they are");
  plan.stage("gravity", !scene.gravity.isZero(0.0), "gravity is zero: paths are straight lines");
  plan.stage("sphere_sphere_contacts", spheres > 1, "there is only one sphere");
  plan.stage("sphere_plane_contacts", planes, "there is no plane");
  plan.stage("acceleration_noise", true, "");
  plan.stage("acceleration_noise_of_planes", false,
             planes ? "planes are immovable: no impulse accelerates them" : "there is no plane");
  return plan.take();
}

}  // namespace carom
