// Takes the place of what runs scenes on Bullet in a build without it.

#include <array>
#include <cstdint>
#include <variant>

#include "scenes/run/bullet_stepper.h"
#include "scenes/run/solid_surface.h"

namespace carom::scenes {

Result<std::unique_ptr<LiveStepper>> bulletStepper(const Scene& scene) {
  return Error{
      scene.name +
      ": this build of Carom has no Bullet (CAROM_BULLET is off); expected a scene for the "
      "native stepper"};
}

/// Returns the surface of a box, of which jello has one at rest. Other solids need Bullet to move,
/// and have none here.
SurfaceMesh surfaceOf(const SolidShape& solid) {
  const auto* const box = std::get_if<BoxForm>(&solid.form);
  if (box == nullptr) return {};
  SurfaceMesh surface;
  for (const double z : {-1.0, 1.0})
    for (const double y : {-1.0, 1.0})
      for (const double x : {-1.0, 1.0})
        surface.vertices.push_back(box->halfExtents.cwiseProduct(Vec3(x, y, z)));
  // The corners of each side, counter-clockwise as they are seen from without.
  constexpr std::array<std::array<std::uint32_t, 4>, 6> kSides = {
      {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}};
  for (const auto& [first, second, third, fourth] : kSides) {
    surface.triangles.push_back({first, second, third});
    surface.triangles.push_back({first, third, fourth});
  }
  return surface;
}

}  // namespace carom::scenes
