#include "scenes/run/native_only.h"

#include <algorithm>
#include <cstddef>
#include <utility>
#include <variant>
#include <vector>

namespace carom::scenes {
namespace {

bool isMovingWall(const SceneBody& body) {
  if (const auto* block = std::get_if<BlockShape>(&body.shape)) return !block->velocity.isZero(0.0);
  const auto* plane = std::get_if<PlaneShape>(&body.shape);
  return plane != nullptr && !plane->velocity.isZero(0.0);
}

bool isOscillating(const SceneBody& body) {
  const auto* plane = std::get_if<PlaneShape>(&body.shape);
  return plane != nullptr && !plane->oscillation.amplitude.isZero(0.0);
}

bool hasLaw(const SceneBody& body) {
  return body.contact.restitutionLaw.law != SpeedLaw::constant;
}

bool canMove(const SceneBody& body) {
  const auto* solid = std::get_if<SolidShape>(&body.shape);
  return isSphere(body) || (solid != nullptr && solid->canMove());
}

/// True if two bodies of the scene have friction, and one of those with friction moves.
bool isAnyRough(const Scene& scene, double (*of)(const SceneBody&)) {
  std::size_t rough = 0;
  bool anyMoves = false;
  for (const SceneBody& body : scene.bodies) {
    if (!(of(body) > 0.0)) continue;
    ++rough;
    anyMoves = anyMoves || canMove(body);
  }
  return anyMoves && rough > 1;
}

std::string listed(const std::vector<const char*>& words) {
  std::string text;
  for (std::size_t index = 0; index < words.size(); ++index) {
    if (index > 0) text += index + 1 < words.size() ? ", " : " and ";
    text += words[index];
  }
  return text;
}

}  // namespace

Status validateForBullet(const Scene& scene) {
  const auto any = [&scene](bool (*has)(const SceneBody&)) {
    return std::ranges::any_of(scene.bodies, has);
  };
  const SceneMechanics& mechanics = scene.mechanics;
  const std::pair<bool, const char*> features[] = {
      {jelloOf(scene) != nullptr, "a jello"},
      {any(hasLaw), "restitution laws"},
      {any(isMovingWall), "moving planes or blocks"},
      {any(isOscillating), "oscillating planes"},
      {!mechanics.rods.empty(), "rods"},
      {!mechanics.springs.empty(), "springs"},
      {!mechanics.fields.empty(), "fields"},
      {mechanics.drag.rate > 0.0, "drag"},
      {mechanics.simultaneous == Simultaneous::hertz, "simultaneous contacts by Hertz's forces"}};
  std::vector<const char*> used;
  for (const auto& [has, word] : features) {
    if (has) used.push_back(word);
  }
  if (used.empty()) return std::monostate{};
  return Error{"the scene has " + listed(used) +
               ", which Bullet's stepper cannot do; expected the native stepper"};
}

bool hasFriction(const Scene& scene) {
  return isAnyRough(scene, [](const SceneBody& body) { return body.contact.friction; }) ||
         (std::ranges::any_of(scene.bodies, isSolid) && isAnyRough(scene, frictionWithSolids));
}

}  // namespace carom::scenes
