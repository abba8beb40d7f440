#include "scenes/format/scene_loader.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>
#include <ostream>
#include <random>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <valijson/adapters/nlohmann_json_adapter.hpp>
#include <valijson/schema.hpp>
#include <valijson/schema_parser.hpp>
#include <valijson/validator.hpp>

#include "carom/audio/absorption.h"
#include "carom/audio/listener.h"
#include "carom/audio/material.h"
#include "carom/audio/room.h"
#include "scenes/format/dry_friction.h"
#include "scenes/format/material_reader.h"
#include "tests/support/temporary_folder.h"

namespace carom {

using namespace audio;
using namespace native;
using namespace scenes;

namespace {

using nlohmann::json;

const std::filesystem::path kScenes = std::filesystem::path(CAROM_SOURCE_DIR) / "scenes";

// Functions of hundreds of temporaries that run once: compilers take minutes to optimise them, and
// to have them sanitized.
#ifdef __clang__
#define CAROM_LIST __attribute__((optnone, noinline, no_sanitize("address")))
#else
#define CAROM_LIST __attribute__((optimize("O0")))
#endif

/// A valid document, in which the tests spoil one place at a time.
constexpr const char* kOneBall = R"({
  "duration": 1,
  "bodies": [
    {"type": "sphere", "radius": 0.01, "material": "steel", "position": [0, 1, 0]},
    {"type": "plane", "normal": [0, 1, 0], "offset": 0, "material": "concrete"}
  ],
  "listeners": [{"position": [0, 1, 1]}]
})";

json oneBall() {
  return json::parse(kOneBall);
}

/// oneBall() with the value at a JSON pointer set.
json with(const std::string& pointer, json value) {
  json document = oneBall();
  document[json::json_pointer(pointer)] = std::move(value);
  return document;
}

json without(const std::string& pointer) {
  json document = oneBall();
  const json::json_pointer place(pointer);
  document[place.parent_pointer()].erase(place.back());
  return document;
}

json withBodies(json bodies) {
  return with("/bodies", std::move(bodies));
}

json sphereAt(double radius, double x, double y, double z) {
  return {{"type", "sphere"}, {"radius", radius}, {"material", "glass"}, {"position", {x, y, z}}};
}

json planeOf(json normal) {
  return {{"type", "plane"}, {"normal", std::move(normal)}, {"offset", 0}, {"material", "wood"}};
}

json groupOf(std::size_t count, json radius, double halfWidth) {
  return {{"type", "spheres"},
          {"count", count},
          {"radius", std::move(radius)},
          {"material", "glass"},
          {"min", {-halfWidth, -halfWidth, -halfWidth}},
          {"max", {halfWidth, halfWidth, halfWidth}}};
}

json oak() {
  return {
      {"density", 700}, {"youngs_modulus", 1e10}, {"poissons_ratio", 0.3}, {"restitution", 0.5}};
}

/// oneBall() in a box of 5 x 3 x 4 m of that material instead of over a plane.
json inBox(const std::string& material, json room) {
  json document = oneBall();
  document["bodies"][1] = {{"type", "box"},
                           {"name", "hall"},
                           {"min", {-2, 0, -2}},
                           {"max", {3, 3, 2}},
                           {"material", material}};
  document["room"] = std::move(room);
  return document;
}

/// oneBall() with a block, a cube of 2 m around (5, 5, 5) except for `keys`.
json withBlock(const json& keys) {
  json document = oneBall();
  json block = {{"type", "block"}, {"min", {4, 4, 4}}, {"max", {6, 6, 6}}, {"material", "wood"}};
  block.update(keys);
  document["bodies"].push_back(block);
  return document;
}

/// oneBall() with a solid, a box except for `keys`.
json withSolid(const json& keys) {
  json document = oneBall();
  json solid = {{"type", "solid"},
                {"shape", {{"type", "box"}, {"half_extents", {1, 2, 3}}}},
                {"material", "wood"},
                {"position", {5, 5, 5}}};
  solid.update(keys);
  document["bodies"].push_back(solid);
  return document;
}
/// oneBall() with a jello, a metre wide and far away except for `keys`.
json withJello(const json& keys) {
  json document = oneBall();
  json jello = {{"type", "jello"}, {"points", 2},     {"size", {1, 1, 1}},
                {"mass", 2},       {"stiffness", 50}, {"position", {5, 5, 5}}};
  jello.update(keys);
  document["bodies"].push_back(jello);
  return document;
}
json withShape(const json& shape) {
  return withSolid({{"shape", shape}});
}
/// oneBall() with a solid whose mesh is a file of tests/scenes/meshes.
json withMesh(const std::string& file, const json& keys = json::object()) {
  json shape = {{"type", "mesh"},
                {"file", (kScenes.parent_path() / "tests/scenes/meshes" / file).string()}};
  shape.update(keys);
  return withShape(shape);
}

/// oneBall() with these modes of its sphere.
json withModes(json modes) {
  return with("/bodies/0/modes", std::move(modes));
}

/// oneBall() with one rod (or, below, one spring), anchored at (1, 0, 0) except for `keys`.
json withRod(const json& keys) {
  json rod = {{"bodies", {"sphere1"}}, {"anchor", {1, 0, 0}}};
  rod.update(keys);
  return with("/mechanics", {{"rods", json::array({rod})}});
}
json withSpring(const json& keys) {
  json spring = {{"bodies", {"sphere1"}}, {"anchor", {1, 0, 0}}, {"length", 1}, {"stiffness", 100}};
  spring.update(keys);
  return with("/mechanics", {{"springs", json::array({spring})}});
}

/// oneBall() with a sphere of oak, whose material these keys change.
json withOak(const json& keys) {
  json material = oak();
  material.update(keys);
  return with("/bodies/0/material", material);
}

/// oneBall() with these keys in its listener.
json withListener(const json& keys) {
  json document = oneBall();
  document["listeners"][0].update(keys);
  return document;
}

json poseAt(double time, double x, double y, double z) {
  return {{"time", time}, {"position", {x, y, z}}};
}

Result<Scene> parsed(const json& document) {
  return parseScene(document.dump(), "test.json");
}

std::string messageOf(const Result<Scene>& scene) {
  return scene ? "(accepted)" : scene.error().message;
}

Scene accepted(const json& document) {
  const Result<Scene> scene = parsed(document);
  EXPECT_TRUE(scene) << messageOf(scene);
  return scene ? *scene : Scene{};
}

const SphereShape& sphereOf(const SceneBody& body) {
  return std::get<SphereShape>(body.shape);
}
const PlaneShape& planeShapeOf(const SceneBody& body) {
  return std::get<PlaneShape>(body.shape);
}

