// A program with the world of old_bullet.h: prints how often it was stepped.

#include <cstdio>

#include "tests/plugin/listen/old_bullet.h"

int main() {
  constexpr float kStep = 1.0F / 60.0F;
  auto* const world = new btDiscreteDynamicsWorld;
  int steps = 0;
  for (int frame = 0; frame < 3; ++frame)
    steps = world->stepSimulation(kStep, 1, kStep);
  delete world;
  std::printf("%d steps\n", steps);
  return 0;
}
