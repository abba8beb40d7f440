// Step 4: the ball is of steel, whatever it weighs.

#include <cstdio>

#include "game.h"
#include <carom/sound.h>

int main() {
  Game game;
  auto sound = carom::Sound::attach(game.world, {.record = "game.wav"});
  if (!sound) return 1;
  if (!sound->assign(game.ball, {.material = "steel"})) return 1;
  for (int frame = 0; frame < 240; ++frame) {
    game.step();
    if (!sound->setListener(game.camera())) return 1;
  }
  for (const btRigidBody* body : {&game.floor, &game.crate, &game.bar, &game.ball}) {
    const auto made = sound->materialOf(*body);
    if (!made) return 1;
    std::printf("%s, %s, %.0f kg/m3\n", made->material.name.c_str(),
                made->isGuessed ? "guessed" : "assigned", made->density);
  }
  return sound->close() ? 0 : 1;
}
