// Step 6: the loudest collision, in the program and, by the run that it keeps, outside of it.

#include <cstdio>

#include "game.h"
#include <carom/sound.h>

int main() {
  Game game;
  auto sound = carom::Sound::attach(game.world);
  if (!sound || !sound->recordRun("game.carom")) return 1;
  game.crate.setUserIndex(1);
  game.bar.setUserIndex(2);
  game.ball.setUserIndex(3);

  carom::SoundCollision loudest;
  int body = 0;
  const auto listen = [&](const carom::SoundCollision& hit) {
    if (hit.peak <= loudest.peak) return;
    loudest = hit;
    body = hit.body ? hit.body->getUserIndex() : 0;
  };
  if (!sound->onCollision(listen)) return 1;

  for (int frame = 0; frame < 240; ++frame) {
    game.step();
    if (!sound->setListener(game.camera())) return 1;
  }
  if (!sound->close()) return 1;
  std::printf("loudest: body %d at %.6f s, %.2f m/s, %.3f N s, at most %.2f Pa\n", body,
              loudest.time, loudest.approachSpeed, loudest.impulse, loudest.peak);
  return 0;
}
