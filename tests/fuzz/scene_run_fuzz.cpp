#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "scenes/format/scene_loader.h"
#include "scenes/limits/run_guard.h"
#include "scenes/run/scene_sound.h"
#include "scenes/run/scene_stepper.h"
#include "tests/fuzz/fuzz_numbers.h"

namespace carom::fuzz {
namespace {

using nlohmann::json;

json vectorOf(const Vec3& vector) {
  return {vector.x(), vector.y(), vector.z()};
}

/// Makes a scene that the loader should take: spheres of 1 mm to 1 m and a few boxes of a cell
/// each, a floor or a room, rods and springs.
class SceneMaker {
 public:
  explicit SceneMaker(FuzzNumbers& numbers) : numbers_(numbers) {}

  json make() {
    onBullet_ = numbers_.chance(64);
    json scene = {{"duration", 0.1}, {"sample_rate", 8000}};
    scene["stepper"] = {{"type", onBullet_ ? "bullet" : "native"}};
    if (numbers_.chance(128)) scene["gravity"] = vectorOf(numbers_.inCube(20.0));
    addWalls();
    const std::size_t count = 1 + numbers_.below(10);
    for (std::size_t index = 0; index < count; ++index)
      addBody(index);
    scene["bodies"] = bodies_;
    if (!onBullet_) addMechanics(scene, count);
    const double x = numbers_.between(-3.0, 3.0);
    scene["listeners"] = {{{"name", "ear"}, {"position", {x, 0.4, 2.9}}}};
    return scene;
  }

 private:
  std::string material() {
    constexpr std::array kMaterials = {"steel", "glass", "wood", "rubber", "ceramic"};
    return kMaterials[numbers_.below(kMaterials.size())];
  }
  void addWalls() {
    if (numbers_.chance(128))
      bodies_.push_back({{"type", "plane"},
                         {"name", "floor"},
                         {"normal", {0, 1, 0}},
                         {"offset", -4.0},
                         {"material", material()}});
    else
      bodies_.push_back({{"type", "box"},
                         {"name", "room"},
                         {"min", {-4, -4, -4}},
                         {"max", {4, 4, 4}},
                         {"material", material()}});
  }
  /// Adds a body in a cell of its own, 2 m wide, from whose middle it may be off as far as there is
  /// room; neighbours may be at any distance down to nothing.
  void addBody(std::size_t index) {
    const auto cell = [](std::size_t at) { return 2.2 * static_cast<double>(at) - 2.2; };
    const Vec3 middle(cell(index % 3), cell(index / 3 % 3), cell(index / 9));
    const double radius = numbers_.logBetween(1e-3, 1.0);
    const Vec3 place = middle + numbers_.inCube(1.0 - 0.999 * radius);
    json body = {{"type", "sphere"},
                 {"name", "body" + std::to_string(index)},
                 {"radius", radius},
                 {"material", material()},
                 {"position", vectorOf(place)},
                 {"velocity", vectorOf(numbers_.inCube(numbers_.logBetween(1e-3, 300.0)))}};
    if (numbers_.chance(64)) body["restitution"] = numbers_.share();
    bodies_.push_back(body);
  }
  void addMechanics(json& scene, std::size_t count) {
    json springs = json::array();
    for (std::size_t index = 0; index + 1 < count && numbers_.chance(64); ++index)
      springs.push_back(
          {{"bodies", {"body" + std::to_string(index), "body" + std::to_string(index + 1)}},
           {"stiffness", numbers_.logBetween(1.0, 1e9)},
           {"damping", numbers_.logBetween(1e-3, 1e3)}});
    if (!springs.empty()) scene["mechanics"]["springs"] = springs;
    json rods = json::array();
    for (std::size_t index = 0; index + 1 < count && numbers_.chance(64); ++index)
      rods.push_back(
          {{"bodies", {"body" + std::to_string(index), "body" + std::to_string(index + 1)}}});
    if (!rods.empty()) scene["mechanics"]["rods"] = rods;
  }

  FuzzNumbers& numbers_;
  bool onBullet_ = false;
  json bodies_ = json::array();
};

void requireSound(const ImpulseEvent& event) {
  require(std::isfinite(event.time) && event.time >= 0.0 && event.impulse.allFinite());
  require(std::abs(event.normal.norm() - 1.0) < 1e-6 && event.approachSpeed >= 0.0);
  require(event.position.allFinite() && event.bodyVelocity.allFinite());
}

/// Events after which a run is ended, as by --max-events: a chain of rods that rattles between
/// walls has hundreds of thousands, of some 20 us each, and sanitizers take ten times that.
constexpr std::uint64_t kMostEvents = 5'000;

/// Runs a tenth of a second of mechanics and sound.
void run(const scenes::Scene& scene) {
  auto sound = scenes::SceneSound::create(scene);
  if (!sound) {
    require(!sound.error().message.empty());
    return;
  }
  scenes::RunGuard guard(scene, {.events = kMostEvents});
  sound->watch(guard);
  std::vector<std::vector<float>> channels(scenes::channelsOf(scene), std::vector<float>(200));
  while (const std::size_t frames = sound->render(channels)) {
    for (const std::vector<float>& channel : channels)
      for (std::size_t frame = 0; frame < frames; ++frame)
        require(std::isfinite(channel[frame]));
    for (const scenes::ScheduledEvent& settled : sound->settledEvents())
      requireSound(settled.event);
  }
}

}  // namespace
}  // namespace carom::fuzz

/// Runs a scene that the bytes stand for, on either stepper: what it tells must be finite, and come
/// to an end. With CAROM_FUZZ_PRINT in the environment, the scene is printed first.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  carom::fuzz::FuzzNumbers numbers({data, size});
  const std::string text = carom::fuzz::SceneMaker(numbers).make().dump();
  if (std::getenv("CAROM_FUZZ_PRINT") != nullptr) std::fprintf(stderr, "%s\n", text.c_str());
  const auto scene = carom::scenes::parseScene(text, "fuzz.json");
  if (scene) carom::fuzz::run(*scene);
  return 0;
}
