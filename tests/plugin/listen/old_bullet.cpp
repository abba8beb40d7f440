#include "tests/plugin/listen/old_bullet.h"

btDiscreteDynamicsWorld::btDiscreteDynamicsWorld() = default;
btDiscreteDynamicsWorld::~btDiscreteDynamicsWorld() = default;

int btDiscreteDynamicsWorld::stepSimulation(float /*timeStep*/, int /*maxSubSteps*/,
                                            float /*fixedTimeStep*/) {
  return ++steps_;
}