std::string readFile(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

std::vector<std::filesystem::path> libraryFiles() {
  std::vector<std::filesystem::path> files;
  for (const char* const folder : {"library", "shows"})
    for (const auto& entry : std::filesystem::directory_iterator(kScenes / folder))
      if (entry.path().extension() == ".json") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

/// Gap between a sphere and a block in m; minus the radius if the sphere's centre is inside.
double blockGap(const BlockShape& block, const SphereShape& sphere) {
  const Vec3 place = block.orientation.conjugate() * (sphere.position - block.centre);
  const Vec3 nearest = place.cwiseMax(-block.halfExtents).cwiseMin(block.halfExtents);
  return (place - nearest).norm() - sphere.radius;
}

/// The deepest overlap of a sphere with another body, in radii; by all pairs.
double deepestOverlap(const Scene& scene) {
  double deepest = 0.0;
  for (const SceneBody& body : scene.bodies) {
    const auto* sphere = std::get_if<SphereShape>(&body.shape);
    if (sphere == nullptr) continue;
    for (const SceneBody& other : scene.bodies) {
      if (&other == &body) continue;
      double gap = 0.0;
      if (const auto* plane = std::get_if<PlaneShape>(&other.shape)) {
        const double shift =
            plane->normal.dot(plane->oscillation.amplitude) * std::sin(plane->oscillation.phase);
        gap = plane->normal.dot(sphere->position) - plane->offset - shift - sphere->radius;
      } else if (const auto* block = std::get_if<BlockShape>(&other.shape)) {
        gap = blockGap(*block, *sphere);
      } else if (!std::holds_alternative<SphereShape>(other.shape)) {
        continue;  // solids are not examined, see docs/scenes.md; a jello has tests of its own
      } else {
        gap = (sphereOf(other).position - sphere->position).norm() - sphereOf(other).radius -
              sphere->radius;
      }
      deepest = std::max(deepest, -gap / sphere->radius);
    }
  }
  return deepest;
}

/// The first violated promise on which the rest of the program relies; empty if all hold.
std::string brokenPromise(const Scene& scene) {
  std::set<std::string> names;
  bool movable = false;
  for (const SceneBody& body : scene.bodies) {
    if (body.name.empty() || !names.insert(body.name).second) return "name " + body.name;
    const Material& material = body.material;
    if (material.name.empty() || !(material.density > 0.0) || !(material.youngsModulus > 0.0) ||
        !(material.poissonsRatio >= 0.0 && material.poissonsRatio < 0.5) ||
        !(material.restitution >= 0.0 && material.restitution <= 1.0)) {
      return "material of " + body.name;
    }
    if (const auto* sphere = std::get_if<SphereShape>(&body.shape)) {
      movable = true;
      if (!(sphere->radius >= 1e-6 && sphere->radius <= 1e4)) return "radius of " + body.name;
      if (!(sphere->mass > 0.0) || !std::isfinite(sphere->mass)) return "mass of " + body.name;
      if (!(sphere->position.cwiseAbs().maxCoeff() <= 1e6)) return "position of " + body.name;
      if (!(sphere->velocity.cwiseAbs().maxCoeff() <= 1e4)) return "velocity of " + body.name;
    } else if (const auto* block = std::get_if<BlockShape>(&body.shape)) {
      if (!(block->halfExtents.minCoeff() > 0.0)) return "extent of " + body.name;
      if (std::abs(block->orientation.norm() - 1.0) > 1e-12) return "rotation of " + body.name;
    } else if (const auto* solid = std::get_if<SolidShape>(&body.shape)) {
      movable = movable || solid->canMove();
      if (!(solid->mass > 0.0)) return "mass of " + body.name;
      if (std::abs(solid->orientation.norm() - 1.0) > 1e-12) return "rotation of " + body.name;
      if (!solid->position.allFinite()) return "position of " + body.name;
      const bool turns = solid->inertia.determinant() > 0.0 && solid->inertia.allFinite();
      if (solid->canMove() && !turns) return "inertia of " + body.name;
    } else if (const auto* jello = std::get_if<std::shared_ptr<const JelloShape>>(&body.shape)) {
      movable = true;
      const JelloLattice& lattice = (*jello)->lattice;
      const std::size_t points = lattice.count * lattice.count * lattice.count;
      if (!(lattice.size.minCoeff() > 0.0) || !(lattice.pointMass > 0.0))
        return "lattice of " + body.name;
      if ((*jello)->positions.size() != points || (*jello)->velocities.size() != points)
        return "points of " + body.name;
    } else if (std::abs(planeShapeOf(body).normal.norm() - 1.0) > 1e-12) {
      return "normal of " + body.name;
    }
  }
  if (!movable) return "nothing moves";
  if (!(scene.duration > 0.0 && scene.duration <= 3600.0)) return "duration";
  if (!(scene.sampleRate >= 8000.0 && scene.sampleRate <= 192000.0)) return "sample rate";
  if (scene.listeners.empty() || scene.name.empty()) return "listeners or name";
  for (const Listener& listener : scene.listeners) {
    if (const Status valid = validate(listener); !valid) return valid.error().message;
  }
  for (const ListenerPath& path : scene.paths) {
    PoseTrack track({0.0, scene.listeners.at(path.listener).position,
                     scene.listeners.at(path.listener).orientation});
    for (const ListenerPose& pose : path.poses) {
      if (!track.append(pose)) return "path of " + scene.listeners.at(path.listener).name;
    }
    if (track.droppedPoses() > 0) return "poses dropped";
  }
  const Room& room = scene.sound.room;
  if (!room.reflectors.empty() && !makeImages(room)) return "room";
  return deepestOverlap(scene) > 1.001e-9 ? "overlap" : "";
}

// --- Meaning of a document -----------------------------------------------------------------------

TEST(SceneLoader, DefaultsAreThoseOfTheReference) {
  const Scene scene = accepted(oneBall());
  EXPECT_EQ(scene.name, "test");
  EXPECT_EQ(scene.description, "");
  EXPECT_EQ(scene.sampleRate, 48000.0);
  EXPECT_EQ(scene.gravity, Vec3(0.0, -9.81, 0.0));
  EXPECT_EQ(scene.medium.density, 1.2);
  EXPECT_EQ(scene.medium.speedOfSound, 343.0);
  EXPECT_EQ(scene.medium.temperature, 293.15);
  EXPECT_EQ(scene.medium.humidity, 0.5);
  EXPECT_EQ(scene.medium.pressure, 101325.0);
  EXPECT_EQ(scene.stepper.type, StepperType::native);
  EXPECT_EQ(scene.stepper.step, 1.0 / 240.0);
  EXPECT_EQ(scene.stepper.restSpeed, 0.005);
  ASSERT_EQ(scene.bodies.size(), 2U);
  EXPECT_EQ(scene.bodies[0].name, "sphere1");
  EXPECT_EQ(scene.bodies[1].name, "plane1");
  EXPECT_EQ(sphereOf(scene.bodies[0]).velocity, Vec3::Zero());
  ASSERT_EQ(scene.listeners.size(), 1U);
  EXPECT_EQ(scene.listeners[0].name, "listener1");
}

TEST(SceneLoader, EveryFieldArrivesWhereItBelongs) {
  json document = oneBall();
  document["$schema"] = "scene.schema.json";
  document["name"] = "Fallversuch \u00fc";
  document["description"] = "two\nlines";
  document["sample_rate"] = 96000.0;
  document["seed"] = 9007199254740992;
  document["gravity"] = {1, 2, 3};
  document["air"] = {{"density", 1.1},
                     {"speed_of_sound", 330},
                     {"temperature", 280},
                     {"humidity", 0.8},
                     {"pressure", 9e4}};
  document["stepper"] = {{"type", "bullet"}, {"step", 0.01}, {"rest_speed", 0}, {"tuned", true}};
  document["materials"] = {{"oak", oak()}};
  document["bodies"][0] = {{"type", "sphere"},  {"name", "ball"},        {"radius", 0.5},
                           {"material", "oak"}, {"position", {1, 2, 3}}, {"velocity", {4, 5, 6}},
                           {"mass", 7}};
  document["listeners"] = {{{"name", "ear"}, {"position", {7, 8, 9}}}};
  const Scene scene = accepted(document);
  EXPECT_EQ(scene.name, "Fallversuch \u00fc");
  EXPECT_EQ(scene.description, "two\nlines");
  EXPECT_EQ(scene.sampleRate, 96000.0);
  EXPECT_EQ(scene.gravity, Vec3(1, 2, 3));
  EXPECT_EQ(scene.medium.density, 1.1);
  EXPECT_EQ(scene.medium.speedOfSound, 330.0);
  EXPECT_EQ(scene.medium.temperature, 280.0);
  EXPECT_EQ(scene.medium.humidity, 0.8);
  EXPECT_EQ(scene.medium.pressure, 9e4);
  EXPECT_EQ(scene.stepper.type, StepperType::bullet);
  EXPECT_EQ(scene.stepper.step, 0.01);
  EXPECT_EQ(scene.stepper.restSpeed, 0.0);
  EXPECT_TRUE(scene.stepper.tuned);
  const SceneBody& ball = scene.bodies.at(0);
  EXPECT_EQ(ball.name, "ball");
  EXPECT_EQ(ball.material.name, "oak");
  EXPECT_EQ(ball.material.density, 700.0);
  EXPECT_EQ(ball.material.youngsModulus, 1e10);
  EXPECT_EQ(ball.material.poissonsRatio, 0.3);
  EXPECT_EQ(ball.material.restitution, 0.5);
  EXPECT_EQ(sphereOf(ball).radius, 0.5);
  EXPECT_EQ(sphereOf(ball).mass, 7.0);
  EXPECT_EQ(sphereOf(ball).position, Vec3(1, 2, 3));
  EXPECT_EQ(sphereOf(ball).velocity, Vec3(4, 5, 6));
  EXPECT_EQ(scene.listeners.at(0).name, "ear");
  EXPECT_EQ(scene.listeners.at(0).position, Vec3(7, 8, 9));
}

TEST(SceneLoader, MechanicsAreOffUnlessTheSceneSaysOtherwise) {
  for (const json& document : {oneBall(), with("/mechanics", json::object())}) {
    const Scene scene = accepted(document);
    for (const SceneBody& body : scene.bodies) {
      EXPECT_EQ(body.contact.friction, 0.0);
      EXPECT_EQ(body.contact.rollingFriction, 0.0);
      EXPECT_EQ(body.contact.pivotingFriction, 0.0);
      EXPECT_EQ(body.contact.restitutionLaw, RestitutionLaw{});
    }
    EXPECT_EQ(sphereOf(scene.bodies[0]).spin, Vec3::Zero());
    EXPECT_EQ(planeShapeOf(scene.bodies[1]).velocity, Vec3::Zero());
    EXPECT_EQ(planeShapeOf(scene.bodies[1]).oscillation.amplitude, Vec3::Zero());
    EXPECT_EQ(scene.mechanics.simultaneous, Simultaneous::reflections);
    EXPECT_TRUE(scene.mechanics.rods.empty() && scene.mechanics.springs.empty());
    EXPECT_TRUE(scene.mechanics.fields.empty());
    EXPECT_EQ(scene.mechanics.drag.rate, 0.0);
    EXPECT_EQ(scene.mechanics.forceStep, 0.0);
  }
}

TEST(SceneLoader, FrictionAndLawsBelongToTheMaterialWhereverItIsUsed) {
  json document = oneBall();
  document["materials"]["oak"] = oak();
  document["materials"]["oak"].update({{"friction", 0.3},
                                       {"rolling_friction", 0.02},
                                       {"pivoting_friction", 1e-4},
                                       {"restitution_law", "plastic"},
                                       {"restitution_speed", 0.5}});
  document["bodies"][0]["material"] = "oak";
  document["bodies"][1]["material"] = "oak";
  document["bodies"].push_back(
      {{"type", "box"}, {"material", "oak"}, {"min", {-9, -9, -9}}, {"max", {9, 9, 9}}});
  json group = groupOf(2, 0.1, 1.0);
  group["material"] = {"oak"};
  group["min"] = {2, 2, 2};
  group["max"] = {3, 3, 3};
  document["bodies"].push_back(group);
  json block = withBlock({{"material", "oak"}})["bodies"][2];
  document["bodies"].push_back(block);
  const Scene scene = accepted(document);
  EXPECT_EQ(scene.bodies.size(), 11U);
  for (const SceneBody& body : scene.bodies) {
    EXPECT_EQ(body.contact.friction, 0.3) << body.name;
    EXPECT_EQ(body.contact.rollingFriction, 0.02) << body.name;
    EXPECT_EQ(body.contact.pivotingFriction, 1e-4) << body.name;
    EXPECT_EQ(body.contact.restitutionLaw, (RestitutionLaw{SpeedLaw::plastic, 0.5})) << body.name;
  }
}

TEST(SceneLoader, MotionsOfWallsAndSpinsArriveWhereTheyBelong) {
  json document =
      withBlock({{"velocity", {7, 8, 9}}, {"rotation", {{"axis", {0, -1e-9, 0}}, {"angle", 90}}}});
  document["bodies"][0]["spin"] = {1, 2, 3};
  document["bodies"][1].update(
      {{"velocity", {4, 5, 6}},
       {"oscillation", {{"amplitude", {0, 0.1, 0}}, {"frequency", 5}, {"phase", -1}}}});
  const Scene scene = accepted(document);
  EXPECT_EQ(sphereOf(scene.bodies[0]).spin, Vec3(1, 2, 3));
  const PlaneShape& plane = planeShapeOf(scene.bodies[1]);
  EXPECT_EQ(plane.velocity, Vec3(4, 5, 6));
  EXPECT_EQ(plane.oscillation.amplitude, Vec3(0, 0.1, 0));
  EXPECT_EQ(plane.oscillation.frequency, 5.0);
  EXPECT_EQ(plane.oscillation.phase, -1.0);
  EXPECT_EQ(scene.bodies[2].name, "block1");
  const auto& block = std::get<BlockShape>(scene.bodies[2].shape);
  EXPECT_EQ(block.centre, Vec3(5, 5, 5));
  EXPECT_EQ(block.halfExtents, Vec3(1, 1, 1));
  EXPECT_EQ(block.velocity, Vec3(7, 8, 9));
  // The rotation by -90 degrees about y takes x to z.
  EXPECT_LT((block.orientation * Vec3::UnitX() - Vec3::UnitZ()).norm(), 1e-14);
}

TEST(SceneLoader, EndsOfRodsAndSpringsAreBodiesByName) {
  json document = oneBall();
  document["bodies"].push_back(groupOf(2, 0.1, 0.5));
  document["bodies"][2]["min"] = {-9, 5, -9};
  document["bodies"][2]["max"] = {9, 9, 9};
  document["mechanics"] = {
      {"simultaneous", "hertz"},
      {"rods", {{{"bodies", {"spheres1.2", "sphere1"}}}}},
      {"springs",
       {{{"bodies", {"spheres1.1"}},
         {"anchor", {1, 2, 3}},
         {"length", 4},
         {"stiffness", 5},
         {"damping", 6}}}},
      {"fields", {{{"centre", {1, 2, 3}}, {"harmonic", -4}, {"inverse_square", 5}}}},
      {"drag", {{"rate", 0.5}, {"wind", {1, 0, 0}}}},
      {"force_step", 0.001}};
  const SceneMechanics mechanics = accepted(document).mechanics;
  EXPECT_EQ(mechanics.simultaneous, Simultaneous::hertz);
  ASSERT_EQ(mechanics.rods.size(), 1U);
  EXPECT_EQ(mechanics.rods[0].sphere, 3U);
  EXPECT_EQ(mechanics.rods[0].other, 0U);
  ASSERT_EQ(mechanics.springs.size(), 1U);
  EXPECT_EQ(mechanics.springs[0].sphere, 2U);
  EXPECT_EQ(mechanics.springs[0].other, kAnchor);
  EXPECT_EQ(mechanics.springs[0].anchor, Vec3(1, 2, 3));
  EXPECT_EQ(mechanics.springs[0].length, 4.0);
  EXPECT_EQ(mechanics.springs[0].stiffness, 5.0);
  EXPECT_EQ(mechanics.springs[0].damping, 6.0);
  ASSERT_EQ(mechanics.fields.size(), 1U);
  EXPECT_EQ(mechanics.fields[0].centre, Vec3(1, 2, 3));
  EXPECT_EQ(mechanics.fields[0].harmonic, -4.0);
  EXPECT_EQ(mechanics.fields[0].inverseSquare, 5.0);
  EXPECT_EQ(mechanics.drag.rate, 0.5);
  EXPECT_EQ(mechanics.drag.wind, Vec3(1, 0, 0));
  EXPECT_EQ(mechanics.forceStep, 0.001);
}

TEST(SceneLoader, SoundIsTheSynthsDefaultUnlessTheSceneSaysOtherwise) {
  for (const json& document : {oneBall(), with("/sound", json::object())}) {
    const SynthSettings sound = accepted(document).sound;
    const SynthSettings absent;
    EXPECT_EQ(sound.comparison.pulse, absent.comparison.pulse);
    EXPECT_EQ(sound.dissipative, absent.dissipative);
    EXPECT_EQ(sound.comparison.sampling, absent.comparison.sampling);
    EXPECT_EQ(sound.comparison.radiation, absent.comparison.radiation);
    EXPECT_EQ(sound.modalRadiation, absent.modalRadiation);
    EXPECT_EQ(sound.doppler, absent.doppler);
    EXPECT_EQ(sound.airAbsorption, absent.airAbsorption);
    EXPECT_EQ(sound.audibleThreshold, absent.audibleThreshold);
    EXPECT_EQ(sound.impulse, absent.impulse);
    EXPECT_TRUE(sound.room.reflectors.empty());
    EXPECT_FALSE(sound.reverb);
  }
  EXPECT_EQ(accepted(oneBall()).recoil, RecoilModel::shape);
  EXPECT_EQ(accepted(with("/sound", {{"recoil", "sphere"}})).recoil, RecoilModel::sphere);
  EXPECT_EQ(accepted(with("/sound", {{"recoil", "shape"}})).recoil, RecoilModel::shape);
  const SynthSettings sound = accepted(with("/sound", {{"pulse", "gaussian"},
                                                       {"sampling", "naive"},
                                                       {"radiation", "compact"},
                                                       {"modal_radiation", "monopole"},
                                                       {"ringing", "coupled"},
                                                       {"doppler", false},
                                                       {"air_absorption", false},
                                                       {"audible_threshold", 0.25},
                                                       {"impulse", "applied"}}))
                                  .sound;
  EXPECT_EQ(sound.comparison.pulse, PulseShape::gaussian);
  EXPECT_EQ(sound.comparison.sampling, Sampling::naive);
  EXPECT_EQ(sound.comparison.radiation, Radiation::compact);
  EXPECT_EQ(sound.modalRadiation, ModalRadiation::monopole);
  EXPECT_EQ(sound.ringingContact, RingingContact::coupled);
  EXPECT_FALSE(sound.doppler);
  EXPECT_FALSE(sound.airAbsorption);
  EXPECT_EQ(sound.audibleThreshold, 0.25);
  EXPECT_EQ(sound.impulse, ImpulseChoice::applied);
  EXPECT_TRUE(accepted(with("/sound", {{"dissipative", true}})).sound.dissipative);
  const std::map<std::string, PulseShape> shapes = {
      {"hertz", PulseShape::hertz},
      {"half_sine", PulseShape::halfSine},
      {"mitchell_netravali", PulseShape::mitchellNetravali},
      {"course_gaussian", PulseShape::courseGaussian}};
  for (const auto& [name, shape] : shapes)
    EXPECT_EQ(accepted(with("/sound", {{"pulse", name}})).sound.comparison.pulse, shape) << name;
}

TEST(SceneLoader, BodiesRingAsTheirModesSayAndNotAtAllWithoutThem) {
  const auto ringing = [](const json& document, std::size_t body) {
    return accepted(document).bodies.at(body).ringing;
  };
  EXPECT_FALSE(ringing(oneBall(), 0));
  const auto file = ringing(withModes("models/ball.carom_modes"), 0);
  ASSERT_TRUE(file);
  EXPECT_EQ(file->model.path.filename(), "ball.carom_modes");
  EXPECT_EQ(file->model.path.parent_path().filename(), "models");
  const auto chosen = ringing(withModes({{"file", "bells.glb"}, {"node", "tenor"}}), 0);
  ASSERT_TRUE(chosen);
  EXPECT_EQ(chosen->model.path.filename(), "bells.glb");
  EXPECT_EQ(chosen->model.node, "tenor");
  const auto plain = ringing(withModes(json::object()), 0);
  ASSERT_TRUE(plain);
  EXPECT_TRUE(plain->model.empty());
  MeshAnalysisSettings defaults;
  defaults.shell.maxModes = 60;  // "count", of either
  EXPECT_EQ(plain->analysis, defaults);
  const auto solid = ringing(
      withSolid({{"modes", {{"body", "solid"}, {"dofs", 3000}, {"count", 7}, {"panels", 200}}}}),
      2);
  ASSERT_TRUE(solid);
  EXPECT_EQ(solid->analysis.body, BodyModel::solid);
  EXPECT_EQ(solid->analysis.solid.grid.degreesOfFreedom, 3000U);
  EXPECT_EQ(solid->analysis.solid.maxModes, 7);
  ASSERT_TRUE(solid->analysis.radiation);
  EXPECT_EQ(solid->analysis.radiation->panels, 200U);
  const auto shell = ringing(
      withModes({{"body", "shell"}, {"thickness", 0.002}, {"springs", "axial"}, {"count", 9}}), 0);
  ASSERT_TRUE(shell);
  EXPECT_EQ(shell->analysis.body, BodyModel::shell);
  EXPECT_EQ(shell->analysis.shell.thickness, 0.002);
  EXPECT_EQ(shell->analysis.shell.springs, ShellSprings::axial);
  EXPECT_EQ(shell->analysis.shell.maxModes, 9U);
}

TEST(SceneLoader, ModelFilesAreRelativeToTheSceneAndNotOpenedYet) {
  const Result<Scene> scene =
      parseScene(withModes("ball.carom_modes").dump(), "/some/folder/test.json");
  ASSERT_TRUE(scene) << messageOf(scene);
  EXPECT_EQ(scene->bodies[0].ringing->model.path, "/some/folder/ball.carom_modes");
}

TEST(SceneLoader, DampingBelongsToTheMaterial) {
  const Scene scene = accepted(withOak({{"damping_alpha", 20}, {"damping_beta", 2e-6}}));
  EXPECT_EQ(scene.bodies[0].material.dampingAlpha, 20.0);
  EXPECT_EQ(scene.bodies[0].material.dampingBeta, 2e-6);
  const Scene lossy = accepted(withOak({{"loss_factor", 0.01}, {"loss_exponent", -0.5}}));
  EXPECT_EQ(lossy.bodies[0].material.lossFactor, 0.01);
  EXPECT_EQ(lossy.bodies[0].material.lossExponent, -0.5);
  const Scene warm = accepted(withOak(
      {{"thermal_expansion", 5e-6}, {"thermal_conductivity", 0.2}, {"heat_capacity", 1600}}));
  EXPECT_EQ(warm.bodies[0].material.thermal, (ThermalProperties{5e-6, 0.2, 1600.0}));
  const Scene without = accepted(withOak(json::object()));
  EXPECT_EQ(without.bodies[0].material.thermal, ThermalProperties{});
  EXPECT_EQ(without.bodies[0].material.lossFactor, 0.0);
  EXPECT_EQ(without.bodies[0].material.dampingAlpha, 0.0);
  EXPECT_EQ(without.bodies[0].material.dampingBeta, 0.0);
}

TEST(SceneLoader, EveryPlaneOfARoomReflectsOnTheSideItsNormalPointsTo) {
  const Scene scene = accepted(with("/room", json::object()));
  const Room& room = scene.sound.room;
  EXPECT_EQ(room.order, 1);
  ASSERT_EQ(room.reflectors.size(), 1U);
  EXPECT_EQ(room.reflectors[0].normal, Vec3(0, 1, 0));
  EXPECT_EQ(room.reflectors[0].absorption.coefficients,
            findSurface("concrete")->absorption.coefficients);
  // The ball is in the room's air, and its image is as far below the floor.
  const auto images = makeImages(room);
  ASSERT_TRUE(images);
  ASSERT_EQ(images->size(), 1U);
  const Vec3& ball = sphereOf(scene.bodies[0]).position;
  EXPECT_TRUE(isVisible(room, images->front(), ball, scene.listeners[0].position));
  EXPECT_EQ(images->front().position(ball), Vec3(0, -1, 0));
}

TEST(SceneLoader, WallsHaveTheSurfaceOfTheirNameThenOfTheirBoxThenOfTheirMaterial) {
  const json bands = {0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7};
  const Scene scene = accepted(
      inBox("wood", {{"order", 2}, {"surfaces", {{"hall", "plaster"}, {"hall.top", bands}}}}));
  const Room& room = scene.sound.room;
  ASSERT_EQ(room.reflectors.size(), 6U);
  EXPECT_EQ(room.order, 2);
  for (const Reflector& wall : room.reflectors) {
    const bool isTop = wall.normal.y() < -0.5;
    EXPECT_EQ(wall.absorption.coefficients[2],
              isTop ? 0.3 : findSurface("plaster")->absorption.coefficients[2]);
  }
  const Scene bare = accepted(inBox("wood", json::object()));
  EXPECT_EQ(bare.sound.room.reflectors.at(5).absorption.coefficients,
            findSurface("wood_floor")->absorption.coefficients);
}

TEST(SceneLoader, ReverberationIsTheBoxesOrWhatIsGiven) {
  EXPECT_FALSE(accepted(inBox("wood", {{"reverb", false}})).sound.reverb);
  const auto reverb = accepted(inBox("wood", {{"reverb", true}, {"order", 3}})).sound.reverb;
  ASSERT_TRUE(reverb);
  EXPECT_NEAR(reverb->volume, 60.0, 1e-9);
  EXPECT_NEAR(reverb->surface, 2.0 * (15.0 + 20.0 + 12.0), 1e-9);
  // Eyring's formula by hand, at 1 kHz. The air's part comes later.
  const double alpha = findSurface("wood_floor")->absorption.coefficients[3];
  const double time = 24.0 * std::log(10.0) * 60.0 / (343.0 * 94.0 * -std::log(1.0 - alpha));
  EXPECT_NEAR(reverb->decayTimes[3], time, 1e-9 * time);
  EXPECT_FALSE(reverb->includesAir);
  const auto timed = accepted(inBox("wood", {{"reverb", {{"t60", 1.5}}}})).sound.reverb;
  ASSERT_TRUE(timed);
  EXPECT_NEAR(timed->volume, 60.0, 1e-9);
  for (const double t60 : timed->decayTimes)
    EXPECT_EQ(t60, 1.5);
  json hall = with(
      "/room",
      {{"reverb", {{"t60", {3, 2.5, 2, 2, 1.8, 1.5, 1}}, {"volume", 2000}, {"surface", 1100}}}});
  const auto given = accepted(hall).sound.reverb;
  ASSERT_TRUE(given);
  EXPECT_EQ(given->volume, 2000.0);
  EXPECT_EQ(given->surface, 1100.0);
  EXPECT_EQ(given->decayTimes.front(), 3.0);
  EXPECT_EQ(given->decayTimes.back(), 1.0);
  hall["bodies"].erase(1);
  EXPECT_TRUE(accepted(hall).sound.reverb);  // this needs no walls among the bodies
  EXPECT_TRUE(accepted(hall).sound.room.reflectors.empty());
}

TEST(SceneLoader, ListenersHaveFormatsAndTheirAnglesAreInDegrees) {
  const Scene plain = accepted(oneBall());
  EXPECT_EQ(plain.listeners[0].format, ListenerFormat::mono);
  EXPECT_EQ(plain.listeners[0].orientation.coeffs(), Quat::Identity().coeffs());
  EXPECT_TRUE(plain.paths.empty());
  const Listener pair =
      accepted(
          withListener(
              {{"format", "spaced_pair"}, {"spacing", 0.17}, {"half_angle", 55}, {"pattern", 0.5}}))
          .listeners[0];
  EXPECT_EQ(pair.format, ListenerFormat::spacedPair);
  EXPECT_EQ(pair.spacing, 0.17);
  EXPECT_NEAR(pair.halfAngle, 0.9599310885968813, 1e-15);
  EXPECT_EQ(pair.pattern, 0.5);
  EXPECT_EQ(accepted(withListener({{"format", "coincident_pair"}})).listeners[0].format,
            ListenerFormat::coincidentPair);
  EXPECT_EQ(accepted(withListener({{"format", "binaural"}})).listeners[0].format,
            ListenerFormat::binaural);
}

TEST(SceneLoader, ListenersLookWhereTheyAreTold) {
  const auto axes = [](const json& keys) {
    return accepted(withListener(keys)).listeners[0].orientation.toRotationMatrix();
  };
  // The listener stands at (0, 1, 1).
  Eigen::Matrix3d frame = axes({{"looks_at", {4, 1, 1}}});
  EXPECT_TRUE((-frame.col(2)).isApprox(Vec3::UnitX()));
  EXPECT_TRUE(frame.col(0).isApprox(Vec3::UnitZ()));  // the listener's right
  EXPECT_TRUE(frame.col(1).isApprox(Vec3::UnitY()));
  frame = axes({{"forward", {0, -1e-5, 0}}, {"up", {0, 0, -7}}});
  EXPECT_TRUE((-frame.col(2)).isApprox(-Vec3::UnitY()));
  EXPECT_TRUE(frame.col(1).isApprox(-Vec3::UnitZ()));
  EXPECT_TRUE(frame.col(0).isApprox(Vec3::UnitX()));
  frame = axes({{"forward", {0, 1, -1}}});  // up is made perpendicular to forward
  EXPECT_TRUE(frame.col(1).isApprox(Vec3(0, 1, 1).normalized()));
  EXPECT_TRUE(axes({{"forward", {0, 0, -1}}}).isIdentity(0.0));
}

TEST(SceneLoader, PosesKeepTheAimOfTheOneBefore) {
  json path = {poseAt(1, 1, 1, 0), poseAt(2, 0, 1, -1), poseAt(3, 5, 1, 5)};
  path[2]["forward"] = {0, 0, 1};
  const Scene scene = accepted(withListener({{"looks_at", {0, 1, 0}}, {"path", path}}));
  ASSERT_EQ(scene.paths.size(), 1U);
  EXPECT_EQ(scene.paths[0].listener, 0U);
  const auto& poses = scene.paths[0].poses;
  ASSERT_EQ(poses.size(), 3U);
  EXPECT_EQ(poses[1].time, 2.0);
  EXPECT_EQ(poses[1].position, Vec3(0, 1, -1));
  const auto forward = [](const Quat& orientation) { return Vec3(orientation * -Vec3::UnitZ()); };
  EXPECT_TRUE(forward(scene.listeners[0].orientation).isApprox(-Vec3::UnitZ()));
  EXPECT_TRUE(forward(poses[0].orientation).isApprox(-Vec3::UnitX()));
  EXPECT_TRUE(forward(poses[1].orientation).isApprox(Vec3::UnitZ()));
  EXPECT_TRUE(forward(poses[2].orientation).isApprox(Vec3::UnitZ()));
}

TEST(SceneLoader, SofaFilesAreRelativeToTheScene) {
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "carom_heads";
  std::filesystem::create_directory(folder);
  std::ofstream(folder / "head.sofa") << "x";
  const json document = withListener({{"format", "binaural"}, {"sofa", "head.sofa"}});
  std::ofstream(folder / "scene.json") << document;
  const Result<Scene> scene = loadScene(folder / "scene.json");
  ASSERT_TRUE(scene) << messageOf(scene);
  ASSERT_EQ(scene->headFiles.size(), 1U);
  EXPECT_EQ(scene->headFiles[0].sofa, folder / "head.sofa");
  std::filesystem::remove_all(folder);
}

// Such a scene ran no step, made an empty file, and said nothing.
TEST(SceneLoader, ADurationOfLessThanASampleIsRefused) {
  json document = with("/sample_rate", 8000);
  document["duration"] = 1.25e-4;
  EXPECT_TRUE(parseScene(document.dump(), "short.json"));
  document["duration"] = 1.24e-4;
  const auto scene = parseScene(document.dump(), "short.json");
  ASSERT_FALSE(scene);
  EXPECT_EQ(
      scene.error().message,
      "short.json: /duration: 0.000124 s is less than a sample; expected at least 0.000125 s");
}

TEST(SceneLoader, AConfinedSceneNamesFilesInItsFolderOnly) {
  namespace fs = std::filesystem;
  const test::TemporaryFolder folder;
  fs::create_directories(folder / "in/below");
  for (const char* name : {"head.sofa", "in/head.sofa", "in/below/head.sofa"})
    std::ofstream(folder / name) << "something";
  fs::create_symlink("../head.sofa", folder / "in/out.sofa");
  fs::create_symlink("below/head.sofa", folder / "in/link.sofa");
  fs::create_directory_symlink("..", folder / "in/up");
  const auto refusal = [&](const std::string& name, const FileAccess& access) {
    const json listener = {{"position", {0, 1, 1}}, {"format", "binaural"}, {"sofa", name}};
    const auto scene = parseScene(with("/listeners/0", listener).dump(),
                                  (folder / "in/scene.json").string(), access);
    return scene ? std::string() : scene.error().message;
  };
  for (const char* name : {"head.sofa", "below/head.sofa", "below/../head.sofa", "link.sofa"})
    EXPECT_EQ(refusal(name, {.confined = true}), "") << name;
  const std::string absolute = (folder / "head.sofa").string();
  for (const std::string name : {"../head.sofa", "below/../../head.sofa", "out.sofa",
                                 "up/head.sofa", "up/in/../head.sofa", absolute.c_str()}) {
    EXPECT_EQ(refusal(name, {}), "") << name;
    const std::string why = refusal(name, {.confined = true});
    EXPECT_NE(why.find("/listeners/0/sofa: "), std::string::npos) << why;
    EXPECT_NE(why.find("leads out of the folder of the scene"), std::string::npos) << why;
  }
  EXPECT_NE(refusal("below/head.sofa", {.confined = true, .folder = folder / "in/below"}), "");
}

TEST(SceneLoader, MassIsDensityTimesVolumeUnlessGiven) {
  // Mass of a steel ball of 1 cm radius: 8940 kg/m^3 * 4.18879 cm^3 = 37.448 g, by hand.
  EXPECT_NEAR(sphereOf(accepted(oneBall()).bodies.at(0)).mass, 0.037448, 5e-7);
}

TEST(SceneLoader, RestitutionsArePairsOfNamesWhateverTheBodiesAreCalled) {
  json document = with("/materials", {{"oak", oak()}});
  document["restitutions"] = {{{"materials", {"oak", "steel"}}, {"restitution", 0.125}},
                              {{"materials", {"glass", "glass"}}, {"restitution", 0.25}}};
  document["bodies"] = {sphereAt(0.1, 0, 0, 0), sphereAt(0.1, 1, 0, 0), sphereAt(0.1, 2, 0, 0),
                        sphereAt(0.1, 3, 0, 0), groupOf(1, 0.1, 0.5)};
  document["bodies"][4]["min"] = {5, 5, 5};
  document["bodies"][4]["max"] = {6, 6, 6};
  document["bodies"][4]["material"] = {"oak"};
  document["bodies"][1]["material"] = "steel";
  document["bodies"][2]["material"] = oak();  // an inline material, though its body is called oak
  document["bodies"][2]["name"] = "oak";
  document["bodies"].push_back(
      {{"type", "plane"}, {"normal", {0, 1, 0}}, {"offset", -9}, {"material", "steel"}});
  document["bodies"].push_back(
      {{"type", "box"}, {"min", {-9, -9, -9}}, {"max", {9, 9, 9}}, {"material", "oak"}});
  const Scene scene = accepted(document);
  const auto of = [&](std::size_t body, std::size_t other) {
    return restitutionOf(scene, scene.bodies.at(body), scene.bodies.at(other));
  };
  EXPECT_EQ(scene.restitutions.size(), 2U);
  EXPECT_EQ(of(0, 3), 0.25);             // glass and glass
  EXPECT_EQ(of(1, 4), 0.125);            // steel and the group's oak
  EXPECT_EQ(of(4, 5), 0.125);            // oak and the steel plane
  EXPECT_EQ(of(6, 1), 0.125);            // a wall of oak and steel
  EXPECT_EQ(of(1, 2), std::sqrt(0.45));  // steel and the inline oak
  EXPECT_EQ(of(1, 5), std::sqrt(0.81));  // steel and steel
  EXPECT_EQ(of(2, 2), std::sqrt(0.25));
}

TEST(SceneLoader, InlineMaterialsAreNamedAfterTheirBody) {
  json named = with("/bodies/0/material", oak());
  EXPECT_EQ(accepted(named).bodies.at(0).material.name, "sphere1");
  named["bodies"][0]["name"] = "ball";
  EXPECT_EQ(accepted(named).bodies.at(0).material.name, "ball");
}

/// oneBall() whose sphere is of the material "own", and whose scene has these materials.
json withOwn(const json& materials) {
  json document = with("/materials", materials);
  document["bodies"][0]["material"] = "own";
  return document;
}

TEST(SceneLoader, MaterialThatIsLikeAnotherHasAllOfItButWhatItGives) {
  const Scene scene =
      accepted(withOwn({{"own", {{"like", "wood"}, {"density", 500}, {"friction", 0.3}}}}));
  Material expected = *findMaterial("wood");
  expected.name = "own";
  expected.density = 500.0;
  EXPECT_EQ(scene.bodies[0].material, expected);  // roughness and damping included
  EXPECT_GT(scene.bodies[0].material.roughness.rmsHeight, 0.0);
  EXPECT_EQ(scene.bodies[0].contact.friction, 0.3);
  EXPECT_EQ(scene.bodies[0].contact.defaultFriction, 0.0);
}

TEST(SceneLoader, LikenessLeadsThroughOwnMaterialsInAnyOrderOfTheirNames) {
  json far = oak();
  far.update({{"friction", 0.2},
              {"rolling_friction", 0.01},
              {"pivoting_friction", 1e-4},
              {"restitution_law", "plastic"},
              {"restitution_speed", 0.5},
              {"damping_beta", 1e-6},
              {"roughness", {{"rms_height", 1e-6}, {"correlation_length", 1e-4}}}});
  const json materials = {{"own", {{"like", "z"}, {"density", 2}}},
                          {"z", {{"like", "a"}, {"restitution", 0.125}}},
                          {"a", far}};
  json inPlace = withOwn(materials);
  inPlace["bodies"][0]["material"] = {{"like", "z"}, {"density", 2}};
  inPlace["bodies"][0]["name"] = "own";
  for (const json& document : {withOwn(materials), inPlace}) {
    const SceneBody body = accepted(document).bodies.at(0);
    EXPECT_EQ(body.material.name, "own");
    EXPECT_EQ(body.material.density, 2.0);
    EXPECT_EQ(body.material.restitution, 0.125);
    EXPECT_EQ(body.material.youngsModulus, 1e10);
    EXPECT_EQ(body.material.dampingBeta, 1e-6);
    EXPECT_EQ(body.material.roughness.rmsHeight, 1e-6);
    EXPECT_EQ(body.contact.friction, 0.2);
    EXPECT_EQ(body.contact.rollingFriction, 0.01);
    EXPECT_EQ(body.contact.pivotingFriction, 1e-4);
    EXPECT_EQ(body.contact.restitutionLaw, (RestitutionLaw{SpeedLaw::plastic, 0.5}));
  }
}

TEST(SceneLoader, LawOfTheOtherMaterialCanBeChangedOrTakenBack) {
  json soft = oak();
  soft.update({{"restitution_law", "plastic"}, {"restitution_speed", 0.5}});
  const auto lawOf = [&soft](const json& own) {
    return accepted(withOwn({{"soft", soft}, {"own", own}})).bodies.at(0).contact.restitutionLaw;
  };
  EXPECT_EQ(lawOf({{"like", "soft"}, {"restitution_speed", 2}}),
            (RestitutionLaw{SpeedLaw::plastic, 2.0}));
  EXPECT_EQ(lawOf({{"like", "soft"}, {"restitution_law", "viscoelastic"}}),
            (RestitutionLaw{SpeedLaw::viscoelastic, 0.5}));
  EXPECT_EQ(lawOf({{"like", "soft"}, {"restitution_law", "constant"}}), RestitutionLaw{});
}

TEST(SceneLoader, RestitutionsOfAPairAreNotThoseOfAMaterialLikeIt) {
  json document = withOwn({{"own", {{"like", "steel"}}}});
  document["bodies"][1]["material"] = "steel";
  document["restitutions"] = {{{"materials", {"steel", "steel"}}, {"restitution", 0.125}}};
  const Scene scene = accepted(document);
  EXPECT_EQ(restitutionOf(scene, scene.bodies[0], scene.bodies[1]),
            findMaterial("steel")->restitution);
}

TEST(SceneLoader, PlaneOfAMaterialLikeABuiltInOneAbsorbsAsThat) {
  json document = with("/room", json::object());
  const Room plain = accepted(document).sound.room;
  document["bodies"][1]["material"] = {{"like", "concrete"}, {"friction", 0.2}};
  const Room alike = accepted(document).sound.room;
  ASSERT_EQ(alike.reflectors.size(), plain.reflectors.size());
  EXPECT_EQ(alike.reflectors[0].absorption.coefficients,
            plain.reflectors[0].absorption.coefficients);
}

TEST(SceneLoader, FrictionOfABodyComesBeforeThatOfItsMaterial) {
  json rough = oak();
  rough["friction"] = 0.3;
  for (const json& material : {json("wood"), rough}) {
    for (const double friction : {0.0, 0.7}) {
      json document = withSolid({{"material", material}, {"friction", friction}});
      document["bodies"][0].update({{"material", material}, {"friction", friction}});
      document["bodies"][1].update({{"material", material}, {"friction", friction}});
      json group = groupOf(2, 0.1, 1.0);
      group.update({{"min", {20, 20, 20}}, {"max", {21, 21, 21}}, {"friction", friction}});
      document["bodies"].push_back(group);
      for (const SceneBody& body : accepted(document).bodies) {
        EXPECT_EQ(body.contact.friction, friction) << body.name;
        EXPECT_EQ(body.contact.defaultFriction, 0.0) << body.name;
      }
    }
  }
}

TEST(SceneLoader, BuiltInMaterialsHaveTheFrictionOfTheirPageForSolidsAlone) {
  const json block = withBlock({{"material", "wood"}})["bodies"][2];
  json document = withSolid({{"material", "wood"}, {"position", {20, 20, 20}}});
  document["bodies"].push_back(block);
  const Scene scene = accepted(document);
  for (const SceneBody& body : scene.bodies)
    EXPECT_EQ(body.contact.friction, 0.0) << body.name;
  EXPECT_EQ(frictionWithSolids(scene.bodies[0]), 0.0);  // a sphere
  EXPECT_EQ(frictionWithSolids(scene.bodies[1]), dryFriction("concrete"));
  EXPECT_EQ(frictionWithSolids(scene.bodies[2]), dryFriction("wood"));
  EXPECT_EQ(frictionWithSolids(scene.bodies[3]), dryFriction("wood"));
  // The rows of the table in docs/materials.md.
  const std::string page = readFile(kScenes.parent_path() / "docs" / "materials.md");
  const std::string section = page.substr(page.find("\n## Friction\n"));
  for (const Material& material : builtInMaterials()) {
    std::ostringstream row;
    row << "\n| `" << material.name << "` | " << dryFriction(material.name) << " | ";
    EXPECT_NE(section.find(row.str()), std::string::npos) << row.str();
    EXPECT_GT(dryFriction(material.name), 0.0) << material.name;
  }
  EXPECT_EQ(dryFriction("unobtainium"), 0.0);
}

TEST(MaterialFile, IsAMaterialAsInASceneAndItsErrorsNameThePlace) {
  const test::TemporaryFolder folder;
  const auto load = [&folder](const std::string& text) {
    std::ofstream(folder / "bell metal.json") << text;
    return loadMaterial(folder / "bell metal.json");
  };
  const Result<Material> made = load(R"({"like": "bronze", "density": 8600})");
  ASSERT_TRUE(made) << made.error().message;
  Material expected = *findMaterial("bronze");
  expected.name = "bell metal";
  expected.density = 8600.0;
  EXPECT_EQ(*made, expected);
  for (const auto& [text, says] : {std::pair{R"({"like": "bronce"})", "/like: unknown material"},
                                   {R"({"like": "bronze", "density": -1})", "/density: -1 is not"},
                                   {R"({"like": "bronze", "colour": 1})", "/colour: unknown key"},
                                   {R"({"density": 8600})", "/youngs_modulus: missing"},
                                   {R"("bronze")", "is not a material; expected an object"},
                                   {"", "the document is empty"}}) {
    const Result<Material> refused = load(text);
    ASSERT_FALSE(refused) << text;
    EXPECT_TRUE(refused.error().message.starts_with((folder / "bell metal.json").string() + ": "))
        << refused.error().message;
    EXPECT_NE(refused.error().message.find(says), std::string::npos) << refused.error().message;
  }
  EXPECT_FALSE(loadMaterial(folder / "absent.json"));
}

TEST(SceneLoader, DefaultNamesStepAsideForGivenOnes) {
  json document =
      withBodies({sphereAt(0.1, 0, 0, 0), sphereAt(0.1, 1, 0, 0), sphereAt(0.1, 2, 0, 0)});
  document["bodies"][2]["name"] = "sphere1";
  document["listeners"] = {{{"position", {0, 0, 0}}},
                           {{"position", {0, 0, 0}}, {"name", "listener1"}}};
  const Scene scene = accepted(document);
  EXPECT_EQ(scene.bodies.at(0).name, "sphere2");
  EXPECT_EQ(scene.bodies.at(1).name, "sphere3");
  EXPECT_EQ(scene.listeners.at(0).name, "listener2");
}

TEST(SceneLoader, DefaultNamesStepAsideForPartsOfGivenOnes) {
  json document = withBodies(
      {sphereAt(0.1, 0, 0, 0),
       {{"type", "box"}, {"material", "wood"}, {"min", {-1, -1, -1}}, {"max", {1, 1, 1}}}});
  document["bodies"][0]["name"] = "box1.left";
  EXPECT_EQ(accepted(document).bodies.at(1).name, "box2.left");
}

TEST(SceneLoader, NormalsOfAnyLengthAreNormalised) {
  for (const double length : {1e-300, 5e-324, 1e-3, 1.0, 1e6}) {
    json document = with("/bodies/1/normal", {0, length, length});
    document["bodies"][1].erase("offset");
    document["bodies"][1]["point"] = {5, -1, 0};
    const PlaneShape plane = planeShapeOf(accepted(document).bodies.at(1));
    EXPECT_TRUE(plane.normal.isApprox(Vec3(0, std::sqrt(0.5), std::sqrt(0.5)), 1e-15)) << length;
    EXPECT_NEAR(plane.offset, -std::sqrt(0.5), 1e-15) << length;
  }
}

TEST(SceneLoader, BoxIsSixPlanesThatFaceInwards) {
  const Vec3 min(-1, -2, -3);
  const Vec3 max(4, 5, 6);
  json document = withBodies({sphereAt(0.1, 0, 0, 0),
                              {{"type", "box"},
                               {"name", "crate"},
                               {"material", "wood"},
                               {"min", {-1, -2, -3}},
                               {"max", {4, 5, 6}}}});
  const Scene scene = accepted(document);
  ASSERT_EQ(scene.bodies.size(), 7U);
  // A point of each wall and its normal, towards the inside of the box.
  const std::map<std::string, std::pair<Vec3, Vec3>> walls = {
      {"crate.left", {Vec3(-1, 0, 0), Vec3(1, 0, 0)}},
      {"crate.right", {Vec3(4, 0, 0), Vec3(-1, 0, 0)}},
      {"crate.bottom", {Vec3(0, -2, 0), Vec3(0, 1, 0)}},
      {"crate.top", {Vec3(0, 5, 0), Vec3(0, -1, 0)}},
      {"crate.back", {Vec3(0, 0, -3), Vec3(0, 0, 1)}},
      {"crate.front", {Vec3(0, 0, 6), Vec3(0, 0, -1)}}};
  for (std::size_t index = 1; index < scene.bodies.size(); ++index) {
    const SceneBody& body = scene.bodies[index];
    const PlaneShape& wall = planeShapeOf(body);
    ASSERT_TRUE(walls.contains(body.name)) << body.name;
    EXPECT_EQ(wall.normal, walls.at(body.name).second) << body.name;
    EXPECT_EQ(wall.normal.dot(walls.at(body.name).first), wall.offset) << body.name;
    EXPECT_GT(wall.normal.dot(0.5 * (min + max)), wall.offset) << body.name;
    EXPECT_EQ(body.material.name, "wood");
  }
}

TEST(SceneLoader, TouchingIsNoOverlap) {
  accepted(
      withBodies({sphereAt(0.1, 0, 0.1, 0), sphereAt(0.2, 0.3, 0.1, 0), planeOf({1, 0, 0})})
          .patch(json::parse(R"([{"op": "add", "path": "/bodies/2/offset", "value": -0.1}])")));
  accepted(withBodies({sphereAt(0.1, 0, 0, 0), sphereAt(0.1, 0.2 - 5e-11, 0, 0)}));
}

// --- Groups --------------------------------------------------------------------------------------

TEST(SceneGroup, SpheresLieInTheirBoxAndDoNotOverlap) {
  json document = withBodies({sphereAt(0.2, 0.3, 0.3, 0), groupOf(300, {0.02, 0.06}, 0.5),
                              planeOf({1, 1, 0}), groupOf(20, {0.05, 0.1}, 2.0)});
  const Scene scene = accepted(document);
  ASSERT_EQ(scene.bodies.size(), 322U);
  EXPECT_EQ(scene.bodies[1].name, "spheres1.1");
  EXPECT_EQ(scene.bodies[300].name, "spheres1.300");
  EXPECT_EQ(scene.bodies[321].name, "spheres2.20");
  EXPECT_EQ(deepestOverlap(scene), 0.0);
  for (std::size_t index = 1; index <= 300; ++index) {
    const SphereShape& sphere = sphereOf(scene.bodies[index]);
    EXPECT_LE(sphere.position.cwiseAbs().maxCoeff() + sphere.radius, 0.5);
  }
}

TEST(SceneGroup, RadiiSpeedsAndMaterialsAreSpreadOverTheirRanges) {
  json document = withBodies(json::array({groupOf(2000, {0.01, 0.02}, 2.0)}));
  document["bodies"][0]["speed"] = {1, 3};
  document["bodies"][0]["material"] = {"steel", oak(), "glass"};
  const Scene scene = accepted(document);
  double radii = 0.0;
  double speeds = 0.0;
  Vec3 velocities = Vec3::Zero();
  std::map<std::string, int> materials;
  for (const SceneBody& body : scene.bodies) {
    const SphereShape& sphere = sphereOf(body);
    ASSERT_TRUE(sphere.radius >= 0.01 && sphere.radius <= 0.02);
    ASSERT_TRUE(sphere.velocity.norm() >= 1.0 - 1e-12 && sphere.velocity.norm() <= 3.0 + 1e-12);
    const double volume = 4.0 / 3.0 * std::numbers::pi * std::pow(sphere.radius, 3);
    EXPECT_NEAR(sphere.mass, body.material.density * volume, 1e-12);
    radii += sphere.radius / 2000.0;
    speeds += sphere.velocity.norm() / 2000.0;
    velocities += sphere.velocity / 2000.0;
    ++materials[body.material.name];
  }
  // Means of uniform distributions lie within five standard errors.
  EXPECT_NEAR(radii, 0.015, 5.0 * 0.01 / std::sqrt(12.0 * 2000.0));
  EXPECT_NEAR(speeds, 2.0, 5.0 * 2.0 / std::sqrt(12.0 * 2000.0));
  EXPECT_LT(velocities.cwiseAbs().maxCoeff(), 5.0 * std::sqrt(13.0 / 9.0 / 2000.0));
  ASSERT_EQ(materials.size(), 3U);
  EXPECT_TRUE(materials.contains("spheres1.material2"));
  for (const auto& [name, count] : materials)
    EXPECT_NEAR(count, 2000.0 / 3.0, 110.0) << name;
}

TEST(SceneGroup, SameSeedGivesTheSameBitsAndAnotherSeedOthers) {
  json document = withBodies(json::array({groupOf(50, {0.01, 0.02}, 0.5)}));
  document["bodies"][0]["speed"] = 1;
  const Scene first = accepted(document);
  const Scene again = accepted(document);
  document["seed"] = 1;
  const Scene other = accepted(document);
  for (std::size_t body = 0; body < first.bodies.size(); ++body) {
    const SphereShape& sphere = sphereOf(first.bodies[body]);
    EXPECT_EQ(sphere.position, sphereOf(again.bodies[body]).position);
    EXPECT_EQ(sphere.velocity, sphereOf(again.bodies[body]).velocity);
    EXPECT_EQ(sphere.radius, sphereOf(again.bodies[body]).radius);
    EXPECT_NE(sphere.position, sphereOf(other.bodies[body]).position);
    EXPECT_NE(sphere.radius, sphereOf(other.bodies[body]).radius);
  }
}

TEST(SceneGroup, TwoGroupsOfOneSceneDiffer) {
  const Scene scene =
      accepted(withBodies({groupOf(1, {0.01, 0.02}, 1.0), groupOf(1, {0.01, 0.02}, 1.0)}));
  EXPECT_NE(sphereOf(scene.bodies.at(0)).radius, sphereOf(scene.bodies.at(1)).radius);
}

TEST(SceneGroup, TenThousandSpheresFindRoomInAFifthOfTheBox) {
  const Scene scene = accepted(withBodies(json::array({groupOf(10000, {0.005, 0.02}, 0.4)})));
  ASSERT_EQ(scene.bodies.size(), 10000U);
  double volume = 0.0;
  for (const SceneBody& body : scene.bodies) {
    volume += 4.0 / 3.0 * std::numbers::pi * std::pow(sphereOf(body).radius, 3);
  }
  EXPECT_GT(volume / 0.512, 0.2);
  EXPECT_EQ(deepestOverlap(scene), 0.0);
}

TEST(SceneGroup, SaysHowManyFitted) {
  const std::string message = messageOf(parsed(withBodies(json::array({groupOf(40, 0.2, 0.5)}))));
  std::size_t fitted = 0;
  ASSERT_EQ(std::sscanf(message.c_str(), "test.json: /bodies/0: only %zu of 40", &fitted), 1)
      << message;
  EXPECT_GE(fitted, 4U);   // eight would fit in a grid
  EXPECT_LE(fitted, 15U);  // at most 0.5 of the volume
}

// --- Refused documents ---------------------------------------------------------------------------

struct Refusal {
  std::string name;
  std::string text;
  std::string place;               // a JSON pointer, or a line and column
  std::vector<std::string> words;  // parts of the expected message
};

/// Prints the document in GoogleTest's reports.
std::ostream& operator<<(std::ostream& stream, const Refusal& refusal) {
  return stream << refusal.text.substr(0, 300);
}

Refusal refusal(std::string name, const json& document, std::string place,
                std::vector<std::string> words) {
  return {std::move(name), document.dump(), std::move(place), std::move(words)};
}

/// Documents that the schema refuses as well.
CAROM_LIST std::vector<Refusal> shapeRefusals() {
  std::vector<Refusal> list;
  const auto add = [&list](const json& document, const std::string& place,
                           const std::vector<std::string>& words) {
    list.push_back(refusal(place + " " + words.front(), document, place, words));
  };
  // Unknown and missing keys.
  add(with("/durration", 2), "/durration",
      {"unknown key", "did you mean \"duration\"", "\"seed\""});
  add(with("/bodies/0/raduis", 1), "/bodies/0/raduis", {"unknown key", "did you mean \"radius\""});
  add(with("/bodies/1/radius", 1), "/bodies/1/radius", {"unknown key", "\"normal\""});
  add(with("/listeners/0/gain", 1), "/listeners/0/gain", {"unknown key", "\"position\""});
  add(with("/air", {{"wind", 20}}), "/air/wind", {"unknown key", "\"density\""});
  add(with("/stepper", {{"dt", 1}}), "/stepper/dt", {"unknown key", "\"step\""});
  add(without("/duration"), "/duration", {"missing", "a number above 0 up to 3600 (seconds)"});
  add(without("/bodies"), "/bodies", {"missing", "array"});
  add(without("/listeners"), "/listeners", {"missing", "listener"});
  for (const char* key : {"type", "radius", "material", "position"}) {
    add(without(std::string("/bodies/0/") + key), std::string("/bodies/0/") + key, {"missing"});
  }
  add(without("/bodies/1/normal"), "/bodies/1/normal", {"missing", "[x, y, z]"});
  add(without("/bodies/1/offset"), "/bodies/1", {"no place", "\"point\" or \"offset\""});
  add(with("/bodies/1/point", {0, 0, 0}), "/bodies/1", {"a point and an offset", "one of the two"});
  add(without("/listeners/0/position"), "/listeners/0/position", {"missing"});
  // Wrong types.
  add(json::array(), "", {"an array of length 0 is not a scene", "an object"});
  add(with("/duration", "1"), "/duration", {"\"1\" is not a duration", "a number"});
  add(with("/duration", nullptr), "/duration", {"null is not a duration"});
  add(with("/name", 3), "/name", {"3 is not a name", "a string of 1 to 100 characters"});
  add(with("/description", json::array()), "/description", {"is not a description"});
  add(with("/gravity", -9.81), "/gravity", {"-9.81 is not a vector", "[x, y, z]"});
  add(with("/gravity", {0, -9.81}), "/gravity", {"an array of length 2", "[x, y, z]"});
  add(with("/gravity", {0, "down", 0}), "/gravity/1", {"\"down\" is not a component of gravity"});
  add(with("/air", 1), "/air", {"1 is not a description of the air"});
  add(with("/stepper", "bullet"), "/stepper", {"\"bullet\" is not a stepper"});
  add(with("/stepper", {{"type", "bulet"}}), "/stepper/type",
      {"\"bulet\" is not a type of stepper", "did you mean \"bullet\""});
  add(with("/materials", json::array()), "/materials", {"is not a set of materials"});
  add(with("/bodies", json::object()), "/bodies", {"is not a list of bodies"});
  add(with("/bodies/0", 1), "/bodies/0", {"1 is not a body"});
  add(with("/bodies/0/type", "ball"), "/bodies/0/type", {"\"ball\" is not a type", "\"spheres\""});
  add(with("/bodies/0/material", 1), "/bodies/0/material", {"1 is not a material"});
  add(with("/listeners", json::object()), "/listeners", {"is not a list of listeners"});
  add(with("/listeners/0", true), "/listeners/0", {"true is not a listener"});
  add(with("/camera", json::array()), "/camera", {"a list of key frames"});
  add(with("/camera", {{{"time", 0}}}), "/camera/0/position", {"missing"});
  add(with("/camera", {{{"time", 0}, {"position", {0, 1, 2}}, {"fov", 30}}}), "/camera/0/fov",
      {"unknown key", "\"field_of_view\""});
  add(with("/camera", {{{"time", 0}, {"position", {0, 1, 2}}, {"field_of_view", 0}}}),
      "/camera/0/field_of_view", {"a number from 1 to 150 (degrees)"});
  add(with("/$schema", 1), "/$schema", {"is not the address"});
  // Numbers out of range.
  const std::vector<std::pair<std::string, std::vector<json>>> ranges = {
      {"/duration", {0, -1, 3600.1, 1e300}},
      {"/sample_rate", {7999, 192001, 44100.5, -48000}},
      {"/seed", {-1, 0.5, 9007199254740994, 18446744073709551615U, 1e30}},
      {"/gravity/0", {1e4 + 1, -2e4}},
      {"/air/density", {0, -1, 1e5}},
      {"/air/speed_of_sound", {0, 0.5, 1e5}},
      {"/air/temperature", {0, 20, -273.15, 351}},
      {"/air/humidity", {-0.1, 2, 50}},
      {"/air/pressure", {0, 101.325, 1e6}},
      {"/stepper/rest_speed", {-0.001, 2e4}},
      {"/bodies/0/radius", {0, -0.05, 9e-7, 10001}},
      {"/bodies/0/mass", {0, -1, 1e19}},
      {"/bodies/0/position/1", {1.1e6, -1.1e6}},
      {"/bodies/0/velocity/2", {10001, -1e5}},
      {"/bodies/1/offset", {1.1e6}},
      {"/bodies/1/normal/0", {1e7}},
      {"/listeners/0/position/0", {-1e7}},
      {"/materials/oak/density", {0, -1, 1e6}},
      {"/materials/oak/youngs_modulus", {0, -1e9, 1e14}},
      {"/materials/oak/poissons_ratio", {-0.1, 0.5, 0.7}},
      {"/materials/oak/restitution", {-0.1, 1.1}}};
  json full = oneBall();
  full["gravity"] = {0, 0, 0};
  full["air"] = {{"density", 1}};
  full["stepper"] = {{"type", "bullet"}};
  full["bodies"][0]["velocity"] = {0, 0, 0};
  full["materials"]["oak"] = oak();
  for (const auto& [pointer, values] : ranges) {
    for (const json& value : values) {
      json document = full;
      document[json::json_pointer(pointer)] = value;
      add(document, pointer, {" is not a", "; expected a "});
    }
  }
  for (const json& step : {json(0), json(-0.01), json(9e-6), json(0.11)}) {
    add(with("/stepper", {{"type", "bullet"}, {"step", step}}), "/stepper/step", {"is not a step"});
  }
  add(with("/stepper", {{"type", "native"}, {"step", 0.01}}), "/stepper/step",
      {"the native stepper has no step", "\"bullet\""});
  add(with("/stepper", {{"step", 0.01}}), "/stepper/step", {"the native stepper has no step"});
  add(with("/stepper", {{"tuned", true}}), "/stepper/tuned",
      {"the native stepper has nothing to tune", "\"bullet\""});
  const auto pair = [](json materials, json restitution) {
    return with("/restitutions",
                {{{"materials", std::move(materials)}, {"restitution", std::move(restitution)}}});
  };
  add(with("/restitutions", json::object()), "/restitutions", {"not a list of restitutions"});
  add(with("/restitutions", {1}), "/restitutions/0", {"1 is not a restitution of two materials"});
  add(with("/restitutions", {{{"materials", {"wood", "glass"}}}}), "/restitutions/0/restitution",
      {"missing", "from 0 to 1"});
  add(with("/restitutions", {{{"restitution", 0.5}}}), "/restitutions/0/materials", {"missing"});
  add(with("/restitutions",
           {{{"materials", {"wood", "glass"}}, {"restitution", 0.5}, {"speed", 1}}}),
      "/restitutions/0/speed", {"unknown key", "\"restitution\""});
  add(pair({"wood", "glass"}, 1.01), "/restitutions/0/restitution", {"1.01 is not a restitution"});
  add(pair({"wood", "glass"}, -0.5), "/restitutions/0/restitution", {"-0.5 is not a restitution"});
  add(pair({"wood", "glass"}, "high"), "/restitutions/0/restitution", {"is not a restitution"});
  add(pair("wood", 0.5), "/restitutions/0/materials", {"is not a pair of materials"});
  add(pair({"wood"}, 0.5), "/restitutions/0/materials", {"is not a pair of materials"});
  add(pair({"wood", "glass", "steel"}, 0.5), "/restitutions/0/materials",
      {"is not a pair of materials"});
  add(pair({"wood", oak()}, 0.5), "/restitutions/0/materials/1", {"not the name of a material"});
  add(pair({"", "wood"}, 0.5), "/restitutions/0/materials/0", {"not the name of a material"});
  add(with("/restitutions",
           json::array_t(1001, {{"materials", {"wood", "glass"}}, {"restitution", 0.5}})),
      "/restitutions", {"is not a list of restitutions", "1000"});
  add(with("/materials", {{"oak", {{"density", 1}}}}), "/materials/oak/youngs_modulus",
      {"missing"});
  add(with("/materials", {{"", oak()}}), "/materials/", {"not a name"});
  add(with("/name", ""), "/name", {"\"\" is not a name"});
  add(with("/name", std::string(101, 'x')), "/name", {"is not a name"});
  // Groups.
  const auto spoilt = [](const std::string& key, json value) {
    json group = groupOf(3, 0.1, 1.0);
    group[key] = std::move(value);
    return withBodies(json::array({group}));
  };
  add(spoilt("count", 0), "/bodies/0/count", {"0 is not a count", "from 1 to 100000"});
  add(spoilt("count", 1.5), "/bodies/0/count", {"1.5 is not a count", "whole"});
  add(spoilt("count", 100001), "/bodies/0/count", {"is not a count"});
  add(spoilt("radius", "big"), "/bodies/0/radius", {"\"big\" is not a radius", "[min, max]"});
  add(spoilt("radius", {1, 2, 3}), "/bodies/0/radius", {"an array of length 3", "[min, max]"});
  add(spoilt("radius", {0, 1}), "/bodies/0/radius/0", {"0 is not a radius"});
  add(spoilt("speed", -1), "/bodies/0/speed", {"-1 is not a speed"});
  add(spoilt("speed", {0, 1e5}), "/bodies/0/speed/1", {"is not a speed"});
  add(spoilt("material", json::array()), "/bodies/0/material", {"is not a choice of materials"});
  add(spoilt("position", {0, 0, 0}), "/bodies/0/position", {"unknown key"});
  add(spoilt("min", {0, 0}), "/bodies/0/min", {"an array of length 2"});
  // Sound.
  add(with("/sound", true), "/sound", {"true is not a description of the sound"});
  add(with("/sound", {{"puls", "hertz"}}), "/sound/puls",
      {"unknown key", "did you mean \"pulse\""});
  add(with("/sound", {{"pulse", "herz"}}), "/sound/pulse",
      {"\"herz\" is not a pulse", "did you mean \"hertz\"", "\"course_gaussian\""});
  add(with("/sound", {{"dissipative", 1}}), "/sound/dissipative",
      {"1 is not a boolean", "true or false"});
  add(with("/sound", {{"doppler", "no"}}), "/sound/doppler", {"\"no\" is not a boolean"});
  add(with("/sound", {{"sampling", "nave"}}), "/sound/sampling", {"not a way of sampling"});
  add(with("/sound", {{"radiation", 3}}), "/sound/radiation", {"\"compact\""});
  add(with("/sound", {{"audible_threshold", -1}}), "/sound/audible_threshold", {"pascals"});
  add(with("/sound", {{"impulse", "none"}}), "/sound/impulse", {"\"physical\", \"applied\""});
  // Rooms.
  add(with("/room", 2), "/room", {"2 is not a room", "an object"});
  add(with("/room", {{"walls", 6}}), "/room/walls", {"unknown key", "\"surfaces\""});
  for (const json& order : {json(-1), json(33), json(1.5), json("two")})
    add(with("/room", {{"order", order}}), "/room/order", {"not an order", "from 0 to 32"});
  add(with("/room", {{"surfaces", "wood"}}), "/room/surfaces", {"is not a set of surfaces"});
  const auto covered = [](json surface) {
    return with("/room", {{"surfaces", {{"plane1", std::move(surface)}}}});
  };
  add(covered(0.5), "/room/surfaces/plane1", {"0.5 is not a surface", "7 absorption"});
  add(covered(""), "/room/surfaces/plane1", {"not the name of a surface"});
  add(covered({0.1, 0.2}), "/room/surfaces/plane1", {"array of length 2", "7"});
  add(covered({0, 0, 0, 1.5, 0, 0, 0}), "/room/surfaces/plane1/3",
      {"1.5 is not an absorption coefficient", "from 0 to 1"});
  add(inBox("wood", {{"reverb", "long"}}), "/room/reverb", {"not a reverberation", "\"t60\""});
  add(inBox("wood", {{"reverb", json::object()}}), "/room/reverb/t60", {"missing", "array of 7"});
  add(inBox("wood", {{"reverb", {{"t60", 0.01}}}}), "/room/reverb/t60",
      {"0.01 is not a reverberation time", "seconds"});
  add(inBox("wood", {{"reverb", {{"t60", {1, 1, 1}}}}}), "/room/reverb/t60", {"length 3", "7"});
  add(inBox("wood", {{"reverb", {{"t60", 1}, {"gain", 1}}}}), "/room/reverb/gain", {"unknown key"});
  add(inBox("wood", {{"reverb", {{"t60", 1}, {"volume", 100}}}}), "/room/reverb",
      {"a volume and no surface", "expected both"});
  add(inBox("wood", {{"reverb", {{"t60", 1}, {"surface", 100}}}}), "/room/reverb",
      {"a surface and no volume"});
  // Listeners.
  add(withListener({{"format", "stereo"}}), "/listeners/0/format",
      {"\"stereo\" is not a format", "\"binaural\""});
  add(withListener({{"format", "spaced_pair"}, {"spacing", 0}}), "/listeners/0/spacing",
      {"0 is not a spacing", "metres"});
  add(withListener({{"format", "coincident_pair"}, {"half_angle", 181}}), "/listeners/0/half_angle",
      {"181 is not a half angle", "degrees"});
  add(withListener({{"pattern", 2}}), "/listeners/0/pattern", {"2 is not a pattern"});
  add(withListener({{"looks_at", {0, 0}}}), "/listeners/0/looks_at", {"[x, y, z]", "metres"});
  add(withListener({{"forward", "left"}}), "/listeners/0/forward", {"[x, y, z]"});
  add(withListener({{"looks_at", {0, 0, 0}}, {"forward", {1, 0, 0}}}), "/listeners/0",
      {"\"looks_at\" and \"forward\"", "one of the two"});
  add(withListener({{"format", "binaural"}, {"sofa", 1}}), "/listeners/0/sofa", {"name of a file"});
  add(withListener({{"path", json::array()}}), "/listeners/0/path", {"not a path", "1 to 1000"});
  add(withListener({{"path", json::array_t(1001, poseAt(1, 0, 1, 1))}}), "/listeners/0/path",
      {"not a path", "1 to 1000"});
  add(withListener({{"path", {1}}}), "/listeners/0/path/0", {"1 is not a pose"});
  add(withListener({{"path", {{{"position", {0, 1, 1}}}}}}), "/listeners/0/path/0/time",
      {"missing"});
  add(withListener({{"path", {{{"time", 1}}}}}), "/listeners/0/path/0/position", {"missing"});
  add(withListener({{"path", json::array({poseAt(0, 0, 1, 1)})}}), "/listeners/0/path/0/time",
      {"0 is not the time of a pose", "above 0"});
  // Mechanics.
  add(withOak({{"friction", -0.1}}), "/bodies/0/material/friction",
      {"-0.1 is not a coefficient of friction", "from 0 to 10"});
  add(with("/bodies/0/friction", 11), "/bodies/0/friction", {"11 is not a coefficient of"});
  add(with("/bodies/1/friction", "much"), "/bodies/1/friction", {"is not a coefficient of"});
  add(withSolid({{"friction", -1}}), "/bodies/2/friction", {"-1 is not a coefficient of"});
  add(with("/bodies/0/material", {{"like", 1}}), "/bodies/0/material/like", {"1 is not a name"});
  add(with("/bodies/0/material", {{"like", "wood"}, {"density", 0}}), "/bodies/0/material/density",
      {"0 is not a density"});
  add(with("/bodies/0/material", {{"like", "wood"}, {"colour", 1}}), "/bodies/0/material/colour",
      {"unknown key", "\"like\""});
  add(withOak({{"rolling_friction", 11}}), "/bodies/0/material/rolling_friction",
      {"11 is not a coefficient of rolling friction"});
  add(withOak({{"pivoting_friction", 2}}), "/bodies/0/material/pivoting_friction", {"metres"});
  add(withOak({{"restitution_law", "elastic"}}), "/bodies/0/material/restitution_law",
      {"\"elastic\" is not a law of restitution", "\"viscoelastic\""});
  add(withOak({{"restitution_law", "plastic"}, {"restitution_speed", 0}}),
      "/bodies/0/material/restitution_speed", {"0 is not a restitution speed", "m/s"});
  add(withOak({{"restitution_speed", 1}}), "/bodies/0/material/restitution_speed",
      {"has no use for it", "\"plastic\""});
  add(withOak({{"restitution_law", "constant"}, {"restitution_speed", 1}}),
      "/bodies/0/material/restitution_speed", {"has no use for it"});
  add(with("/bodies/0/spin", {0, 0}), "/bodies/0/spin", {"array of length 2"});
  // Surfaces.
  const json rough = {{"rms_height", 1e-6}, {"correlation_length", 1e-4}};
  const auto roughBut = [&rough](const char* key, const json& value) {
    json changed = rough;
    changed[key] = value;
    return with("/bodies/0/roughness", changed);
  };
  add(with("/bodies/0/roughness", 1e-6), "/bodies/0/roughness", {"1e-6 is not a roughness"});
  add(with("/bodies/0/roughness", {{"rms_height", 1e-6}}), "/bodies/0/roughness/correlation_length",
      {"missing"});
  add(roughBut("rms_height", -1), "/bodies/0/roughness/rms_height", {"an rms height", "metres"});
  add(roughBut("correlation_length", 0), "/bodies/0/roughness/correlation_length",
      {"a correlation length", "metres"});
  add(roughBut("hurst", 0), "/bodies/0/roughness/hurst", {"a Hurst exponent"});
  add(roughBut("hurts", 1), "/bodies/0/roughness/hurts", {"did you mean \"hurst\""});
  const json map = {{"file", "brick.png"}, {"size", {0.2, 0.1}}};
  const auto mapBut = [&map](const char* key, const json& value) {
    json changed = map;
    changed[key] = value;
    return with("/bodies/1/normal_map", changed);
  };
  add(with("/bodies/1/normal_map", "brick.png"), "/bodies/1/normal_map", {"is not a normal map"});
  add(mapBut("size", 0.2), "/bodies/1/normal_map/size", {"is not a size of a normal map"});
  add(mapBut("size", {0.2, 0}), "/bodies/1/normal_map/size/1", {"a side of a normal map"});
  add(mapBut("green", "left"), "/bodies/1/normal_map/green", {"where green points", "\"down\""});
  add(mapBut("strength", -1), "/bodies/1/normal_map/strength", {"a strength"});
  add(mapBut("file", 1), "/bodies/1/normal_map/file", {"name of a file"});
  // Solids.
  add(withShape("box"), "/bodies/2/shape", {"\"box\" is not a shape", "an object"});
  add(withShape({{"radius", 1}}), "/bodies/2/shape/type", {"missing", "\"cylinder\""});
  add(withShape({{"type", "cube"}}), "/bodies/2/shape/type",
      {"\"cube\" is not a type of shape", "\"mesh\""});
  add(withShape({{"type", "box"}}), "/bodies/2/shape/half_extents", {"missing", "[x, y, z]"});
  add(withShape({{"type", "box"}, {"half_extents", {1, 0, 1}}}), "/bodies/2/shape/half_extents/1",
      {"0 is not a half extent", "from 1e-6 to 10000 (metres)"});
  add(withShape({{"type", "box"}, {"half_extents", {1, 1, 1}}, {"radius", 1}}),
      "/bodies/2/shape/radius", {"unknown key", "\"half_extents\""});
  add(withShape({{"type", "cylinder"}, {"radius", 1}}), "/bodies/2/shape/height", {"missing"});
  add(withShape({{"type", "cylinder"}, {"radius", 0}, {"height", 1}}), "/bodies/2/shape/radius",
      {"0 is not a radius"});
  add(withShape({{"type", "cylinder"}, {"radius", 1}, {"height", 3e4}}), "/bodies/2/shape/height",
      {"30000 is not a height", "metres"});
  add(withShape({{"type", "mesh"}}), "/bodies/2/shape/file", {"missing", "mesh file"});
  add(withShape({{"type", "mesh"}, {"file", 1}}), "/bodies/2/shape/file", {"name of a file"});
  add(withShape({{"type", "mesh"}, {"file", "a.obj"}, {"scale", 0}}), "/bodies/2/shape/scale",
      {"0 is not a scale"});
  const std::string jello = "/bodies/2";
  for (const char* key : {"size", "mass", "stiffness", "position"}) {
    json document = withJello(json::object());
    document["bodies"][2].erase(key);
    add(document, jello + "/" + key, {"missing"});
  }
  add(withJello({{"material", "wood"}}), jello + "/material", {"unknown key", "\"stiffness\""});
  add(withJello({{"points", 1}}), jello + "/points", {"1 is not a number of points", "2 to 128"});
  add(withJello({{"points", 2.5}}), jello + "/points", {"2.5 is not a number of points"});
  add(withJello({{"size", {1, 0, 1}}}), jello + "/size/1", {"0 is not a size", "metres"});
  add(withJello({{"mass", -1}}), jello + "/mass", {"-1 is not a mass", "kilograms"});
  add(withJello({{"stiffness", 1e13}}), jello + "/stiffness", {"is not a stiffness", "N/m"});
  add(withJello({{"damping", -1}}), jello + "/damping", {"-1 is not a damping", "N s/m"});
  add(withJello({{"contact", {{"stifness", 1}}}}), jello + "/contact/stifness",
      {"unknown key", "did you mean \"stiffness\""});
  add(withJello({{"contact", {{"damping", "no"}}}}), jello + "/contact/damping",
      {"\"no\" is not a damping"});
  add(withJello({{"integrator", "rk5"}}), jello + "/integrator",
      {"\"rk5\" is not an integrator", "\"backward_euler\""});
  add(withJello({{"integrator", "rk4"}, {"step", 0}}), jello + "/step", {"0 is not a step"});
  add(withJello({{"step", 1e-3}}), jello + "/step", {"goes with an integrator"});
  add(withJello({{"integrator", "auto"}, {"step", 1e-3}}), jello + "/step",
      {"goes with an integrator"});
  add(withJello({{"error", 2}}), jello + "/error", {"2 is not an error", "metres"});
  add(withJello({{"integrator", "rk4"}, {"step", 1e-3}, {"error", 1e-3}}), jello + "/error",
      {"the jello has a step"});
  add(withJello({{"spin", {2e6, 0, 0}}}), jello + "/spin/0", {"component of spin"});
  add(withJello({{"positions", json::array({json::array({0, 0, 0})})}}), jello + "/position",
      {"\"positions\" of its points", "one of the two"});
  add(withJello({{"velocity", {1, 0, 0}}, {"velocities", json::array({json::array({0, 0, 0})})}}),
      jello + "/velocity", {"\"velocities\" of its points", "one of the two"});
  add(withJello({{"velocities", 1}}), jello + "/velocities", {"is not a list of vectors"});
  add(withJello({{"field", json::object()}}), jello + "/field/forces", {"missing", "newtons"});
  add(withJello({{"field", {{"forces", {{1, 2}}}}}}), jello + "/field/forces/0",
      {"is not a vector"});
  add(withSolid({{"movable", 1}}), "/bodies/2/movable", {"1 is not a boolean"});
  add(withSolid({{"mass", 0}}), "/bodies/2/mass", {"0 is not a mass", "kilograms"});
  add(withSolid({{"spin", {2e6, 0, 0}}}), "/bodies/2/spin/0", {"component of spin"});
  add(withSolid({{"velocity", 1}}), "/bodies/2/velocity", {"is not a vector"});
  add(withSolid({{"rotation", {{"axis", {0, 1, 0}}}}}), "/bodies/2/rotation/angle", {"missing"});
  add(withSolid({{"radius", 1}}), "/bodies/2/radius", {"unknown key", "\"shape\""});
  for (const char* key : {"mass", "velocity", "spin"}) {
    json still = withSolid({{"movable", false}});
    still["bodies"][2][key] = std::string(key) == "mass" ? json(1) : json({0, 0, 0});
    add(still, std::string("/bodies/2/") + key, {"cannot move has no use", "\"movable\": true"});
  }
  for (const char* key : {"shape", "material", "position"}) {
    json lacking = withSolid(json::object());
    lacking["bodies"][2].erase(key);
    add(lacking, std::string("/bodies/2/") + key, {"missing"});
  }
  json pieced = withMesh("sheet.obj", {{"pieces", "a.obj"}});
  pieced["bodies"][2]["movable"] = false;
  add(pieced, "/bodies/2/shape/pieces", {"collides as it is", "\"movable\": true"});
  add(with("/bodies/0/spin", {0, 0, 2e6}), "/bodies/0/spin/2", {"component of spin", "rad/s"});
  add(with("/bodies/1/velocity", {0, 1e5, 0}), "/bodies/1/velocity/1", {"component of velocity"});
  add(with("/bodies/1/oscillation", 5), "/bodies/1/oscillation",
      {"5 is not an oscillation", "an object"});
  const auto oscillating = [](const json& keys) {
    json oscillation = {{"amplitude", {0, 0.1, 0}}, {"frequency", 5}};
    oscillation.update(keys);
    return with("/bodies/1/oscillation", oscillation);
  };
  add(oscillating({{"amplitude", 0.1}}), "/bodies/1/oscillation/amplitude",
      {"0.1 is not a vector"});
  add(oscillating({{"amplitude", {0, 2000, 0}}}), "/bodies/1/oscillation/amplitude/1", {"metres"});
  add(oscillating({{"frequency", 0}}), "/bodies/1/oscillation/frequency",
      {"a frequency of oscillation", "Hz"});
  add(oscillating({{"phase", "up"}}), "/bodies/1/oscillation/phase",
      {"\"up\" is not a phase", "radians"});
  add(oscillating({{"damping", 1}}), "/bodies/1/oscillation/damping", {"unknown key"});
  add(with("/bodies/1/oscillation", {{"amplitude", {0, 1, 0}}}), "/bodies/1/oscillation/frequency",
      {"missing"});
  add(withBlock({{"radius", 1}}), "/bodies/2/radius", {"unknown key", "\"rotation\""});
  add(withBlock({{"max", 6}}), "/bodies/2/max", {"6 is not a vector"});
  add(withBlock({{"rotation", 45}}), "/bodies/2/rotation", {"45 is not a rotation"});
  add(withBlock({{"rotation", {{"angle", 45}}}}), "/bodies/2/rotation/axis", {"missing"});
  add(withBlock({{"rotation", {{"axis", {0, 1, 0}}}}}), "/bodies/2/rotation/angle", {"missing"});
  add(withBlock({{"rotation", {{"axis", {0, 1, 0}}, {"angle", 361}}}}), "/bodies/2/rotation/angle",
      {"361 is not an angle of rotation", "degrees"});
  add(withBlock({{"velocity", {0, 0, "fast"}}}), "/bodies/2/velocity/2", {"\"fast\" is not"});
  add(with("/mechanics", json::array()), "/mechanics", {"not a description of the mechanics"});
  add(with("/mechanics", {{"rod", 1}}), "/mechanics/rod", {"unknown key", "\"rods\""});
  add(with("/mechanics", {{"simultaneous", "herz"}}), "/mechanics/simultaneous",
      {"did you mean \"hertz\"", "\"reflections\""});
  add(with("/mechanics", {{"rods", 1}}), "/mechanics/rods", {"1 is not a list of rods"});
  add(with("/mechanics", {{"rods", {1}}}), "/mechanics/rods/0", {"1 is not a rod"});
  add(withRod({{"length", 1}}), "/mechanics/rods/0/length", {"unknown key"});
  add(withRod({{"bodies", "sphere1"}}), "/mechanics/rods/0/bodies", {"not a list of ends"});
  add(withRod({{"bodies", json::array()}}), "/mechanics/rods/0/bodies", {"array of length 1 to 2"});
  add(withRod({{"bodies", {"sphere1", "sphere1"}}}), "/mechanics/rods/0",
      {"joins two bodies and has an anchor", "one of these"});
  add(with("/mechanics", {{"rods", {{{"bodies", {"sphere1"}}}}}}), "/mechanics/rods/0",
      {"one body and no anchor"});
  add(with("/mechanics", {{"rods", {{{"anchor", {0, 0, 0}}}}}}), "/mechanics/rods/0/bodies",
      {"missing"});
  add(withRod({{"anchor", {1, 2}}}), "/mechanics/rods/0/anchor", {"array of length 2"});
  add(withSpring({{"length", -1}}), "/mechanics/springs/0/length", {"-1 is not a length"});
  add(withSpring({{"stiffness", 1e13}}), "/mechanics/springs/0/stiffness", {"N/m"});
  add(withSpring({{"damping", -1}}), "/mechanics/springs/0/damping", {"N s/m"});
  add(withSpring({{"bodies", {1}}}), "/mechanics/springs/0/bodies/0", {"1 is not the name of a"});
  add(with("/mechanics", {{"springs", {{{"bodies", {"sphere1"}}, {"anchor", {1, 0, 0}}}}}}),
      "/mechanics/springs/0/length", {"missing"});
  add(with("/mechanics", {{"fields", {{{"strength", 1}}}}}), "/mechanics/fields/0/strength",
      {"unknown key", "\"harmonic\""});
  add(with("/mechanics", {{"fields", {{{"harmonic", 1e9}}}}}), "/mechanics/fields/0/harmonic",
      {"1/s^2"});
  add(with("/mechanics", {{"fields", {{{"inverse_square", 1e16}}}}}),
      "/mechanics/fields/0/inverse_square", {"m^3/s^2"});
  add(with("/mechanics", {{"fields", {{{"centre", 0}}}}}), "/mechanics/fields/0/centre",
      {"0 is not a vector"});
  add(with("/mechanics", {{"drag", 1}}), "/mechanics/drag", {"1 is not a drag"});
  add(with("/mechanics", {{"drag", json::object()}}), "/mechanics/drag/rate", {"missing"});
  add(with("/mechanics", {{"drag", {{"rate", -1}}}}), "/mechanics/drag/rate", {"a rate of drag"});
  add(with("/mechanics", {{"drag", {{"rate", 1}, {"wind", 3}}}}), "/mechanics/drag/wind",
      {"3 is not a vector"});
  for (const double step : {0.0, 0.2})
    add(with("/mechanics", {{"force_step", step}}), "/mechanics/force_step", {"a step of forces"});
  const std::string modes = "/bodies/0/modes";
  for (const json& wrong : {json(1), json(true), json::array()})
    add(withModes(wrong), modes, {"modes", "a model file, or an object"});
  add(withModes(""), modes, {"the name of a file"});
  add(withModes(std::string(1001, 'x')), modes, {"the name of a file"});
  add(withModes({{"file", ""}}), modes + "/file", {"the name of a file"});
  add(withModes({{"file", "bells.glb"}, {"node", ""}}), modes + "/node", {"the name of a node"});
  add(withModes({{"file", "bells.glb"}, {"dofs", 3000}}), modes + "/dofs",
      {"unknown key", "\"node\""});
  add(withModes({{"node", "tenor"}}), modes + "/node", {"unknown key", "\"dofs\""});
  add(withModes({{"material", "steel"}}), modes + "/material", {"unknown key", "\"dofs\""});
  add(withModes({{"body", "beam"}}), modes + "/body", {"\"solid\", \"shell\""});
  add(withModes({{"body", "shell"}}), modes + "/thickness", {"missing", "metres"});
  for (const double thickness : {0.0, -1e-3, 1001.0})
    add(withModes({{"body", "shell"}, {"thickness", thickness}}), modes + "/thickness",
        {"a thickness"});
  add(withModes({{"body", "shell"}, {"thickness", 0.01}, {"springs", "coil"}}), modes + "/springs",
      {"\"transverse\", \"axial\""});
  add(withModes({{"body", "shell"}, {"thickness", 0.01}, {"dofs", 3000}}), modes + "/dofs",
      {"no use for it", "\"solid\""});
  for (const json& keys : {json::object(), json{{"body", "solid"}}}) {
    json thick = keys;
    thick["thickness"] = 0.01;
    add(withModes(thick), modes + "/thickness", {"no use for it", "\"shell\""});
    json sprung = keys;
    sprung["springs"] = "axial";
    add(withModes(sprung), modes + "/springs", {"no use for it", "\"shell\""});
  }
  for (const json& degrees : {json(191), json(1000001), json(1000.5), json("many")})
    add(withModes({{"dofs", degrees}}), modes + "/dofs", {"a number of degrees of freedom"});
  for (const json& count : {json(0), json(2001), json(1.5)})
    add(withModes({{"count", count}}), modes + "/count", {"a number of modes"});
  for (const json& panels : {json(99), json(5001), json(100.5)})
    add(withModes({{"panels", panels}}), modes + "/panels", {"a number of panels"});
  add(withSolid({{"modes", 3}}), "/bodies/2/modes", {"3 is not modes"});
  add(with("/bodies/1/modes", json::object()), "/bodies/1/modes", {"unknown key"});
  add(withBlock({{"modes", json::object()}}), "/bodies/2/modes", {"unknown key"});
  json group = groupOf(2, 0.1, 1.0);
  group["modes"] = json::object();
  add(withBodies(json::array({group})), "/bodies/0/modes", {"unknown key"});
  for (const double damping : {-1.0, 1.1e6})
    add(withOak({{"damping_alpha", damping}}), "/bodies/0/material/damping_alpha",
        {"in proportion to mass", "1/s"});
  for (const double damping : {-1.0, 1.1})
    add(withOak({{"damping_beta", damping}}), "/bodies/0/material/damping_beta",
        {"in proportion to stiffness"});
  for (const double factor : {-0.1, 2.1})
    add(withOak({{"loss_factor", factor}}), "/bodies/0/material/loss_factor", {"a loss factor"});
  for (const double exponent : {-2.1, 2.1})
    add(withOak({{"loss_exponent", exponent}}), "/bodies/0/material/loss_exponent",
        {"an exponent"});
  for (const double expansion : {-1e-6, 0.011})
    add(withOak({{"thermal_expansion", expansion}}), "/bodies/0/material/thermal_expansion",
        {"a thermal expansion (1/K)"});
  for (const double conductivity : {-1.0, 1.1e5})
    add(withOak({{"thermal_conductivity", conductivity}}),
        "/bodies/0/material/thermal_conductivity", {"a thermal conductivity (W/(m K))"});
  for (const double capacity : {-1.0, 1.1e5})
    add(withOak({{"heat_capacity", capacity}}), "/bodies/0/material/heat_capacity",
        {"a heat capacity (J/(kg K))"});
  add(withModes({{"accuracy", 0.6}}), modes + "/accuracy", {"an accuracy"});
  add(withModes({{"accuracy", 0.01}, {"dofs", 3000}}), modes + "/dofs", {"one of the two"});
  add(with("/sound", {{"ringing", "loud"}}), "/sound/ringing", {"\"pressed\", \"coupled\""});
  add(with("/sound", {{"recoil", "round"}}), "/sound/recoil", {"\"sphere\", \"shape\""});
  add(with("/sound", {{"modal_radiation", "loud"}}), "/sound/modal_radiation",
      {"\"directional\", \"monopole\", \"constant\""});
  add(with("/bodies", json::array()), "/bodies", {"empty scene"});
  add(with("/listeners", json::array()), "/listeners", {"is not a list of listeners", "1 to 256"});
  return list;
}

/// Documents that only the loader refuses.
CAROM_LIST std::vector<Refusal> meaningRefusals() {
  std::vector<Refusal> list;
  const auto add = [&list](const json& document, const std::string& place,
                           const std::vector<std::string>& words) {
    list.push_back(refusal(place + " " + words.front(), document, place, words));
  };
  add(withBodies(json::array({planeOf({0, 1, 0})})), "/bodies",
      {"empty scene", "at least one sphere"});
  add(with("/bodies/1/normal", {0, 0, 0}), "/bodies/1/normal", {"no direction", "not 0"});
  add(with("/bodies/0/material", "steal"), "/bodies/0/material",
      {"unknown material \"steal\"", "did you mean \"steel\"", "\"ceramic\"", "\"concrete\""});
  json own = with("/materials", {{"oak", oak()}});
  own["bodies"][0]["material"] = "elm";
  add(own, "/bodies/0/material", {"unknown material \"elm\"", "\"oak\""});
  add(with("/materials", {{"steel", oak()}}), "/materials/steel", {"built-in", "another name"});
  const auto pair = [](const std::string& first, const std::string& second) {
    return json{{"materials", {first, second}}, {"restitution", 0.5}};
  };
  add(with("/restitutions", json::array({pair("steel", "oka")})), "/restitutions/0/materials/1",
      {"unknown material \"oka\"", "expected one of", "\"ceramic\""});
  for (const auto& again : {pair("steel", "wood"), pair("wood", "steel")}) {
    add(with("/restitutions", {pair("steel", "wood"), pair("wood", "wood"), again}),
        "/restitutions/2/materials", {"have a restitution already", "each pair once"});
  }
  add(with("/materials", {{"a\nb", oak()}}), "/materials/a?b", {"not a name"});
  const auto like = [](const std::string& name) { return json{{"like", name}}; };
  add(with("/materials", {{"oak", like("wod")}}), "/materials/oak/like",
      {"unknown material \"wod\"", "did you mean \"wood\"", "expected one of"});
  add(with("/bodies/0/material", like("steal")), "/bodies/0/material/like",
      {"unknown material \"steal\"", "did you mean \"steel\""});
  add(with("/materials", {{"oak", like("oak")}}), "/materials/oak/like",
      {"\"oak\" is like \"oak\"; expected"});
  add(with("/materials", {{"a", like("b")}, {"b", like("c")}, {"c", like("a")}}),
      "/materials/c/like",
      {"\"a\" is like \"b\", which is like \"c\", which is like \"a\"; expected materials"});
  json circle = json::object();
  for (int index = 0; index < 900; ++index)
    circle[std::string(90, 'x') + std::to_string(index)] =
        like(std::string(90, 'x') + std::to_string((index + 1) % 900));
  add(with("/materials", circle), "/materials/x", {"over others is like"});
  add(with("/bodies/0/material", {{"like", "wood"}, {"restitution_speed", 1}}),
      "/bodies/0/material/restitution_speed", {"has no use for it"});
  add(with("/name", "a\tb"), "/name", {"\"a?b\" is not a name", "on one line"});
  add(with("/name", std::string("a\0b", 3)), "/name", {"is not a name"});
  json twins = withBodies({sphereAt(0.1, 0, 0, 0), sphereAt(0.1, 1, 0, 0)});
  twins["bodies"][0]["name"] = twins["bodies"][1]["name"] = "twin";
  add(twins, "/bodies/1/name", {"the name \"twin\" is taken"});
  json part = withBodies({sphereAt(0.1, 0, 0, 0), groupOf(2, 0.1, 1.0)});
  part["bodies"][0]["name"] = "a.2";
  part["bodies"][1]["name"] = "a";
  add(part, "/bodies/1", {"the name \"a.2\" is taken"});
  const json listener = {{"name", "ear"}, {"position", {0, 0, 0}}};
  add(with("/listeners", {listener, listener}), "/listeners/1/name", {"\"ear\" is taken"});
  for (const double top : {0.0, -1.0}) {
    json box = {{"type", "box"}, {"material", "wood"}, {"min", {0, 0, 0}}, {"max", {1, top, 1}}};
    add(withBodies({sphereAt(0.1, 0.5, 0.5, 0.5), box}), "/bodies/1/max",
        {"is not above the minimum 0 along y", "max > min"});
  }
  add(withBodies({sphereAt(0.1, 0, 0, 0), sphereAt(0.1, 0.15, 0, 0)}), "/bodies/1",
      {"\"sphere2\" overlaps \"sphere1\" by 0.05", "metres"});
  add(withBodies({sphereAt(0.1, 0, 0, 0), sphereAt(0.1, 0.2 - 3e-10, 0, 0)}), "/bodies/1",
      {"overlaps"});
  add(withBodies({sphereAt(1e-6, 0, 0, 0), sphereAt(1e4, 9999, 0, 0)}), "/bodies/1", {"overlaps"});
  add(with("/bodies/0/position", {0, 0.005, 0}), "/bodies/0",
      {"\"sphere1\" reaches 0.005 metres into \"plane1\"", "the normal points to"});
  add(withBodies(json::array({groupOf(3, {0.2, 0.1}, 1.0)})), "/bodies/0/radius",
      {"minimum", "above"});
  add(withBodies({groupOf(60000, 0.1, 1e3), groupOf(60000, 0.1, 1e3)}), "/bodies/1/count",
      {"more than 100000 spheres"});
  add(withBodies(json::array({groupOf(1, 2.0, 1.0)})), "/bodies/0",
      {"only 0 of 1 spheres", "more room"});
  // Mechanics.
  add(withBlock({{"min", {4, 6, 4}}}), "/bodies/2/max", {"6 is not above the minimum 6 along y"});
  add(withBlock({{"rotation", {{"axis", {0, 0, 0}}, {"angle", 1}}}}), "/bodies/2/rotation/axis",
      {"no direction", "not 0"});
  add(withBlock({{"min", {-1, 0.5, -1}}, {"max", {1, 1.5, 1}}}), "/bodies/0",
      {"\"sphere1\" has its centre inside \"block1\"", "expected it outside"});
  add(withBlock({{"min", {-1, 0.5, -1}}, {"max", {1, 0.995, 1}}}), "/bodies/0",
      {"\"sphere1\" reaches 0.005", "metres into \"block1\"", "expected it outside"});
  // At a phase of a quarter turn, the floor is where the ball is.
  json raised =
      with("/bodies/1/oscillation",
           {{"amplitude", {0, 0.995, 0}}, {"frequency", 1}, {"phase", 1.5707963267948966}});
  add(raised, "/bodies/0", {"\"sphere1\" reaches 0.005", "into \"plane1\""});
  json blocks = oneBall();
  for (int block = 0; block < 1001; ++block)
    blocks["bodies"].push_back(withBlock(json::object())["bodies"][2]);
  add(blocks, "/bodies/1002", {"more than 1000 blocks"});
  json solids = oneBall();
  for (int solid = 0; solid < 1001; ++solid)
    solids["bodies"].push_back(withSolid(json::object())["bodies"][2]);
  add(solids, "/bodies/1002", {"more than 1000 solids"});
  json still = withSolid({{"movable", false}});
  still["bodies"].erase(0);
  add(still, "/bodies", {"nothing in it can move", "solid"});
  json two = withJello(json::object());
  two["bodies"].push_back(two["bodies"][2]);
  add(two, "/bodies/3", {"the scene has a jello already"});
  const auto eight = [](const json& vector) { return json(std::vector<json>(8, vector)); };
  json few = withJello({{"velocities", json(std::vector<json>(7, {0, 0, 0}))}});
  add(few, "/bodies/2/velocities", {"7 vectors", "2 x 2 x 2"});
  add(withJello({{"field", {{"forces", json(std::vector<json>(9, {0, 0, 0}))}}}}),
      "/bodies/2/field/forces", {"9 forces", "a cube"});
  add(withJello({{"field", {{"forces", eight({0, 0, 0})}}}}), "/bodies/2/field/min", {"missing"});
  add(withJello(
          {{"field", {{"forces", eight({0, 0, 0})}, {"min", {0, 0, 0}}, {"max", {1, 0, 1}}}}}),
      "/bodies/2/field/max", {"is not above \"min\""});
  add(withJello({{"position", {5, 0.25, 5}}}), "/bodies/2",
      {"\"jello1\" reaches 0.25", "metres into \"plane1\"", "side the normal points to"});
  add(withJello({{"position", {0, 1, 0}}}), "/bodies/0",
      {"\"sphere1\" reaches into the jello", "expected it outside"});
  const std::string file = "/bodies/2/shape/file";
  add(withMesh("absent.obj"), file, {"there is no file", "absent.obj", "relative to the scene"});
  add(withMesh(""), file, {"there is no file"});
  add(withMesh("../meshes"), file, {"there is no file"});
  add(withMesh("open_box.obj"), file, {"open_box.obj: the mesh is open", "\"movable\": false"});
  add(withMesh("sheet.obj"), file, {"is open"});
  add(withMesh("inside_out.obj"), file, {"is inside out", "counterclockwise"});
  add(withMesh("brick.obj", {{"scale", 1000}}), file, {"is 100000 m across", "\"scale\""});
  add(withMesh("brick.obj", {{"scale", 1e-6}, {"pieces", "absent.obj"}}), file,
      {"there is no file", "absent.obj"});
  add(withMesh("../solids_test.cpp"), file, {"its name ends in", ".obj"});
  json flat = withMesh("brick.obj");
  flat["bodies"][2]["shape"]["pieces"] = withMesh("sheet.obj")["bodies"][2]["shape"]["file"];
  add(flat, file, {"sheet.obj: part 1 of 1 is flat", "convex pieces"});
  add(withRod({{"bodies", {"sphere2"}}}), "/mechanics/rods/0/bodies/0",
      {"there is no body \"sphere2\"", "name of a sphere"});
  add(withRod({{"bodies", {"plane1"}}}), "/mechanics/rods/0/bodies/0",
      {"\"plane1\" cannot move", "name of a sphere"});
  add(withRod({{"anchor", {0, 1, 0}}}), "/mechanics/rods/0/anchor",
      {"the rod has length 0", "\"sphere1\""});
  const json both = {{"bodies", {"sphere1", "sphere1"}}};
  add(with("/mechanics", {{"rods", json::array({both})}}), "/mechanics/rods/0/bodies/1",
      {"the rod begins and ends at one body"});
  json furnished = withBlock(json::object());
  furnished["room"] = {{"surfaces", {{"block1", "plaster"}}}};
  add(furnished, "/room/surfaces/block1", {"no plane or box \"block1\""});
  // Sound.
  add(with("/sound", {{"pulse", "gaussian"}, {"dissipative", true}}), "/sound/pulse",
      {"a pulse of its own", "\"hertz\""});
  json air = oneBall();
  air["bodies"].erase(1);
  air["room"] = json::object();
  add(air, "/room", {"no plane that could reflect", "a plane or a box"});
  air["room"] = {{"surfaces", {{"room", "plaster"}}}};
  add(air, "/room/surfaces/room", {"no plane or box \"room\"", "expected no surfaces"});
  json granite = with("/room", json::object());
  granite["bodies"][1]["material"] = "granite";
  add(granite, "/room",
      {"what \"plane1\", of \"granite\", absorbs is not known", "\"plane1\" in \"surfaces\"",
       "\"marble\"", "7 absorption"});
  json inlined = with("/room", {{"surfaces", json::object()}});
  inlined["bodies"][1]["material"] = oak();
  inlined["bodies"][1]["name"] = "wood";  // its material gets this name, but is not ours
  add(inlined, "/room/surfaces", {"of \"wood\", absorbs is not known"});
  add(with("/room", {{"surfaces", {{"plane2", "wood_floor"}}}}), "/room/surfaces/plane2",
      {"no plane or box \"plane2\"", "did you mean \"plane1\""});
  add(with("/room", {{"surfaces", {{"sphere1", "wood_floor"}}}}), "/room/surfaces/sphere1",
      {"no plane or box \"sphere1\""});
  add(with("/room", {{"surfaces", {{"plane1", "wood_flor"}}}}), "/room/surfaces/plane1",
      {"unknown surface \"wood_flor\"", "did you mean \"wood_floor\"", "\"curtain\""});
  add(with("/room", {{"order", 2}}), "/room/order",
      {"order 2 needs a box", "expected order 0 or 1"});
  json twice = with("/room", json::object());
  twice["bodies"].push_back(twice["bodies"][1]);
  add(twice, "/room", {"the same plane as reflector 0", "expected planes that differ"});
  add(with("/room", {{"reverb", true}}), "/room/reverb", {"needs a box", "\"volume\""});
  add(with("/room", {{"reverb", {{"t60", 1}}}}), "/room/reverb",
      {"needs a box", "expected \"volume\" and \"surface\""});
  add(with("/room", {{"reverb", {{"t60", 1}, {"volume", 1000}, {"surface", 10}}}}), "/room/reverb",
      {"surface", "the sphere of that volume"});
  add(inBox("wood", {{"reverb", true}, {"surfaces", {{"hall", "rigid"}}}}), "/room/reverb",
      {"rings for ever", "\"t60\""});
  // Listeners.
  add(withListener({{"spacing", 0.3}}), "/listeners/0/spacing",
      {"no use for it", "\"spaced_pair\""});
  add(withListener({{"half_angle", 30}}), "/listeners/0/half_angle", {"\"coincident_pair\""});
  add(withListener({{"format", "binaural"}, {"pattern", 0.5}}), "/listeners/0/pattern",
      {"no use for it"});
  add(withListener({{"sofa", "head.sofa"}}), "/listeners/0/sofa", {"\"binaural\""});
  add(withListener({{"format", "binaural"}, {"sofa", "no/such.sofa"}}), "/listeners/0/sofa",
      {"there is no file \"no/such.sofa\"", "relative to the scene"});
  add(with("/bodies/0/roughness", {{"rms_height", 1e-3}, {"correlation_length", 1e-4}}),
      "/bodies/0/roughness", {"the rms height is above the correlation length"});
  add(with("/bodies/1/normal_map", {{"file", "no/such.png"}, {"size", {0.2, 0.1}}}),
      "/bodies/1/normal_map/file", {"there is no file \"no/such.png\"", "relative to the scene"});
  // The file of this test exists, and the plane has no mesh with coordinates.
  add(with("/bodies/1/normal_map", {{"file", __FILE__}}), "/bodies/1/normal_map",
      {"no \"size\"", "no mesh with texture coordinates", "width and height"});
  add(withListener({{"format", "coincident_pair"}, {"pattern", 0}}), "/listeners/0",
      {"would be the same", "\"pattern\" above 0"});
  add(withListener({{"format", "coincident_pair"}, {"half_angle", 0}}), "/listeners/0",
      {"would be the same", "\"half_angle\" above 0"});
  add(withListener({{"forward", {0, 0, 0}}}), "/listeners/0/forward", {"no direction", "not 0"});
  add(withListener({{"up", {0, 0, 0}}}), "/listeners/0/up", {"no direction"});
  add(withListener({{"looks_at", {0, 1, 1}}}), "/listeners/0", {"where it stands"});
  add(withListener({{"looks_at", {0, -5, 1}}}), "/listeners/0",
      {"along its up direction", "[0, 1, 0] if absent"});
  add(withListener({{"path", {poseAt(1, 0, 1, 1), poseAt(1, 0, 1, 2)}}}),
      "/listeners/0/path/1/time", {"1 s is not after the pose before, at 1 s", "ascend"});
  add(withListener({{"path", json::array({poseAt(0.5, 0, 1, 101)})}}), "/listeners/0/path/0",
      {"200 m/s", "at most 180 m/s"});
  json planes = json::array();
  for (int plane = 0; plane < 1001; ++plane)
    planes.push_back(planeOf({0, 1, 0}));
  add(withBodies(planes), "/bodies/1000", {"more than 1000 planes"});
  return list;
}

/// Texts that are refused before the loader has a document.
CAROM_LIST std::vector<Refusal> syntaxRefusals() {
  std::string deep = R"({"bodies": )" + std::string(100, '[') + std::string(100, ']') + "}";
  return {
      {"empty", "", "the document is empty", {"expected a JSON object"}},
      {"blank", " \n\t ", "the document is empty", {"expected a JSON object"}},
      {"comma", "{\n  \"duration\": 1,\n}", "line 3, column 1", {"not JSON", "'}'"}},
      {"cut", "{\n  \"duration\": 1", "line 2, column ", {"not JSON", "end of input"}},
      {"two", "{} {}", "line 1, column 4", {"not JSON"}},
      {"comment", "{} // done", "line 1, column 4", {"not JSON"}},
      {"nan", "{\"duration\": NaN}", "line 1, column 14", {"not JSON"}},
      {"utf8", "{\"name\": \"\xff\"}", "line 1, column 11", {"not JSON", "UTF-8"}},
      {"overlong", "{\"name\": \"\xc0\x80\"}", "line 1, column 11", {"not JSON", "UTF-8"}},
      {"surrogate", R"({"name": "\ud800"})", "line 1, column ", {"not JSON"}},
      {"a sound file", "RIFF\x10\x01\x02WAVE", "line 1, column 1", {"not JSON but a sound file"}},
      {"a run", "caromrun\x03", "line 1, column ", {"not JSON but a recorded run"}},
      {"a model", "caromode\x04", "line 1, column ", {"not JSON but a modal model"}},
      {"overflow", R"({"duration": 1e999})", "/duration", {"1e999 is too large"}},
      {"overflow in an array", R"({"a": [0, [1, -1e999]]})", "/a/1/1", {"-1e999 is too large"}},
      {"twice", R"({"duration": 1, "duration": 1})", "/duration", {"appears twice"}},
      {"twice inside", R"({"bodies": [{}, {"a/b": 1, "a/b": 2}]})", "/bodies/1/a~1b", {"twice"}},
      {"deep", deep, "/bodies/0/0/0", {"nested too deep", "at most 32"}}};
}

class SceneRefusal : public testing::TestWithParam<Refusal> {};

TEST_P(SceneRefusal, NamesThePlaceAndTheRemedy) {
  const Refusal& refusal = GetParam();
  const std::string message = messageOf(parseScene(refusal.text, "test.json"));
  EXPECT_TRUE(message.starts_with("test.json: " + refusal.place)) << message;
  for (const std::string& word : refusal.words) {
    EXPECT_NE(message.find(word), std::string::npos) << message << "\nlacks " << word;
  }
  EXPECT_LT(message.size(), 2000U);
}

std::string indexName(const testing::TestParamInfo<Refusal>& info) {
  std::string name = std::to_string(info.index) + '_';
  for (const char c : info.param.name.substr(0, 40)) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) name += c;
  }
  return name;
}

