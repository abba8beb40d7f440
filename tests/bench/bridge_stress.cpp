// Runs great numbers of random scenes, in which nothing that the bridge reports may be absurd.
// Usage: bench_bridge_stress [N] [--first SEED] [--seed SEED] [--prompt] [--short]

#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <string>
#include <string_view>

#include <unistd.h>

#include "tests/bullet_bridge/random_scene.h"

namespace carom::bench {
namespace {

// The seed's text for the handler of a crash, which has no other access to it.
char crashText[64];
std::size_t crashLength = 0;

void onCrash(int) {
  if (write(STDERR_FILENO, crashText, crashLength) < 0) _exit(3);
  _exit(3);
}

void announce(std::uint64_t seed) {
  const int length = std::snprintf(crashText, sizeof crashText, "crash in seed %llu\n",
                                   static_cast<unsigned long long>(seed));
  crashLength = static_cast<std::size_t>(length);
}

struct Totals {
  std::uint64_t scenes = 0, substeps = 0, collisions = 0, contacts = 0, unsupported = 0, failed = 0;
};

void run(std::uint64_t seed, bool prompt, Totals& totals) {
  announce(seed);
  const RandomSceneResult result =
      runRandomScene(seed, {.delivery = prompt ? EventDelivery::prompt : EventDelivery::complete});
  ++totals.scenes;
  totals.substeps += result.substeps;
  totals.collisions += result.collisions;
  totals.contacts += result.contacts;
  totals.unsupported += result.unsupported;
  if (result.failure.empty()) return;
  if (++totals.failed <= 20)
    std::printf("seed %llu: %s\n", static_cast<unsigned long long>(seed), result.failure.c_str());
}

void print(const Totals& totals, double seconds) {
  const auto number = [](std::uint64_t value) { return static_cast<unsigned long long>(value); };
  std::printf(
      "| scenes | substeps | collisions | contact states | scenes with shapes not supported | "
      "failed | scenes per s |\n|---|---|---|---|---|---|---|\n"
      "| %llu | %llu | %llu | %llu | %llu | %llu | %.0f |\n",
      number(totals.scenes), number(totals.substeps), number(totals.collisions),
      number(totals.contacts), number(totals.unsupported), number(totals.failed),
      static_cast<double>(totals.scenes) / seconds);
}

struct Options {
  std::uint64_t first = 0;
  std::uint64_t count = 100000;
  bool prompt = false;
};

Options parse(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    const bool more = i + 1 < argc;
    if (argument == "--prompt") {
      options.prompt = true;
    } else if (argument == "--short") {
      options.count = 1000;
    } else if (argument == "--seed" && more) {
      options.first = std::strtoull(argv[++i], nullptr, 10);
      options.count = 1;
    } else if (argument == "--first" && more) {
      options.first = std::strtoull(argv[++i], nullptr, 10);
    } else {
      options.count = std::strtoull(argv[i], nullptr, 10);
    }
  }
  return options;
}

}  // namespace
}  // namespace carom::bench

int main(int argc, char** argv) {
  using namespace carom::bench;
  for (const int signal : {SIGSEGV, SIGABRT, SIGFPE, SIGBUS})
    std::signal(signal, onCrash);
  const Options options = parse(argc, argv);
  Totals totals;
  const std::clock_t start = std::clock();
  for (std::uint64_t seed = options.first; seed < options.first + options.count; ++seed)
    run(seed, options.prompt, totals);
  print(totals, static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
  return totals.failed == 0 ? 0 : 1;
}
