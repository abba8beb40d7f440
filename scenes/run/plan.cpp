#include "scenes/run/plan.h"

#include <algorithm>
#include <utility>

#include "scenes/run/native_only.h"
#include "scenes/run/scene_sound.h"

namespace carom::scenes {

using namespace native;

namespace {

class PlanBuilder {
 public:
  void stage(std::string name, bool needed, std::string reason) {
    if (needed) {
      plan_.needed.push_back(std::move(name));
    } else {
      plan_.leftOut.push_back({std::move(name), std::move(reason)});
    }
  }
  Plan take() { return std::move(plan_); }

 private:
  Plan plan_;
};

std::string reasonForNoImages(const Scene& scene, bool planes) {
  if (!planes) return "there is no plane that could reflect";
  const Room& room = scene.sound.room;
  if (room.reflectors.empty()) return "the scene has no room: its planes do not reflect sound";
  return "the room's order is 0";
}

/// Adds the stages from the clicks to the listeners' channels.
void addSound(const Scene& scene, bool planes, PlanBuilder& plan) {
  const SynthSettings& sound = scene.sound;
  const bool binaural = std::ranges::any_of(scene.listeners, [](const Listener& listener) {
    return listener.format == ListenerFormat::binaural;
  });
  plan.stage("radiation", sound.comparison.radiation == Radiation::exact,
             "bodies are taken as compact: small beside every wavelength");
  plan.stage("doppler", sound.doppler, "switched off: distances stand still while a contact lasts");
  plan.stage("moving_listeners", !scene.paths.empty(), "no listener has a path");
  plan.stage("images", imageCount(scene) > 0, reasonForNoImages(scene, planes));
  plan.stage("binaural", binaural, "no listener is binaural");
  plan.stage(
      "late_reverberation", sound.reverb.has_value(),
      sound.room.reflectors.empty() ? "the scene has no room: open air" : "the room has no reverb");
}

template <class Shape>
bool has(const Scene& scene) {
  return std::ranges::any_of(scene.bodies, [](const SceneBody& body) {
    return std::holds_alternative<Shape>(body.shape);
  });
}

/// Adds the stages of the contacts between bodies, and of the forces that move them.
void addMechanics(const Scene& scene, bool planes, PlanBuilder& plan) {
  const auto spheres = std::ranges::count_if(scene.bodies, [](const SceneBody& body) {
    return std::holds_alternative<SphereShape>(body.shape);
  });
  const SceneMechanics& mechanics = scene.mechanics;
  const bool forces = !mechanics.rods.empty() || !mechanics.springs.empty() ||
                      !mechanics.fields.empty() || mechanics.drag.rate > 0.0;
  plan.stage("gravity", !scene.gravity.isZero(0.0),
             forces ? "gravity is zero" : "gravity is zero: paths are straight lines");
  plan.stage("forces", forces, "there are no springs, rods, fields and drag");
  const std::string noSphere = "there is no sphere";
  plan.stage("sphere_sphere_contacts", spheres > 1,
             spheres > 0 ? "there is only one sphere" : noSphere);
  plan.stage("sphere_plane_contacts", planes && spheres > 0,
             planes ? noSphere : "there is no plane");
  plan.stage("sphere_block_contacts", has<BlockShape>(scene) && spheres > 0,
             has<BlockShape>(scene) ? noSphere : "there is no block");
  plan.stage("solid_contacts", has<SolidShape>(scene), "there is no solid");
  plan.stage("jello", jelloOf(scene) != nullptr, "there is no jello");
  plan.stage("friction", hasFriction(scene), "no two bodies have friction");
}

}  // namespace

Plan makePlan(const Scene& scene) {
  const bool planes = has<PlaneShape>(scene);
  const bool bullet = scene.stepper.type == StepperType::bullet;
  PlanBuilder plan;
  plan.stage("native_stepper", !bullet, "the scene runs on Bullet");
  plan.stage("bullet_world", bullet, "the scene runs on the native stepper");
  plan.stage("bullet_bridge", bullet, "the native stepper's events are exact as they are");
  addMechanics(scene, planes, plan);
  plan.stage("acceleration_noise", true, "");
  const bool bumps = std::ranges::any_of(scene.bodies, [](const SceneBody& body) {
    return body.normalMap.has_value() || body.material.roughness.rmsHeight > 0.0;
  });
  plan.stage("lasting_contacts", bullet && bumps,
             bullet ? "every body is smooth"
                    : "the native stepper tells of collisions, not of what slides or rolls");
  plan.stage("acceleration_noise_of_planes", false,
             planes ? "planes are immovable: no impulse accelerates them" : "there is no plane");
  const bool rings = std::ranges::any_of(
      scene.bodies, [](const SceneBody& body) { return body.ringing.has_value(); });
  plan.stage("modal_bank", rings, "no body has modes");
  plan.stage("deforming_source", jelloOf(scene) != nullptr, "nothing deforms");
  addSound(scene, planes, plan);
  return plan.take();
}

}  // namespace carom::scenes