INSTANTIATE_TEST_SUITE_P(Shape, SceneRefusal, testing::ValuesIn(shapeRefusals()), indexName);
INSTANTIATE_TEST_SUITE_P(Meaning, SceneRefusal, testing::ValuesIn(meaningRefusals()), indexName);
INSTANTIATE_TEST_SUITE_P(Syntax, SceneRefusal, testing::ValuesIn(syntaxRefusals()), indexName);

TEST(SceneLoader, MessageIsOneSentenceWithFilePlaceFaultAndRemedy) {
  EXPECT_EQ(messageOf(parsed(with("/bodies/0/radius", -0.05))),
            "test.json: /bodies/0/radius: -0.05 is not a radius; "
            "expected a number from 1e-6 to 10000 (metres)");
}

TEST(SceneLoader, TooManyValuesAreRefusedBeforeTheyFillTheMemory) {
  std::string text = "[0";
  for (int value = 0; value < 2'000'000; ++value)
    text += ",0";
  const std::string message = messageOf(parseScene(text + "]", "test.json"));
  EXPECT_NE(message.find("more than 2000000 values"), std::string::npos) << message;
}

TEST(SceneLoader, TooLargeTextIsRefused) {
  const std::string text(SceneLimits::kFileSize + 1, ' ');
  EXPECT_NE(messageOf(parseScene(text, "test.json")).find("larger than"), std::string::npos);
}

