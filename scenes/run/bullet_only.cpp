#include "scenes/run/bullet_only.h"

#include <algorithm>
#include <variant>

#include "scenes/run/jello_scene.h"

namespace carom::scenes {

Status validateForNative(const Scene& scene) {
  const auto body = std::ranges::find_if(scene.bodies, isSolid);
  if (body == scene.bodies.end()) return validateJello(scene);
  const auto& solid = std::get<SolidShape>(body->shape);
  return Error{
      "body \"" + body->name + "\": a " + (solid.canMove() ? "movable" : "solid") + ' ' +
      formName(solid) +
      " needs the bullet stepper; expected \"stepper\": {\"type\": \"bullet\"} in the scene, "
      "or spheres, planes and blocks"};
}

}  // namespace carom::scenes
