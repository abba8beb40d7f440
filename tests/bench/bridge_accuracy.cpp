// Accuracy of the bridge's collisions: one table, every case beside an independent reference.
// Usage: bench_bridge_accuracy [--only TEXT] [--worst] [--run NUMBER] [--short]

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "carom/bullet/bullet_bridge.h"
#include "tests/bench/accuracy_cases.h"
#include "tests/bench/accuracy_momentum.h"
#include "tests/bench/accuracy_rest.h"
#include "tests/bench/accuracy_table.h"
#include "tests/bench/pair_reference.h"
#include "tests/bench/scale.h"
#include "tests/bullet_bridge/delivery_time.h"

namespace carom::bench {
namespace {

constexpr double kSteps[] = {1.0 / 60, 1.0 / 240, 1.0 / 1000};  // s

/// The impacts of one run, by the reference and by the bridge.
struct PairRun {
  std::vector<ReferenceImpact> reference;
  std::vector<ReferenceImpact> bridge;
  double end = 0.0;  // s; later impacts do not count, some may not be reported yet
  int needless = 0;
  double pathError = 0.0;  // m
  bool unsupported = false;
};

void collect(BulletBridge& bridge, PairRun& run) {
  for (const ImpulseEvent& event : bridge.events()) {
    if (event.body != 0) continue;
    run.bridge.push_back({.time = event.time,
                          .impulse = event.impulse.norm(),
                          .speed = event.approachSpeed,
                          .mass = event.effectiveMass});
  }
  bridge.clear();
}

PairRun follow(PairWorld& world, const PairCase& which, double dt) {
  Result<BulletBridge> bridge = BulletBridge::attach(world.world);
  if (!bridge) std::abort();
  PairReference reference(
      *world.bodies[0], *world.bodies[1],
      double(world.bodies[0]->getRestitution() * world.bodies[1]->getRestitution()),
      double(world.world.getSolverInfo().m_restitutionVelocityThreshold));
  PairRun run;
  const double exactStep = double(btScalar(dt));
  int left = int(std::lround(which.duration / dt));
  const int after = stepsUntilDelivered(exactStep);
  for (double time = 0.0; left > -after; --left, time += exactStep) {
    const bool compared = left > 0;
    if (compared) reference.beforeStep(exactStep);
    world.world.stepSimulation(btScalar(dt), 0);
    if (compared) reference.afterStep(exactStep);
    if (compared) run.end = time + exactStep;
    if (which.firstOnly && !reference.impacts().empty()) left = std::min(left, 1);
    collect(*bridge, run);
  }
  run.reference = reference.impacts();
  run.needless = reference.needless();
  run.pathError = reference.pathError();
  run.unsupported = bridge->counters().unsupported > 0;
  return run;
}

void noteMiss(AccuracyRow& row, const char* what, const ReferenceImpact& impact,
              const std::string& run) {
  if (!row.firstMiss.empty()) return;
  row.firstMiss = std::string(what) + " at " + std::to_string(impact.time) + " s with " +
                  std::to_string(impact.speed) + " m/s, " + run;
}

// Compares all impacts of the run, each with the nearest that the bridge has within a substep.
void compareAll(PairRun& run, const std::string& name, AccuracyRow& row) {
  for (const ReferenceImpact& impact : run.reference) {
    const auto nearest =
        std::min_element(run.bridge.begin(), run.bridge.end(), [&](const auto& a, const auto& b) {
          return std::abs(a.time - impact.time) < std::abs(b.time - impact.time);
        });
    const bool found =
        nearest != run.bridge.end() && std::abs(nearest->time - impact.time) <= row.step;
    if (impact.time >= run.end && !found) continue;
    ++row.impacts;
    if (!found) {
      ++row.missed;
      noteMiss(row, "missed", impact, name);
      continue;
    }
    row.addMatch(1e6 * std::abs(nearest->time - impact.time),
                 std::abs(nearest->impulse / impact.impulse - 1.0), name);
    run.bridge.erase(nearest);
  }
  for (const ReferenceImpact& impact : run.bridge) {
    if (impact.time >= run.end) continue;
    ++row.spurious;
    noteMiss(row, "spurious", impact, name);
  }
}

// Keeps the reference's first impact, after which it is not valid, and the bridge's collisions up
// to that time: earlier ones are spurious, simultaneous ones duplicates.
void keepFirst(PairRun& run) {
  constexpr double kSame = 50e-6;  // s, collisions nearer than this are one
  if (run.reference.empty()) return;
  const double first = run.reference.front().time;
  run.reference.resize(1);
  std::sort(run.bridge.begin(), run.bridge.end(),
            [](const auto& a, const auto& b) { return a.time < b.time; });
  const auto later = std::find_if(run.bridge.begin(), run.bridge.end(),
                                  [&](const auto& a) { return a.time > first + kSame; });
  // If the bridge is late, its first collision is the one to compare.
  run.bridge.erase(later == run.bridge.begin() && later != run.bridge.end() ? later + 1 : later,
                   run.bridge.end());
  run.end = 1e9;
}

// A hash that is the same on every platform, unlike std::hash.
std::uint64_t seedOf(const std::string& name, double dt, int run) {
  std::uint64_t seed = std::uint64_t(std::lround(1.0 / dt)) * 1000003U + std::uint64_t(run);
  for (const char letter : name)
    seed = (seed ^ static_cast<unsigned char>(letter)) * 1099511628211U;
  return seed;
}

struct Options {
  std::string only;  // part of the names of the cases to run
  bool worst = false;
  int run = -1;  // print only this run, in detail; negative: all
  Scale scale;   // --short: a fiftieth of the runs
};

// Prints the impacts of a run to the error stream.
void printRun(const PairRun& run, const std::string& name, double dt) {
  std::fprintf(stderr, "%s, 1/%.0f\n", name.c_str(), 1.0 / dt);
  for (const auto* list : {&run.reference, &run.bridge}) {
    for (const ReferenceImpact& impact : *list) {
      std::fprintf(stderr, "  %s %.9f s, %.6g m/s, %.6g kg, %.6g N s",
                   list == &run.bridge ? "bridge   " : "reference", impact.time, impact.speed,
                   impact.mass, impact.impulse);
      if (list == &run.reference) {
        std::fprintf(stderr, ", %.2f substeps after its node%s", (impact.time - impact.node) / dt,
                     impact.ahead ? ", speculative" : "");
      }
      std::fprintf(stderr, "\n");
    }
  }
}

AccuracyRow rowOf(const PairCase& which, double dt, const Options& options) {
  AccuracyRow row;
  row.name = which.name;
  row.step = dt;
  row.barRms = which.barRms;
  row.barMax = which.barMax;
  row.barImpulse = which.barImpulse;
  const int runs = options.scale.of(which.runs, which.runs / 50);
  for (int number = 0; number < runs; ++number) {
    if (options.run >= 0 && number != options.run) continue;
    Random random(seedOf(which.name, dt, number));
    PairWorld world(which.firstOnly || which.name == "sphere on plane" ? 9.81 : 0.0);
    const std::string name =
        "run " + std::to_string(number) + ": " + which.build(world, random, number, dt);
    PairRun run = follow(world, which, dt);
    if (options.run >= 0) printRun(run, name, dt);
    ++row.runs;
    row.needless += run.needless;
    row.pathError = std::max(row.pathError, run.pathError);
    row.unsupported = row.unsupported || run.unsupported;
    if (which.firstOnly) keepFirst(run);
    compareAll(run, name, row);
  }
  return row;
}

bool isWanted(const std::string& name, const Options& options) {
  return name.find(options.only) != std::string::npos;
}

void printCases(const std::vector<PairCase>& cases, const Options& options) {
  for (const PairCase& which : cases) {
    if (!isWanted(which.name, options)) continue;
    for (const double dt : kSteps) {
      const AccuracyRow row = rowOf(which, dt, options);
      printRow(row);
      if (options.worst) printWorst(row);
    }
  }
}

void printMomentum(const Options& options) {
  for (const bool friction : {false, true}) {
    const std::string name =
        std::string("momentum, ") + (friction ? "with friction" : "no friction");
    if (!isWanted(name, options)) continue;
    for (const double dt : kSteps) {
      const MomentumCase which{dt, friction, options.scale.of(200, 4), options.run};
      const MomentumResult result = runMomentum(which);
      printBalanceRow(name, dt, which.scenes, result.collisions, result.imbalance, 1e-5,
                      !result.unsupported);
      if (options.worst)
        std::fprintf(stderr, "%s, 1/%.0f: worst run %d\n", name.c_str(), 1.0 / dt, result.worst);
    }
  }
}

void printRest(const Options& options) {
  for (const RestCase& which : restCases(options.scale.of(1000, 30))) {
    if (!isWanted(which.name(), options)) continue;
    for (const double dt : {1.0 / 60, 1.0 / 240}) {
      const RestResult result = runRest(which, dt);
      printRestRow(which.name(), dt, result.events, result.speed, !result.unsupported);
    }
  }
}

}  // namespace
}  // namespace carom::bench

int main(int argc, char** argv) {
  carom::bench::Options options;
  options.scale = carom::bench::scaleOf(argc, argv);
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    if (argument == "--worst") options.worst = true;
    if (argument == "--run" && i + 1 < argc) options.run = std::atoi(argv[++i]);
    if (argument == "--only" && i + 1 < argc) options.only = argv[++i];
  }
  carom::bench::printHeader();
  carom::bench::printCases(carom::bench::sphereCases(), options);
  carom::bench::printCases(carom::bench::shapeCases(), options);
  carom::bench::printMomentum(options);
  carom::bench::printRest(options);
  return 0;
}
