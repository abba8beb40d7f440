// The books of what rings: random blows on models of meshes, and the library's scenes. Prints what
// approached, what the modes have got of it, and what the books lack. `--help` describes it.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "carom/audio/synth.h"
#include "carom/modal/mesh_analysis.h"
#include "carom/modal/mesh_file.h"
#include "scenes/format/scene_loader.h"
#include "scenes/run/scene_sound.h"
#include "tests/audio/meshes.h"
#include "tests/bench/table_program.h"
#include "tests/support/hertz_contact.h"

namespace carom::bench {
namespace {

using namespace test;

constexpr char kHelp[] =
    R"(usage: bench_ring_books [--short]
       ./bench ring_books [--short]

Five bodies of four materials, each hit 500 times: at a random corner of its mesh, along the normal
there, by a steel ball of 1/100 to 100 times its mass at 0.01 to 10 m/s, with an impulse of random
restitution. Then all scenes of the library in which something rings.

  coupled    blows in which modes take part
  bound      of these, those whose impulse would take more energy than the modes leave
  most       the largest share of the energy of approach that the modes got in a blow; of a scene,
             of all blows together
  lacks      what the books lack at most, relative to the energy of approach

  --short    four models, 50 blows each, and no scenes
)";

/// The extent of the run.
struct Effort {
  std::size_t blows = 500;  // on each model
  std::size_t materials = 4;
  std::size_t degreesOfFreedom = 6000;
  bool scenes = true;
};
constexpr Effort kShort{.blows = 50, .materials = 1, .degreesOfFreedom = 1000, .scenes = false};

constexpr std::array kMaterials = {"carbon_steel", "glass", "red_oak", "polycarbonate"};
constexpr BodyId kBall = 1;
constexpr BodyId kStruck = 2;

template <class Value>
Value orExit(Result<Value> made) {
  if (made) return *std::move(made);
  std::fprintf(stderr, "bench_ring_books: %s\n", made.error().message.c_str());
  std::exit(1);
}

struct Body {
  const char* name;
  SurfaceMesh surface;
  double thickness = 0.0;  // m, of a shell; 0: a solid
};

std::filesystem::path libraryFolder() {
  return std::filesystem::path(CAROM_SOURCE_DIR) / "scenes" / "library";
}

SurfaceMesh meshOf(const char* file) {
  return orExit(loadMesh(libraryFolder() / "meshes" / file, {})).surface;
}

std::vector<Body> bodies() {
  return {{"bar", boxMesh({0.15, 0.01, 0.004})},
          {"plate", boxMesh({0.2, 0.15, 0.003})},
          {"wrench", meshOf("wrench.obj")},
          {"block", boxMesh({0.06, 0.04, 0.03})},
          {"shell", ellipsoidMesh({0.2, 0.16, 0.13}, 2), 0.003}};
}

std::shared_ptr<const ModalModel> modelOf(const Body& body, const Material& material,
                                          const Effort& effort) {
  MeshAnalysisSettings settings;
  settings.solid.grid.degreesOfFreedom = effort.degreesOfFreedom;
  settings.radiation.reset();  // the books have no use for it
  if (body.thickness > 0.0) {
    settings.body = BodyModel::shell;
    settings.shell.thickness = body.thickness;
  }
  MeshAnalysis analysis = orExit(analyseMesh(body.surface, material, settings));
  return std::make_shared<const ModalModel>(std::move(analysis.model));
}

/// The books of many blows.
struct Books {
  std::uint64_t coupled = 0;
  std::uint64_t bound = 0;
  double most = 0.0;
  double lacks = 0.0;
};

/// Returns what the sums are off by, relative to what approached.
double lackOf(const ContactEnergy& energy) {
  const double parts = energy.parting + energy.modes + energy.damped + energy.contacts;
  return std::abs(parts - energy.approach) / energy.approach;
}

class Hammer {
 public:
  explicit Hammer(std::shared_ptr<const ModalModel> model) : model_(std::move(model)) {}