TEST(SceneLoader, FilesThatCannotBeReadAreRefusedByName) {
  const std::filesystem::path folder = testing::TempDir();
  EXPECT_EQ(messageOf(loadScene(folder)), folder.string() + ": a directory; expected a scene file");
  const std::filesystem::path absent = folder / "no_such_scene.json";
  EXPECT_EQ(messageOf(loadScene(absent)),
            absent.string() + ": no such file; expected a scene file");
  EXPECT_FALSE(loadScene("/dev/zero"));
  EXPECT_FALSE(loadScene(std::string(5000, 'x')));
  const std::filesystem::path empty = folder / "carom_empty_scene.json";
  std::ofstream(empty).close();
  EXPECT_NE(messageOf(loadScene(empty)).find("the document is empty"), std::string::npos);
  std::filesystem::remove(empty);
}

// --- Schema --------------------------------------------------------------------------------------

/// The schema in the repository, checked by a library that shares no code with the loader.
class SceneSchema : public testing::Test {
 protected:
  SceneSchema() {
    const json document = json::parse(readFile(kScenes / "scene.schema.json"));
    valijson::SchemaParser parser;
    parser.populateSchema(valijson::adapters::NlohmannJsonAdapter(document), schema_);
  }

  bool accepts(const json& document) const {
    valijson::Validator validator(valijson::Validator::kStrongTypes);
    return validator.validate(schema_, valijson::adapters::NlohmannJsonAdapter(document), nullptr);
  }

