#pragma once

/// The world of a Bullet that is not the one for which Carom was compiled.
class __attribute__((visibility("default"))) btDiscreteDynamicsWorld {
 public:
  btDiscreteDynamicsWorld();
  virtual ~btDiscreteDynamicsWorld();
  virtual int stepSimulation(float timeStep, int maxSubSteps, float fixedTimeStep);

 private:
  int steps_ = 0;
};
