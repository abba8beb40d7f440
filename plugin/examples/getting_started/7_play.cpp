// Step 7: played while it happens. Four seconds, in real time.

#include <chrono>
#include <cstdio>
#include <thread>

#include "game.h"
#include <carom/sound.h>

int main() {
  Game game;
  auto sound = carom::Sound::attach(game.world, {.play = true});
  if (!sound) return 1;
  if (!sound->assign(game.ball, {.material = "steel"})) return 1;
  auto next = std::chrono::steady_clock::now();
  for (int frame = 0; frame < 240; ++frame) {
    game.step();
    if (!sound->setListener(game.camera())) return 1;
    next += std::chrono::microseconds(16667);  // a game that waits for its display
    std::this_thread::sleep_until(next);
  }
  const carom::SoundStatistics heard = sound->statistics();
  std::printf("%s: %llu clicks, %llu of them too late, %.1f %% of a core\n",
              sound->isPlaying() ? "played" : "no device",
              static_cast<unsigned long long>(heard.events),
              static_cast<unsigned long long>(heard.late), 100 * heard.cpuShare);
  return sound->close() ? 0 : 1;
}
