#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "lab/batch/batch_plan.h"
#include "lab/batch/batch_run.h"
#include "lab/batch/sample_run.h"
#include "lab/batch/sample_values.h"
#include <sys/wait.h>
#include <unistd.h>

#include "scenes/format/scene_loader.h"
#include "scenes/run/render.h"
#include "scenes/run/stopwatch.h"
#include "tests/bench/table_program.h"

namespace carom::bench {

using namespace lab;
using namespace scenes;

namespace {

namespace fs = std::filesystem;

constexpr const char* kHelp =
    "Prints what a batch of bouncing balls costs: a sample's scene rendered into nothing, by one "
    "process; the\n"
    "same with all files, in a bare loop over samples; by `carom batch run` with one process and "
    "with "
    "two; and\n"
    "two copies of the bare loop side by side, of which two processes should reach 95 %. Medians "
    "of "
    "several\n"
    "rounds, in which all take turns. With --short, few samples.\n";

/// Drops what a rendering makes.
class NoSink : public RenderSink {
 public:
  Status write(std::span<const float* const>, std::size_t) override { return std::monostate{}; }
  void add(const ImpulseEvent&, const EventSound&) override {}
};

BatchPlan planOf(const fs::path& folder, std::uint64_t count) {
  const fs::path file = fs::path(CAROM_SOURCE_DIR) / "scenes/batches/bouncing_balls.json";
  Result<BatchPlan> plan = makePlan(file, folder, count);
  if (!plan || !savePlan(*plan)) {
    std::fprintf(stderr, "bench_batch: no plan in %s\n", folder.c_str());
    std::exit(1);
  }
  return *std::move(plan);
}

/// A folder that goes with this object.
struct Folder {
  Folder() {
    std::string name = (fs::temp_directory_path() / "carom_bench_XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) std::exit(1);
    path = name;
  }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
  fs::path path;
};

void renderOnly(const BatchPlan& plan) {
  NoSink sink;
  for (std::uint64_t index = 0; index < plan.spec.count; ++index) {
    const auto values = drawValues(plan.spec, index, 0);
    const auto document = applied(plan.spec, *values, plan.spec.branches.front(),
                                  plan.scenes.at(sceneOf(plan.spec, *values)));
    const auto scene = parseScene(document->dump(), "scene.json");
    RenderOptions options;
    options.tail = 10.0;
    if (!scene || !renderScene(*scene, options, sink)) std::exit(1);
  }
}

/// Makes every `stride`-th sample in a bare loop.
void loopOver(const BatchPlan& plan, std::uint64_t first, std::uint64_t stride) {
  SampleRunner runner(plan);
  for (std::uint64_t index = first; index < plan.spec.count; index += stride)
    if (!runner.run(index)) std::exit(1);
}

void twoLoops(const BatchPlan& plan) {
  std::array<pid_t, 2> processes{};
  for (std::uint64_t at = 0; at < processes.size(); ++at) {
    processes[at] = fork();
    if (processes[at] != 0) continue;
    loopOver(plan, at, processes.size());
    _exit(0);
  }
  for (const pid_t process : processes)
    waitpid(process, nullptr, 0);
}

void batch(const BatchPlan& plan, std::size_t processes) {
  BatchRunOptions options;
  options.processes = processes;
  if (!runBatch(plan, options)) std::exit(1);
}

int run(const Scale& scale) {
  const std::uint64_t samples = scale.isShort ? 20 : 200;
  const int rounds = scale.isShort ? 1 : 5;
  const Folder folder;  // emptied at the end: a file system may be slow where much was just deleted
  constexpr std::size_t kWays = 5;
  constexpr std::array<const char*, kWays> kNames = {"rendered into nothing", "bare loop",
                                                     "batch, one process", "two bare loops",
                                                     "batch, two processes"};
  std::array<std::vector<double>, kWays> times;
  for (int round = 0; round < rounds; ++round)
    for (std::size_t way = 0; way < kWays; ++way) {
      const BatchPlan plan = planOf(folder.path / (std::to_string(round) + kNames[way]), samples);
      const Stopwatch stopwatch;
      if (way == 0) renderOnly(plan);
      if (way == 1) loopOver(plan, 0, 1);
      if (way == 2) batch(plan, 1);
      if (way == 3) twoLoops(plan);
      if (way == 4) batch(plan, 2);
      times[way].push_back(1e3 * stopwatch.seconds() / static_cast<double>(samples));
    }
  std::array<double, kWays> medians{};
  for (std::size_t way = 0; way < kWays; ++way) {
    std::ranges::sort(times[way]);
    medians[way] = times[way][times[way].size() / 2];
    std::printf("%-24s %8.3f ms a sample\n", kNames[way], medians[way]);
  }
  constexpr double kSound = 4.0;  // s, of a sample
  std::printf("overhead of a sample over its rendering: %.2f ms (bar 3)\n",
              medians[2] - medians[0]);
  std::printf("two processes reach %.1f %% of two bare loops (bar 95)\n",
              100.0 * medians[3] / medians[4]);
  std::printf("%.0f times real time per process, end to end (bar 100)\n",
              1e3 * kSound / medians[2]);
  return 0;
}

}  // namespace
}  // namespace carom::bench

int main(int argc, char** argv) {
  return carom::bench::TableProgram{"bench_batch", carom::bench::kHelp, carom::bench::run}.main(
      argc, argv);
}
