// Step 6: the loudest collision, in the program and, by the run that it keeps, outside of it.

#include <cstdio>

#include "game.h"
#include <carom/sound.h>

int main() {
  Game game;
  auto sound = carom::Sound::attach(game.world);
  if (!sound || !sound->recordRun("game.carom")) return 1;

  carom::SoundCollision loudest;
  const auto compare = [&](const carom::SoundCollision& hit) {
    if (hit.peak > loudest.peak) loudest = hit;
  };
  if (!sound->onCollision(compare)) return 1;

  for (int frame = 0; frame < 240; ++frame) {
    game.step();
    if (!sound->setListener(game.camera())) return 1;
  }
  if (!sound->close()) return 1;
  const bool crate = loudest.body == &game.crate || loudest.other == &game.crate;
  std::printf("loudest: %s at %.6f s, %.2f m/s, %.2f N s, at most %.2f Pa\n",
              crate ? "the crate" : "not the crate", loudest.time, loudest.approachSpeed,
              loudest.impulse, loudest.peak);
  return 0;
}