 private:
  valijson::Schema schema_;
};

CAROM_LIST std::vector<json> goodDocuments() {
  std::vector<json> documents = {
      oneBall(),
      with("/$schema", "x"),
      with("/name", "ball"),
      with("/description", ""),
      with("/duration", 3600),
      with("/duration", 2.1e-5),
      with("/sample_rate", 8000),
      with("/sample_rate", 192000),
      with("/seed", 9007199254740992),
      with("/gravity", {0, 0, 0}),
      with("/air", json::object()),
      with("/air", {{"density", 1000}, {"speed_of_sound", 1500}}),
      with("/air", {{"temperature", 200}, {"humidity", 0}, {"pressure", 1000}}),
      with("/air", {{"temperature", 350}, {"humidity", 1}, {"pressure", 2e5}}),
      with("/sound", {{"air_absorption", true}}),
      with("/stepper", json::object()),
      with("/stepper", {{"type", "native"}, {"rest_speed", 0}}),
      with("/stepper", {{"type", "bullet"}, {"step", 0.1}}),
      with("/stepper", {{"type", "bullet"}, {"step", 1e-5}}),
      with("/materials", json::object()),
      with("/materials", {{"oak", oak()}}),
      with("/restitutions", json::array()),
      with("/restitutions", {{{"materials", {"wood", "wood"}}, {"restitution", 0}},
                             {{"materials", {"wood", "steel"}}, {"restitution", 1}}}),
      with("/bodies/0/material", oak()),
      with("/bodies/0/material", {{"like", "wood"}}),
      with("/bodies/0/friction", 0),
      with("/bodies/1/friction", 10),
      withSolid({{"friction", 0.5}}),
      with("/materials", {{"a", {{"like", "b"}, {"friction", 0.4}}},
                          {"b", {{"like", "wood"}, {"restitution_law", "plastic"}}},
                          {"c", {{"like", "b"}, {"restitution_speed", 0.5}}}}),
      with("/bodies/0/radius", 1e-6),
      with("/bodies/0/mass", 1e-21),
      with("/bodies/0/velocity", {1e4, -1e4, 0}),
      with("/bodies/0/name", std::string(100, 'x')),
      with("/bodies/0/position", {1e6, 1e6, -1e6}),
      with("/listeners/0/name", "ear"),
      with("/camera", {{{"time", 0}, {"position", {0, 1, 2}}}}),
      with("/camera", {{{"time", 0}, {"position", {0, 1, 2}}, {"looks_at", {0, 0, 0}}},
                       {{"time", 3600},
                        {"position", {1, 1, 2}},
                        {"forward", {0, 0, -1}},
                        {"up", {1, 0, 0}},
                        {"field_of_view", 150}}}),
      withBodies(json::array({groupOf(2, 0.1, 1.0)})),
      withBodies(json::array({groupOf(2, {0.1, 0.1}, 1.0)}))};
  json group = groupOf(2, 0.1, 1.0);
  group["material"] = {"glass", oak()};
  group["speed"] = {0, 1};
  group["name"] = "group";
  group["friction"] = 0.1;
  documents.push_back(withBodies(json::array({group})));
  for (const json& sound :
       {json::object(), json{{"pulse", "half_sine"}, {"doppler", true}},
        json{{"dissipative", true}, {"sampling", "band_limited"}, {"radiation", "exact"}},
        json{{"audible_threshold", 0}, {"impulse", "physical"}},
        json{{"audible_threshold", 1000}, {"pulse", "mitchell_netravali"}}}) {
    documents.push_back(with("/sound", sound));
  }
  for (const json& keys :
       {json{{"friction", 10}, {"rolling_friction", 0}, {"pivoting_friction", 1}},
        json{{"restitution_law", "constant"}}, json{{"restitution_law", "viscoelastic"}},
        json{{"restitution_law", "plastic"}, {"restitution_speed", 1e-6}}}) {
    documents.push_back(withOak(keys));
  }
  for (const json& keys : {json::object(), json{{"name", "step"}, {"velocity", {1, -1, 0}}},
                           json{{"rotation", {{"axis", {1, 1e-300, 0}}, {"angle", -360}}}}}) {
    documents.push_back(withBlock(keys));
  }
  for (const json& keys : {json::object(), json{{"movable", false}, {"name", "slab"}},
                           json{{"mass", 1e18}, {"spin", {1e6, 0, 0}}, {"velocity", {0, 1, 0}}},
                           json{{"rotation", {{"axis", {1, 0, 0}}, {"angle", 30}}}}}) {
    documents.push_back(withSolid(keys));
  }
  for (const json& modes :
       {json("x"), json(std::string(1000, 'x')), json::object(), json{{"file", "x"}},
        json{{"file", "x"}, {"node", "y"}}, json{{"body", "solid"}},
        json{{"dofs", 192}, {"count", 1}, {"panels", 100}}, json{{"accuracy", 1e-5}},
        json{{"accuracy", 0.5}}, json{{"dofs", 1000000}, {"count", 2000}, {"panels", 5000}},
        json{{"body", "shell"}, {"thickness", 1e-6}},
        json{{"body", "shell"}, {"thickness", 1000}, {"springs", "axial"}, {"count", 1}}}) {
    documents.push_back(withModes(modes));
    documents.push_back(withSolid({{"modes", modes}, {"movable", false}}));
  }
  documents.push_back(withOak({{"damping_alpha", 1e6}, {"damping_beta", 1}}));
  documents.push_back(withOak(
      {{"thermal_expansion", 0.01}, {"thermal_conductivity", 1e5}, {"heat_capacity", 1e5}}));
  for (const double exponent : {-2.0, 2.0})
    documents.push_back(withOak({{"loss_factor", 2}, {"loss_exponent", exponent}}));
  for (const char* ringing : {"pressed", "coupled"})
    documents.push_back(with("/sound", {{"ringing", ringing}}));
  for (const char* recoil : {"sphere", "shape"})
    documents.push_back(with("/sound", {{"recoil", recoil}}));
  for (const char* radiation : {"directional", "monopole", "constant"})
    documents.push_back(with("/sound", {{"modal_radiation", radiation}}));
  documents.push_back(withShape({{"type", "cylinder"}, {"radius", 1e-6}, {"height", 2e4}}));
  documents.push_back(withMesh("l_shape.obj"));
  documents.push_back(withMesh("l_shape.obj", {{"scale", 1e-3}}));
  json pieces = withMesh("l_shape.obj");
  pieces["bodies"][2]["shape"]["pieces"] = withMesh("l_pieces.obj")["bodies"][2]["shape"]["file"];
  documents.push_back(pieces);
  json sheet = withMesh("sheet.obj");
  sheet["bodies"][2]["movable"] = false;
  documents.push_back(sheet);
  json alone = withSolid(json::object());
  alone["bodies"].erase(0);
  documents.push_back(alone);
  documents.push_back(with("/bodies/0/spin", {1e6, -1e6, 0}));
  documents.push_back(with("/bodies/1/velocity", {1, 1, 1}));
  documents.push_back(with("/bodies/1/oscillation",
                           {{"amplitude", {0, 0.5, 0}}, {"frequency", 1e4}, {"phase", 3}}));
  documents.push_back(with("/mechanics", json::object()));
  documents.push_back(with("/mechanics", {{"simultaneous", "reflections"},
                                          {"rods", json::array()},
                                          {"springs", json::array()},
                                          {"fields", {json::object()}},
                                          {"drag", {{"rate", 0}}},
                                          {"force_step", 1e-6}}));
  documents.push_back(withRod(json::object()));
  documents.push_back(withSpring({{"length", 0}, {"stiffness", 0}, {"damping", 1e9}}));
  json joined = withBodies({sphereAt(0.1, 0, 0, 0), sphereAt(0.1, 1, 0, 0)});
  joined["mechanics"] = {{"rods", {{{"bodies", {"sphere1", "sphere2"}}}}}};
  documents.push_back(joined);
  documents.push_back(with("/room", json::object()));
  documents.push_back(with("/room", {{"order", 0}, {"surfaces", {{"plane1", "rigid"}}}}));
  documents.push_back(
      with("/room", {{"reverb", {{"t60", 0.05}, {"volume", 0.1}, {"surface", 1.1}}}}));
  documents.push_back(inBox("wood", {{"order", 5}, {"reverb", true}}));
  documents.push_back(inBox("wood", {{"reverb", {{"t60", {1, 2, 3, 4, 5, 6, 100}}}}}));
  documents.push_back(inBox("brass", {{"surfaces", {{"hall", {0, 0, 0, 1, 1, 1, 0.5}}}}}));
  for (const json& listener :
       {json{{"format", "mono"}, {"pattern", 1}, {"forward", {0, 1e6, 1e6}}},
        json{{"format", "spaced_pair"}, {"spacing", 100}, {"half_angle", 180}},
        json{{"format", "coincident_pair"}, {"half_angle", 45.5}, {"pattern", 0.1}},
        json{{"format", "binaural"}, {"looks_at", {0, 0, 0}}, {"up", {0, 1, 0.5}}},
        json{{"path", {poseAt(1e-3, 0, 1, 1.1), poseAt(3600, 0, 1e5, 1)}}}}) {
    documents.push_back(withListener(listener));
  }
  const json points = json(std::vector<json>(8, {5, 5, 5}));
  json placed = withJello({{"positions", points}, {"velocities", points}});
  placed["bodies"][2].erase("position");
  documents.push_back(placed);
  for (const json& keys :
       {json::object(), json{{"integrator", "auto"}, {"error", 1e-6}},
        json{{"integrator", "midpoint"}, {"step", 0.1}}, json{{"integrator", "rk4"}},
        json{{"damping", 0.1}, {"contact", {{"stiffness", 0}}}, {"stiffness", 0}},
        json{{"field", {{"forces", {{0, 1e12, 0}}}}}},
        json{{"field", {{"forces", points}, {"min", {0, 0, 0}}, {"max", {1, 1, 1}}}}},
        json{{"rotation", {{"axis", {1, 1, 0}}, {"angle", 30}}}, {"spin", {0, 1, 0}}}}) {
    documents.push_back(withJello(keys));
  }
  return documents;
}

