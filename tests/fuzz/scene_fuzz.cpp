#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string_view>
#include <variant>

#include "audio/propagation/pose_track.h"
#include "audio/propagation/reverb.h"
#include "carom/audio/listener.h"
#include "carom/audio/room.h"
#include "scenes/format/scene_loader.h"

namespace {

void require(bool promise) {
  if (!promise) std::abort();
}

/// Requires that one end is a sphere, and the other end another sphere or the anchor.
void requireEnds(const carom::scenes::Scene& scene, carom::BodyId sphere, carom::BodyId other) {
  const auto isSphere = [&](carom::BodyId id) {
    return std::holds_alternative<carom::scenes::SphereShape>(scene.bodies.at(id).shape);
  };
  require(isSphere(sphere) && sphere != other);
  require(other == carom::kAnchor || isSphere(other));
}

void requireSound(const carom::scenes::SolidShape& solid) {
  require(std::abs(solid.orientation.norm() - 1.0) < 1e-12 && solid.mass > 0.0);
  require(solid.position.allFinite() && solid.velocity.allFinite() && solid.spin.allFinite());
  if (!solid.canMove()) return;
  require(solid.inertia.allFinite() && solid.inertia.determinant() > 0.0);
}

void requireSound(const carom::scenes::JelloShape& jello) {
  carom::native::JelloWorld world;
  world.lattice = jello.lattice;
  world.contact = jello.contact;
  world.field = jello.field;
  world.positions = jello.positions;
  world.velocities = jello.velocities;
  require(static_cast<bool>(carom::native::validate(world)) &&
          (jello.integrator || jello.step == 0.0));
}

/// Requires the properties of scenes that a stepper and a renderer rely on without checking them
/// again.
void requireSound(const carom::scenes::Scene& scene) {
  require(scene.duration > 0.0 && scene.sampleRate > 0.0 && scene.gravity.allFinite());
  require(!scene.name.empty() && !scene.listeners.empty());
  std::size_t spheres = 0;
  bool moves = false;
  for (const carom::scenes::SceneBody& body : scene.bodies) {
    require(!body.name.empty() && body.material.density > 0.0);
    if (const auto* sphere = std::get_if<carom::scenes::SphereShape>(&body.shape)) {
      ++spheres;
      moves = true;
      require(sphere->radius > 0.0 && sphere->mass > 0.0 && std::isfinite(sphere->mass));
      require(sphere->position.allFinite() && sphere->velocity.allFinite());
    } else if (const auto* plane = std::get_if<carom::scenes::PlaneShape>(&body.shape)) {
      require(std::abs(plane->normal.norm() - 1.0) < 1e-12 && std::isfinite(plane->offset));
      require(plane->velocity.allFinite() && plane->oscillation.amplitude.allFinite());
    } else if (const auto* block = std::get_if<carom::scenes::BlockShape>(&body.shape)) {
      require(block->halfExtents.minCoeff() > 0.0 && block->centre.allFinite());
      require(std::abs(block->orientation.norm() - 1.0) < 1e-12);
    } else if (const auto* solid = std::get_if<carom::scenes::SolidShape>(&body.shape)) {
      requireSound(*solid);
      moves = moves || solid->canMove();
    } else if (const auto* jello =
                   std::get_if<std::shared_ptr<const carom::scenes::JelloShape>>(&body.shape)) {
      requireSound(**jello);
      moves = true;
    }
  }
  for (const carom::Rod& rod : scene.mechanics.rods)
    requireEnds(scene, rod.sphere, rod.other);
  for (const carom::Spring& spring : scene.mechanics.springs)
    requireEnds(scene, spring.sphere, spring.other);
  for (const carom::Listener& listener : scene.listeners)
    require(static_cast<bool>(carom::validate(listener)));
  for (const carom::scenes::ListenerPath& path : scene.paths) {
    const carom::Listener& listener = scene.listeners.at(path.listener);
    carom::audio::PoseTrack track({0.0, listener.position, listener.orientation});
    for (const carom::ListenerPose& pose : path.poses)
      require(track.append(pose));
    require(track.droppedPoses() == 0);
  }
  const carom::Room& room = scene.sound.room;
  require(room.reflectors.empty() || static_cast<bool>(carom::makeImages(room)));
  require(!scene.sound.reverb ||
          static_cast<bool>(carom::audio::Reverb::create(*scene.sound.reverb, 8000.0, 1)));
  require(moves && spheres <= carom::scenes::SceneLimits::kSpheres);
}

}  // namespace

/// Requires that any bytes give either a sound scene or an error with a message. The files that a
/// scene may name are those of tests/fuzz/scene_files.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto scene = carom::scenes::parseScene(
      text, "fuzz.json",
      {.confined = true,
       .folder = std::filesystem::path(CAROM_SOURCE_DIR) / "tests/fuzz/scene_files"});
  if (scene) {
    requireSound(*scene);
  } else {
    require(std::string_view(scene.error().message).starts_with("fuzz.json: "));
  }
  return 0;
}
