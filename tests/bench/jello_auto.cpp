#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "audio/io/byte_file.h"
#include "native/jello/jello_choice.h"
#include "native/jello/jello_file.h"
#include "native/jello/jello_limits.h"
#include "scenes/format/scene_loader.h"
#include "scenes/run/bullet_solid.h"
#include "scenes/run/jello_scene.h"
#include "tests/bench/table_program.h"

namespace carom::bench {

using namespace native;
using namespace scenes;

namespace {

constexpr const char* kHelp =
    "Prints what the choice of integrator and step for a jello promises and keeps, beside every "
    "fixed\n"
    "integrator at 0.9, 0.6 and 0.3 of its largest stable step, for all jello scenes of the "
    "library:\n"
    "the error of places up to the first contact, that of the energy after it, third octaves of "
    "the\n"
    "force on the jello after it, evaluations of all forces (of the choice too) and run time. With "
    "--short,\n"
    "the first tenth of a second of each.\n";

/// The jello and the spheres of a scene of the library, and how long it is run.
struct Case {
  std::string name;
  JelloWorld jello;
  SphereWorld spheres;
  double seconds = 0.0;
};

std::vector<Case> library(const Scale& scale) {
  const double longest = scale.isShort ? 0.1 : 2.0;
  const std::filesystem::path folder = std::filesystem::path(CAROM_SOURCE_DIR) / "scenes/library";
  std::vector<Case> cases;
  for (const char* name :
       {"jello_drop", "jello_inclined_plane", "jello_stiff", "jello_and_marbles"}) {
    const Result<Scene> scene = loadScene(folder / (std::string(name) + ".json"));
    if (!scene) continue;
    cases.push_back(
        {name, jelloWorld(*scene), sphereWorld(*scene), std::min(longest, scene->duration)});
  }
  for (const char* name : {"drop", "inclined_plane", "rotate", "stiff"}) {
    const auto path = folder / "jello" / (std::string(name) + ".w");
    const auto text = readSceneText(path);
    const auto file = text ? jelloFromText(*text, name) : Result<JelloFile>(Error{});
    if (file) cases.push_back({std::string(name) + ".w", file->world, {}, longest});
  }
  return cases;
}

constexpr std::size_t kLooks = 256;  ///< of a run, at equal intervals

/// Places and energies of a run at each look, and what the run has cost.
struct Run {
  std::vector<std::vector<Vec3>> places;
  std::vector<double> energies;
  std::size_t evaluations = 0;
  double seconds = 0.0;  // of processor time
  double metAt = std::numeric_limits<double>::infinity();
  double error = 0.0;  // m, expected
};

std::vector<Vec3> placesOf(const JelloStepper& jello) {
  std::vector<Vec3> places;
  for (std::size_t point = 0; point < jello.world().pointCount(); ++point)
    places.push_back(jello.position(point));
  return places;
}

std::vector<Vec3> speedsOf(const JelloStepper& jello) {
  std::vector<Vec3> speeds;
  for (std::size_t point = 0; point < jello.world().pointCount(); ++point)
    speeds.push_back(jello.velocity(point));
  return speeds;
}

/// Runs a case. Between two steps, places are on the cubic through places and velocities.
std::optional<Run> runOf(const Case& one, const JelloStepping& stepping) {
  auto coupling = JelloCoupling::create(one.jello, one.spheres, stepping);
  if (!coupling) return std::nullopt;
  Run run;
  const JelloStepper& jello = coupling->jello();
  const std::clock_t begin = std::clock();
  for (std::size_t look = 1; look <= kLooks; ++look) {
    const double time = one.seconds * static_cast<double>(look) / double{kLooks};
    const double h = jello.step();
    while (coupling->time() + h < time)
      if (!coupling->advance()) return std::nullopt;
    std::vector<Vec3> places = placesOf(jello);
    if (coupling->time() < time) {
      const double share = (time - coupling->time()) / h;
      const std::vector<Vec3> speeds = speedsOf(jello);
      if (!coupling->advance()) return std::nullopt;
      for (std::size_t point = 0; point < places.size(); ++point) {
        const Vec3 chord = jello.position(point) - places[point];
        const Vec3 first = h * speeds[point] - chord;
        const Vec3 second = chord - h * jello.velocity(point);
        places[point] += share * (chord + (1.0 - share) * ((1.0 - share) * first + share * second));
      }
    }
    run.places.push_back(std::move(places));
    run.energies.push_back(jello.energy().total());
  }
  run.seconds = static_cast<double>(std::clock() - begin) / static_cast<double>(CLOCKS_PER_SEC);
  run.evaluations = jello.evaluations();
  run.metAt = jello.metAt();
  run.error = jello.followedError();
  return run;
}

/// Root mean square distance in m between two runs, at the worst look up to `until` (s).
double apart(const Run& one, const Run& two, const Case& of, double until) {
  double worst = 0.0;
  for (std::size_t look = 0; look < kLooks; ++look) {
    if (of.seconds * static_cast<double>(look + 1) / double{kLooks} > until) break;
    double sum = 0.0;
    for (std::size_t point = 0; point < one.places[look].size(); ++point)
      sum += (one.places[look][point] - two.places[look][point]).squaredNorm();
    worst = std::max(worst, sum / static_cast<double>(one.places[look].size()));
  }
  return std::sqrt(worst);
}

/// Difference of the energies, relative to how much the reference's changes, at the worst look.
double energyError(const Run& run, const Run& reference) {
  const auto [least, most] = std::ranges::minmax(reference.energies);
  double worst = 0.0;
  for (std::size_t look = 0; look < kLooks; ++look)
    worst = std::max(worst, std::abs(run.energies[look] - reference.energies[look]));
  return most > least ? worst / (most - least) : worst;
}

void printRow(const char* name, double step, const Run& run, const Run& reference, const Case& of,
              double contact) {
  std::printf("  %-18s %9.4f %10zu %9.3f %11.2e %9.2f\n", name, 1e3 * step, run.evaluations,
              run.seconds, apart(run, reference, of, contact), 100.0 * energyError(run, reference));
}

void printCase(const Case& one) {
  const JelloLimits limits = jelloLimits(withSpheres(one.jello, one.spheres));
  const auto limitOf = [&](JelloIntegrator which) {
    return limits.touching[static_cast<std::size_t>(which)];
  };
  const auto reference =
      runOf(one, {JelloIntegrator::rungeKutta4, limitOf(JelloIntegrator::rungeKutta4) / 16.0});
  const auto followed = runOf(one, {JelloIntegrator::leapfrog,
                                    0.2 * limitOf(JelloIntegrator::leapfrog),
                                    {std::numeric_limits<double>::infinity(), one.seconds}});
  if (!reference || !followed) {
    std::printf("%s: blew up\n", one.name.c_str());
    return;
  }
  std::printf("%s, %.3g s, first contact at %.4f s\n  %-18s %9s %10s %9s %11s %9s\n",
              one.name.c_str(), one.seconds, followed->metAt, "", "step, ms", "forces", "run, s",
              "error, m", "energy, %");
  for (const double wished : {1e-3, 1e-4, 1e-6, 1e-8}) {
    const std::clock_t begin = std::clock();
    const auto choice =
        chooseStepping(one.jello, one.spheres, {.error = wished, .seconds = one.seconds});
    const double spent =
        static_cast<double>(std::clock() - begin) / static_cast<double>(CLOCKS_PER_SEC);
    if (!choice) {
      std::printf("  auto %g: %s\n", wished, choice.error().message.c_str());
      continue;
    }
    auto run = runOf(one, choice->stepping);
    if (!run) {
      std::printf("  auto %g: blew up\n", wished);
      continue;
    }
    run->evaluations += choice->spent;
    char name[64];
    std::snprintf(name, sizeof name, "auto %g", wished);
    printRow(name, choice->stepping.step, *run, *reference, one, followed->metAt);
    std::printf("    %s, promised %.2e, estimated %.2e; choosing took %zu of the forces, %.3f s\n",
                nameOf(choice->stepping.integrator), choice->error, run->error, choice->spent,
                spent);
  }
  for (std::size_t which = 0; which < kJelloIntegrators; ++which) {
    const auto integrator = static_cast<JelloIntegrator>(which);
    const double limit = limitOf(integrator);
    if (!(limit > 0.2 * limitOf(JelloIntegrator::leapfrog)) || std::isinf(limit)) continue;
    for (const double share : {0.9, 0.6, 0.3}) {
      const auto run = runOf(one, {integrator, share * limit});
      if (run) printRow(nameOf(integrator), share * limit, *run, *reference, one, followed->metAt);
    }
  }
}

int run(const Scale& scale) {
  for (const Case& one : library(scale))
    printCase(one);
  return 0;
}

}  // namespace
}  // namespace carom::bench

int main(int argc, char** argv) {
  return carom::bench::TableProgram{"bench_jello_auto", carom::bench::kHelp, carom::bench::run}
      .main(argc, argv);
}
