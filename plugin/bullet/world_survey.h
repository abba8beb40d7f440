#pragma once

#include <cstddef>
#include <vector>

#include "plugin/bullet/listener_placement.h"

class btCollisionObject;
class btDynamicsWorld;

namespace carom::plugin {

// A Bullet world as the placement of a listener sees it. [simulation thread]

struct WorldSurvey {
  std::vector<PlacementBody> movable;
  PlacementScene scene;  ///< asks the world, which must outlive it
};

/// `metres`: of the world's unit, as everywhere here.
WorldSurvey surveyOf(const btDynamicsWorld& world, double metres);

/// Returns the direction against gravity; +Y where there is none.
Vec3 upOf(const btDynamicsWorld& world);

/// Returns the heaviest rigid bodies that can move, at most `count`.
std::vector<const btCollisionObject*> heaviestBodies(const btDynamicsWorld& world,
                                                     std::size_t count);

/// Returns the speed (m/s) at which a body lands on what is below it, from its height and speed; 0
/// if it lies already.
double speedOfLanding(const btDynamicsWorld& world, const btCollisionObject& object, double metres);

}  // namespace carom::plugin