TEST_F(SceneSchema, AcceptsTheLibraryAndEveryGoodDocumentAsTheLoaderDoes) {
  for (const auto& file : libraryFiles())
    EXPECT_TRUE(accepts(json::parse(readFile(file)))) << file;
  for (const json& document : goodDocuments()) {
    EXPECT_TRUE(accepts(document)) << document;
    EXPECT_TRUE(parsed(document)) << messageOf(parsed(document));
  }
}

TEST_F(SceneSchema, RefusesEveryShapeErrorThatTheLoaderRefuses) {
  for (const Refusal& refusal : shapeRefusals()) {
    EXPECT_FALSE(accepts(json::parse(refusal.text))) << refusal.name << '\n' << refusal.text;
    EXPECT_FALSE(parseScene(refusal.text, "test.json")) << refusal.text;
  }
}

TEST_F(SceneSchema, EveryObjectRefusesUnknownKeysAndDescribesItsOwn) {
  const json schema = json::parse(readFile(kScenes / "scene.schema.json")).flatten();
  for (const auto& [pointer, value] : schema.items()) {
    if (!pointer.ends_with("/type") || value != "object") continue;
    const std::string owner = pointer.substr(0, pointer.size() - 5);
    EXPECT_TRUE(schema.contains(owner + "/description")) << owner;
    const bool closed = schema.contains(owner + "/additionalProperties") ||
                        schema.contains(owner + "/additionalProperties/$ref");
    EXPECT_TRUE(closed) << owner;
  }
}

