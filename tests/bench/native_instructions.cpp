// Instructions per collision, counted by callgrind, so that the figure does not depend on how busy
// the machine is. Without an argument, or with --short, the program runs itself under valgrind, for
// a few and for more collisions, and prints the difference.

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <string>

#include "tests/bench/cell_yardstick.h"
#include "tests/bench/gas_world.h"
#include "tests/bench/scale.h"

namespace carom::bench {
namespace {

constexpr double kBar = 6000.0;

/// Runs the gas of 1000 for at least so many collisions; returns their true number.
std::uint64_t step(std::uint64_t collisions) {
  SphereStepper stepper = makeStepper(gasWorld(makeGas(1000)));
  while (stepper.counters().collisions < collisions)
    stepper.advanceTo(stepper.time() + 1e-3);
  return stepper.counters().collisions;
}

std::uint64_t stepYardstick(std::uint64_t collisions) {
  CellGas gas(makeGas(1000));
  for (std::uint64_t collision = 0; collision < collisions; ++collision)
    gas.collide();
  return collisions;
}

struct Run {
  double instructions = 0.0;
  double collisions = 0.0;
};

/// Runs this program under callgrind, which reports on standard error.
std::optional<Run> count(const char* program, const std::string& arguments) {
  const std::string command = "valgrind --tool=callgrind --callgrind-out-file=/dev/null '" +
                              std::string(program) + "' " + arguments + " 2>&1";
  std::FILE* output = popen(command.c_str(), "r");
  if (output == nullptr) return std::nullopt;
  Run run;
  char line[512];
  while (std::fgets(line, sizeof line, output) != nullptr) {
    const std::string text = line;
    const auto numberAfter = [&](const char* what, double& number) {
      const std::size_t at = text.find(what);
      if (at != std::string::npos)
        number = std::strtod(text.c_str() + at + std::string(what).size(), nullptr);
    };
    numberAfter("Collected : ", run.instructions);
    numberAfter("collisions: ", run.collisions);
  }
  if (pclose(output) != 0 || run.instructions == 0.0 || run.collisions == 0.0) return std::nullopt;
  return run;
}

std::optional<double> perCollision(const char* program, const std::string& what,
                                   const Scale& scale) {
  const auto few = count(program, what + " " + std::to_string(scale.of(5'000, 500)));
  const auto many = count(program, what + " " + std::to_string(scale.of(25'000, 2'500)));
  if (!few || !many) return std::nullopt;
  return (many->instructions - few->instructions) / (many->collisions - few->collisions);
}

int compare(const char* program, const Scale& scale) {
  const auto ours = perCollision(program, "carom", scale);
  const auto minimal = perCollision(program, "minimal", scale);
  if (!ours || !minimal) {
    std::fprintf(stderr, "native_instructions: needs valgrind (Debian package valgrind)\n");
    return 1;
  }
  std::printf("instructions for each collision, gas of 1000 at 30 %% of the volume\n");
  std::printf("%-34s %8.0f   bar %.0f%s\n", "Carom", *ours, kBar,
              *ours <= kBar ? "" : "  falls short");
  std::printf("%-34s %8.0f\n", "minimal cells and heap, periodic", *minimal);
  return 0;
}

}  // namespace
}  // namespace carom::bench

int main(int argc, char** argv) {
  using namespace carom::bench;
  const Scale scale = scaleOf(argc, argv);
  if (argc == 1 || (argc == 2 && scale.isShort)) return compare(argv[0], scale);
  const std::string what = argv[1];
  const std::uint64_t asked = argc == 3 ? std::strtoull(argv[2], nullptr, 10) : 0;
  if (asked == 0 || (what != "carom" && what != "minimal")) {
    std::fprintf(stderr, "usage: %s [--short | carom|minimal COLLISIONS]\n", argv[0]);
    return 2;
  }
  const std::uint64_t collisions = what == "carom" ? step(asked) : stepYardstick(asked);
  std::printf("collisions: %llu\n", static_cast<unsigned long long>(collisions));
  return 0;
}
