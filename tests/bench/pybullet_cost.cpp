// The cost of the PyBullet plugin: steps of the server stub with and without it, by turns, with
// balls that drop on a floor and come to rest. Medians of steps after all have been described. The
// stub's own step is Bullet's alone; PyBullet's server does more besides.
//     ./bench pybullet [--short]

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <dlfcn.h>

#include "tests/bench/scale.h"
#include "tests/plugin/pybullet/pybullet_stub.h"

namespace {

using carom::test::ServerStub;

/// A world of balls, and what its steps cost.
struct Run {
  std::unique_ptr<ServerStub> server;
  std::vector<double> microseconds{};

  void step() {
    using Clock = std::chrono::steady_clock;
    const auto start = Clock::now();
    server->step();
    microseconds.push_back(std::chrono::duration<double, std::micro>(Clock::now() - start).count());
  }
  /// Median of the steps after the first 120, in which bodies are described.
  double median() {
    constexpr std::size_t kFirst = 120;
    const auto middle = microseconds.begin() +
                        static_cast<std::ptrdiff_t>(kFirst + (microseconds.size() - kFirst) / 2);
    std::nth_element(microseconds.begin() + kFirst, middle, microseconds.end());
    return *middle;
  }
};

void dropBalls(ServerStub& server, int count, bool isRigid) {
  server.add(
      {.form = ServerStub::Body::Form::floor, .mass = 0.0, .hasMaximalCoordinates = isRigid});
  for (int ball = 0; ball < count; ++ball) {
    const int row = ball / 32;
    server.add({.position = {0.2 * (ball % 32), 0.2 * row, 0.1 + 0.1 * (ball % 7)},
                .hasMaximalCoordinates = isRigid});
  }
}

}  // namespace

int main(int argc, char** argv) {
  const carom::bench::Scale scale = carom::bench::scaleOf(argc, argv);
  const int steps = static_cast<int>(scale.of(960.0, 240.0));
  void* const library = dlopen(CAROM_PYBULLET_STUB, RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) return 1;
  const auto make = reinterpret_cast<ServerStub* (*)()>(dlsym(library, "makeServerStub"));
  const std::filesystem::path file =
      std::filesystem::temp_directory_path() / "carom_pybullet_cost.wav";
  std::printf("balls  coordinates  bare us  recording us   +%%  capturing us   +%%  asked\n");
  for (const bool isRigid : {false, true}) {
    for (const int count : {10, 100, 1000}) {
      std::array<Run, 3> runs;  // bare, recording, capturing
      for (Run& run : runs) {
        run.server.reset(make());
        dropBalls(*run.server, count, isRigid);
      }
      for (Run* const run : {&runs[1], &runs[2]})
        if (run->server->load(CAROM_PYBULLET_PLUGIN, "_carom") != 0) return 1;
      if (runs[1].server->execute("record " + file.string()).result != 0) return 1;
      if (runs[2].server->execute("capture").result != 0) return 1;
      for (int step = 0; step < steps; ++step)
        for (Run& run : runs)
          run.step();
      const double bare = runs[0].median();
      const auto percent = [bare](double with) { return 100.0 * (with / bare - 1.0); };
      const double recording = runs[1].median();
      const double capturing = runs[2].median();
      std::printf("%5d  %-11s  %7.1f  %12.1f  %3.0f  %12.1f  %3.0f  %5.3f\n", count,
                  isRigid ? "maximal" : "reduced", bare, recording, percent(recording), capturing,
                  percent(capturing),
                  static_cast<double>(runs[1].server->statesAsked()) / count / steps);
    }
  }
  std::filesystem::remove(file);
  std::printf("asked: states that the server was asked for, per ball and step\n");
  return 0;
}