// --- Library -------------------------------------------------------------------------------------

TEST(SceneLibrary, EverySceneLoadsKeepsTheInvariantsAndSaysWhatItIs) {
  const std::vector<std::filesystem::path> files = libraryFiles();
  EXPECT_GE(files.size(), 5U);
  for (const auto& file : files) {
    const Result<Scene> scene = loadScene(file);
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_EQ(brokenPromise(*scene), "") << file;
    EXPECT_EQ(scene->name, file.stem().string());
    EXPECT_GT(scene->description.size(), 100U) << file;
  }
}

Scene libraryScene(const std::string& name) {
  const Result<Scene> scene = loadScene(kScenes / "library" / (name + ".json"));
  EXPECT_TRUE(scene) << messageOf(scene);
  return scene ? *scene : Scene{};
}

TEST(SceneLibrary, BouncingBallRestsBeforeTheEnd) {
  const Scene scene = libraryScene("bouncing_ball");
  ASSERT_EQ(scene.bodies.size(), 2U);
  const double restitution =
      std::sqrt(scene.bodies[0].material.restitution * scene.bodies[1].material.restitution);
  EXPECT_NEAR(restitution, 0.8, 0.02);
  const double firstTouch = std::sqrt(2.0 * 0.5 / 9.81);
  EXPECT_LT(firstTouch * (1.0 + restitution) / (1.0 - restitution), scene.duration - 0.5);
}

