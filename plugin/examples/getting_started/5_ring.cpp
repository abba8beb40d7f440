// Step 5: the bar rings. Reads bar.carom_modes, which `carom modes` has made of bar.obj.

#include <cstdio>
#include <memory>

#include "game.h"
#include <carom/audio/modal_model_file.h>
#include <carom/sound.h>

int main() {
  Game game;
  auto sound = carom::Sound::attach(game.world, {.record = "game.wav"});
  if (!sound) return 1;
  if (!sound->assign(game.ball, {.material = "steel"})) return 1;

  auto modes = carom::readModalModel("bar.carom_modes");
  if (!modes) {
    std::fprintf(stderr, "%s\n", modes.error().message.c_str());
    return 1;
  }
  const auto bar = std::make_shared<const carom::ModalModel>(*std::move(modes));
  if (!sound->assign(game.bar, {.modes = bar})) return 1;

  for (int frame = 0; frame < 240; ++frame) {
    game.step();
    if (!sound->setListener(game.camera())) return 1;
  }
  std::printf("%zu modes from %.0f Hz on, excited %llu times\n", bar->modes.size(),
              bar->modes.front().frequency,
              static_cast<unsigned long long>(sound->statistics().rings));
  return sound->close() ? 0 : 1;
}