  /// Enters a blow, on a body that was at rest.
  void hit(Books& books) {
    Synth synth = orExit(Synth::create({}, {{.name = "seat", .position = {0.0, 0.0, 1.0}}}));
    BallStrike strike = randomStrike();
    (void)orExit(synth.setBody(kBall, {.material = strike.ball}));
    (void)orExit(synth.setBody(kStruck, {.material = model_->material, .modal = model_}));
    ImpulseEvent event = strike.event();
    event.impulse *= 0.5 * (1.0 + between(0.0, 1.0));
    synth.schedule(event);
    const ContactEnergy energy = synth.contactEnergy(event.time + 1.0);
    if (energy.impacts == 0) return;
    books.coupled += energy.impacts;
    books.bound += energy.bound;
    books.most = std::max(books.most, energy.modes / energy.approach);
    books.lacks = std::max(books.lacks, lackOf(energy));
  }

 private:
  double between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  double spread(double low, double high) {  // evenly over the logarithm
    return std::exp(between(std::log(low), std::log(high)));
  }

  BallStrike randomStrike() {
    const SurfaceMesh& surface = model_->surface;
    const auto index = static_cast<std::size_t>(
        between(0.0, static_cast<double>(surface.triangles.size()) - 1e-6));
    const auto& [a, b, c] = surface.triangles[index];
    const Vec3 normal = (surface.vertices[b] - surface.vertices[a])
                            .cross(surface.vertices[c] - surface.vertices[a])
                            .normalized();
    BallStrike strike{.ball = *findMaterial("carbon_steel"), .body = model_->material};
    const double mass = model_->mass * spread(0.01, 100.0);
    strike.ballRadius = std::cbrt(mass / (4.0 / 3.0 * std::numbers::pi * strike.ball.density));
    strike.speed = spread(0.01, 10.0);
    strike.bodyMass = effectiveMassAt(surface.vertices[a], normal);
    strike.at = surface.vertices[a];
    strike.inward = -normal;
    return strike;
  }

  /// kg, of the free rigid body at a point, along a direction.
  double effectiveMassAt(const Vec3& point, const Vec3& direction) const {
    const Vec3 arm = (point - model_->centreOfMass).cross(direction);
    return 1.0 / (1.0 / model_->mass + arm.dot(model_->inertia.ldlt().solve(arm)));
  }

  std::shared_ptr<const ModalModel> model_;
  std::mt19937_64 random_{1};
};

void print(const std::string& name, const Books& books) {
  std::printf("  %-36s %8llu %8llu %9.4f %9.1e\n", name.c_str(),
              static_cast<unsigned long long>(books.coupled),
              static_cast<unsigned long long>(books.bound), books.most, books.lacks);
  std::fflush(stdout);
}

Books booksOf(const std::filesystem::path& file) {
  const scenes::Scene scene = orExit(scenes::loadScene(file));
  scenes::SceneSound sound = orExit(scenes::SceneSound::create(scene));
  std::vector<std::vector<float>> block(scenes::channelsOf(scene), std::vector<float>(4096));
  while (sound.render(block) > 0) {
  }
  const ContactEnergy energy = sound.synth().contactEnergy(sound.synth().time());
  if (energy.impacts == 0) return {};
  return {energy.impacts, energy.bound, energy.modes / energy.approach, lackOf(energy)};
}

int run(const Scale& scale) {
  const Effort effort = scale.of(Effort(), kShort);
  std::printf("  %-36s %8s %8s %9s %9s\n", "", "coupled", "bound", "most", "lacks");
  for (const Body& body : bodies()) {
    if (scale.isShort && body.thickness > 0.0) continue;
    for (std::size_t i = 0; i < effort.materials; ++i) {
      Hammer hammer(modelOf(body, *findMaterial(kMaterials[i]), effort));
      Books books;
      for (std::size_t blow = 0; blow < effort.blows; ++blow)
        hammer.hit(books);
      print(std::string(body.name) + " of " + kMaterials[i], books);
    }
  }
  if (!effort.scenes) return 0;
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(libraryFolder()))
    if (entry.path().extension() == ".json") files.push_back(entry.path());
  std::ranges::sort(files);
  for (const std::filesystem::path& file : files)
    if (const Books books = booksOf(file); books.coupled > 0) print(file.stem().string(), books);
  return 0;
}

}  // namespace
}  // namespace carom::bench

int main(int argc, char** argv) {
  return carom::bench::TableProgram{"bench_ring_books", carom::bench::kHelp, carom::bench::run}
      .main(argc, argv);
}
