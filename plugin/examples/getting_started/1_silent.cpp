// Step 1: the game as it is, four seconds of it, without a sound.

#include <cstdio>

#include "game.h"

int main() {
  Game game;
  for (int frame = 0; frame < 240; ++frame)
    game.step();
  std::printf("the ball is at a height of %.3f m\n", game.ball.getWorldTransform().getOrigin().y());
  return 0;
}