TEST(SceneLibrary, TwoBallsMeetObliquelyBetweenTwoSteps) {
  const Scene scene = libraryScene("two_balls");
  const SphereShape& left = sphereOf(scene.bodies.at(0));
  const SphereShape& right = sphereOf(scene.bodies.at(1));
  const Vec3 apart = right.position - left.position;
  const Vec3 closing = left.velocity - right.velocity;
  const double along = apart.dot(closing.normalized());
  const double impact = std::sqrt(apart.squaredNorm() - along * along);
  const double reach = left.radius + right.radius;
  EXPECT_NEAR(std::asin(impact / reach), std::numbers::pi / 6.0, 1e-6);
  const double time = (along - std::sqrt(reach * reach - impact * impact)) / closing.norm();
  EXPECT_NEAR(time, 0.4037, 5e-5);
  const double phase = time / scene.stepper.step - std::floor(time / scene.stepper.step);
  EXPECT_NEAR(phase, 0.222, 0.005);
}

TEST(SceneLibrary, MarblesAreAShowcase) {
  const Scene scene = libraryScene("marbles_in_a_box");
  std::set<std::string> materials;
  std::size_t marbles = 0;
  for (const SceneBody& body : scene.bodies) {
    if (!std::holds_alternative<SphereShape>(body.shape)) continue;
    ++marbles;
    materials.insert(body.material.name);
  }
  EXPECT_GE(marbles, 60U);
  EXPECT_EQ(materials, (std::set<std::string>{"ceramic", "glass", "plastic", "steel"}));
  ASSERT_EQ(scene.listeners.size(), 2U);
  EXPECT_NEAR((scene.listeners[0].position - scene.listeners[1].position).norm(), 0.17, 0.01);
}

// --- Robustness ----------------------------------------------------------------------------------

/// Changes a text randomly: drops, flips or doubles a byte, cuts off the end, swaps two bytes, or
/// replaces a number by an awkward one.
std::string mutated(std::string text, std::mt19937_64& random) {
  static const std::vector<std::string> kNasty = {"-1", "0",  "1e999", "1e-320", "null", "\"\"",
                                                  "[]", "{}", "1e6",   "100000", "-0.0", "0.5"};
  const std::size_t place = random() % text.size();
  switch (random() % 6) {
    case 0:
      return text.erase(place, 1);
    case 1:
      text[place] = static_cast<char>(static_cast<unsigned char>(text[place]) ^
                                      (1U << static_cast<unsigned>(random() % 8)));
      return text;
    case 2:
      return text.insert(place, 1, text[place]);
    case 3:
      return text.substr(0, place);
    case 4: {
      const std::size_t other = random() % text.size();
      std::swap(text[place], text[other]);
      return text;
    }
    default: {
      const std::size_t start = text.find_first_of("-0123456789", place);
      if (start == std::string::npos) return text;
      const std::size_t end = text.find_first_not_of("-+.eE0123456789", start);
      return text.replace(start, end - start, kNasty[random() % kNasty.size()]);
    }
  }
}

TEST(SceneRobustness, ThousandsOfSpoiltScenesAreErrorsOrSoundScenes) {
  std::mt19937_64 random(20260101);
  std::size_t acceptedCount = 0;
  for (const auto& file : libraryFiles()) {
    const std::string original = readFile(file);
    for (int mutant = 0; mutant < 1000; ++mutant) {
      std::string text = mutated(original, random);
      if (mutant % 2 == 1) text = mutated(text.empty() ? original : text, random);
      const Result<Scene> scene = parseScene(text, "mutant.json");
      if (!scene) {
        EXPECT_TRUE(scene.error().message.starts_with("mutant.json: "));
        continue;
      }
      ++acceptedCount;
      if (scene->bodies.size() < 1000) {
        ASSERT_EQ(brokenPromise(*scene), "") << text;
      }
    }
  }
  EXPECT_GT(acceptedCount, 500U);  // otherwise the mutants test only the JSON parser
}

}  // namespace
}  // namespace carom
