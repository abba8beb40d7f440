// Step 2: three lines, and it is heard: game.wav.

#include <cstdio>

#include "game.h"
#include <carom/sound.h>

int main() {
  Game game;
  auto sound = carom::Sound::attach(game.world, {.record = "game.wav"});
  for (int frame = 0; frame < 240; ++frame)
    game.step();
  if (sound) std::puts(sound->report().c_str());
  if (!sound || !sound->close()) return 1;
  return 0;
}
