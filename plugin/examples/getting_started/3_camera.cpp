// Step 3: the listener goes with the camera.

#include <cstdio>

#include "game.h"
#include <carom/sound.h>

int main() {
  Game game;
  auto sound = carom::Sound::attach(game.world, {.record = "game.wav"});
  if (!sound) return 1;
  for (int frame = 0; frame < 240; ++frame) {
    game.step();
    if (!sound->setListener(game.camera())) return 1;
  }
  std::puts(sound->report().c_str());
  return sound->close() ? 0 : 1;
}
