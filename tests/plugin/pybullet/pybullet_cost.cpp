// Cost that the PyBullet plugin adds to a substep of the server stub, by the number of balls that
// drop on a floor and come to rest. Medians over substeps reduce the effect of a busy machine.

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <memory>
#include <vector>

#include <dlfcn.h>

#include "tests/plugin/pybullet/pybullet_stub.h"

namespace {

using carom::test::ServerStub;

double medianStep(ServerStub& server) {
  using Clock = std::chrono::steady_clock;
  std::vector<double> microseconds;
  for (int step = 0; step < 240; ++step) {
    const auto start = Clock::now();
    server.step();
    microseconds.push_back(std::chrono::duration<double, std::micro>(Clock::now() - start).count());
  }
  std::ranges::nth_element(microseconds, microseconds.begin() + 120);
  return microseconds[120];
}

void dropBalls(ServerStub& server, int count) {
  server.add({.form = ServerStub::Body::Form::floor, .mass = 0.0});
  for (int ball = 0; ball < count; ++ball) {
    const int row = ball / 32;
    server.add({.position = {0.2 * (ball % 32), 0.2 * row, 0.1 + 0.1 * (ball % 7)}});
  }
}

}  // namespace

int main() {
  void* const library = dlopen(CAROM_PYBULLET_STUB, RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) return 1;
  const auto make = reinterpret_cast<ServerStub* (*)()>(dlsym(library, "makeServerStub"));
  for (const int count : {10, 100, 1000}) {
    const std::unique_ptr<ServerStub> without(make());
    dropBalls(*without, count);
    const std::unique_ptr<ServerStub> with(make());
    dropBalls(*with, count);
    if (with->load(CAROM_PYBULLET_PLUGIN, "_carom") != 0) return 1;
    const double bare = medianStep(*without);
    const double added = medianStep(*with) - bare;
    std::printf("%4d balls: substep %6.0f us, plugin %6.0f us, %.2f us per ball\n", count, bare,
                added, added / count);
  }
  return 0;
}
