#include "native/scheduling/bodies.h"

namespace carom::native {
namespace {

constexpr double kLevel = 1e-15;  ///< relative to gravity: below it a plane is parallel to gravity

Wall wallOf(const Plane& plane) {
  return {plane,
          dotInOrder(plane.normal, plane.velocity),
          {dotInOrder(plane.normal, plane.oscillation.amplitude), plane.oscillation.frequency,
           plane.oscillation.phase / kWholeTurn}};
}

/// The face of a box across `axis`, on the side (1 or -1) to which its normal points.
Plane facePlane(const Solid& solid, std::size_t axis, double side) {
  const Box& box = solid.box;
  const Vec3 normal = side * solid.axes[axis];
  const double offset =
      dotInOrder(normal, box.centre) + box.halfExtents[static_cast<Eigen::Index>(axis)];
  Plane plane{box.id, normal, offset, box.restitution, box.surface, box.velocity};
  plane.restitutionLaw = box.restitutionLaw;
  plane.friction = box.friction;
  plane.stiffness = box.stiffness;
  return plane;
}

/// Adds the box, and its faces to the walls.
void addBox(const Box& box, Bodies& bodies) {
  Solid solid{box, columnsOf(box.orientation), lengthOf(box.halfExtents),
              static_cast<std::uint32_t>(bodies.walls.size())};
  for (std::size_t axis = 0; axis < solid.axes.size(); ++axis) {
    for (const double side : {1.0, -1.0}) {
      Wall face = wallOf(facePlane(solid, axis, side));
      face.box = static_cast<std::uint32_t>(bodies.solids.size());
      bodies.walls.push_back(face);
    }
  }
  bodies.solids.push_back(solid);
}

void addWalls(const SphereWorld& world, Bodies& bodies) {
  for (const bool oscillating : {false, true}) {
    for (const Plane& plane : world.planes) {
      const Wall wall = wallOf(plane);
      if (wall.oscillates() == oscillating) bodies.walls.push_back(wall);
    }
    if (!oscillating) bodies.steady = static_cast<std::uint32_t>(bodies.walls.size());
  }
  bodies.faces = static_cast<std::uint32_t>(bodies.walls.size());
  for (const Box& box : world.boxes)
    addBox(box, bodies);
}

}  // namespace

Bodies bodiesOf(const SphereWorld& world, std::span<const std::uint32_t> listed) {
  Bodies bodies;
  bodies.gravity = world.gravity;
  bodies.level = kLevel * lengthOf(world.gravity);
  addWalls(world, bodies);
  const std::size_t count = listed.size();
  bodies.motions.reserve(count);
  bodies.radii.reserve(count);
  bodies.ids.reserve(count);
  for (const std::uint32_t at : listed) {
    const Sphere& sphere = world.spheres[at];
    bodies.motions.push_back({sphere.position, sphere.velocity, Instant{}});
    bodies.radii.push_back(sphere.radius);
    bodies.ids.push_back(sphere.id);
  }
  bodies.accelerations.assign(count, world.gravity);
  bodies.holds.resize(count);
  bodies.asleep.assign(count, 0);
  return bodies;
}

}  // namespace carom::native
