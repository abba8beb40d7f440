#include "scenes/format/scene_loader.h"

#include <array>
#include <functional>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "modal/json/json_reader.h"
#include "scenes/format/body_placement.h"
#include "scenes/format/group_random.h"
#include "scenes/format/jello_reader.h"
#include "scenes/format/material_reader.h"
#include "scenes/format/mechanics_reader.h"
#include "scenes/format/ringing_reader.h"
#include "scenes/format/scene_folder.h"
#include "scenes/format/solid_reader.h"
#include "scenes/format/sound_reader.h"
#include "scenes/values/camera_reader.h"
#include "scenes/values/scene_ranges.h"

namespace carom::scenes {

using namespace modal;

namespace {

// ---------------------------------------------------------------------------------------------
// The ranges that are accepted. scene.schema.json and docs/scenes.md repeat them; a test compares
// the schema.

constexpr double kMaxExactInteger = 9007199254740992.0;  // 2^53

constexpr NumberRange kDuration{
    .noun = "a duration", .min = 0.0, .max = 3600.0, .unit = "seconds", .aboveMin = true};
constexpr NumberRange kSampleRate{
    .noun = "a sample rate", .min = 8000.0, .max = 192000.0, .unit = "Hz", .whole = true};
constexpr NumberRange kSeed{.noun = "a seed", .min = 0.0, .max = kMaxExactInteger, .whole = true};
constexpr NumberRange kGravity{
    .noun = "a component of gravity", .min = -1e4, .max = 1e4, .unit = "m/s^2"};
constexpr NumberRange kAirDensity{
    .noun = "a density of air", .min = 1e-3, .max = 1e4, .unit = "kg/m^3"};
constexpr NumberRange kSpeedOfSound{
    .noun = "a speed of sound", .min = 1.0, .max = 1e4, .unit = "m/s"};
constexpr NumberRange kAirTemperature{.noun = "a temperature of air",
                                      .min = 200.0,
                                      .max = 350.0,
                                      .unit = "kelvin; 293.15 is 20 degrees C"};
constexpr NumberRange kAirHumidity{
    .noun = "a relative humidity", .min = 0.0, .max = 1.0, .unit = "(1: 100 %)"};
constexpr NumberRange kAirPressure{
    .noun = "a pressure of air", .min = 1e3, .max = 2e5, .unit = "pascals"};
constexpr NumberRange kStep{.noun = "a step", .min = 1e-5, .max = 0.1, .unit = "seconds"};
constexpr NumberRange kRestSpeed{.noun = "a rest speed", .min = 0.0, .max = 1e4, .unit = "m/s"};
constexpr NumberRange kSpeed{.noun = "a speed", .min = 0.0, .max = 1e4, .unit = "m/s"};
constexpr NumberRange kNormal{.noun = "a component of a normal", .min = -1e6, .max = 1e6};
constexpr NumberRange kCount{.noun = "a count of spheres",
                             .min = 1.0,
                             .max = static_cast<double>(SceneLimits::kSpheres),
                             .whole = true};

constexpr TextRange kDescription{
    .noun = "a description", .minLength = 0, .maxLength = 10000, .multiline = true};
constexpr TextRange kSchemaAddress{
    .noun = "the address of a schema", .minLength = 0, .maxLength = 1000};

constexpr std::size_t kMaxEntries =
    SceneLimits::kSpheres + SceneLimits::kPlanes + SceneLimits::kBlocks + SceneLimits::kSolids;

// ---------------------------------------------------------------------------------------------

/// Assigns unique names to bodies or to listeners. Names given in the file are reserved first, so
/// that a default never takes one of them.
class Names {
 public:
  /// Reserves the name; false if it is taken.
  bool reserve(const std::string& name) { return reserved_.insert(name).second; }

  /// Returns STEM1, STEM2, ...: the next name that is free, and whose parts ("NAME.PART") are free.
  std::string next(const std::string& stem) {
    for (;;) {
      std::string name = stem + std::to_string(++used_[stem]);
      const auto part = reserved_.lower_bound(name + '.');
      const bool partTaken = part != reserved_.end() && part->starts_with(name + '.');
      if (!partTaken && reserve(name)) return name;
    }
  }

 private:
  std::set<std::string, std::less<>> reserved_;
  std::map<std::string, std::size_t> used_;
};

/// Returns the mass of a solid sphere, kg.
double sphereMass(double density, double radius) {
  return density * (4.0 / 3.0 * std::numbers::pi * radius * radius * radius);
}

/// True if the scene is long enough to be heard.
bool hasASample(const Scene& scene) {
  return scene.duration * scene.sampleRate >= 1.0;
}

/// True if the body's mesh has texture coordinates.
bool isUnwrapped(const SceneBody& body) {
  const auto* solid = std::get_if<SolidShape>(&body.shape);
  return solid != nullptr && hasTextureCoordinates(*solid);
}

/// Reads one document into one scene. Every error is recorded in `error`; what follows the first
/// one is dropped with the scene.
class SceneReader {
 public:
  /// Names of files in the scene are relative to `folder`.
  SceneReader(FirstError& error, SceneFolder folder)
      : error_(error), folder_(std::move(folder)), materials_(folder_), solids_(folder_) {}

  Scene read(const JsonNode& root, std::string_view defaultName);

 private:
  /// The origin of a plane: its entry in the file, and the kind of its material.
  struct PlaneOrigin {
    std::string entry;    // name of the plane itself, or of its box
    std::string builtIn;  // name of the built-in material that it is of, or of one like it
  };

  void readAir(const JsonNode& air);
  void readStepper(const JsonNode& stepper);

  void readBodies(const JsonNode& root);
  void reserveNames(const std::vector<JsonNode>& entries, Names& names);
  std::string entryName(const JsonNode& entry, const std::string& stem, Names& names);
  void readBody(const JsonNode& entry);
  void readSphere(const JsonNode& entry);
  void readPlane(const JsonNode& entry);
  void readBox(const JsonNode& entry);
  void readBlock(const JsonNode& entry);
  void readSolid(const JsonNode& entry);
  void readJelloBody(const JsonNode& entry);
  void readGroup(const JsonNode& entry);
  void readListeners(const JsonNode& root);
  void addListener(const JsonNode& entry, Names& names);
  std::vector<RoomPlane> roomPlanes() const;

  bool readCorners(const JsonNode& entry, Vec3& min, Vec3& max);
  bool countSpheres(const JsonNode& node, std::size_t count);
  void addPlane(const JsonNode& entry, std::string name, SurfaceMaterial made,
                const PlaneShape& plane);
  void addBody(const JsonNode& entry, SceneBody body);
  void placeBodies();

  bool ok() const { return !error_; }

  FirstError& error_;
  SceneFolder folder_;
  MaterialReader materials_;
  SolidReader solids_;
  Scene scene_;
  std::uint64_t seed_ = 0;
  Names bodyNames_;
  std::set<std::string> finalNames_;
  std::vector<JsonNode> entries_;  // by body
  std::vector<PendingGroup> groups_;
  std::vector<std::size_t> planes_;   // indices of bodies
  std::vector<PlaneOrigin> origins_;  // by index in planes_
  std::size_t sphereCount_ = 0;
  std::size_t blockCount_ = 0;
  std::size_t solidCount_ = 0;
  bool anySolidMoves_ = false;
  bool hasJello_ = false;
};

Scene SceneReader::read(const JsonNode& root, std::string_view defaultName) {
  if (!root.expectObject("a scene",
                         {"$schema", "name", "description", "duration", "sample_rate", "seed",
                          "gravity", "air", "stepper", "mechanics", "sound", "materials",
                          "restitutions", "bodies", "room", "listeners", "camera"})) {
    return {};
  }
  root.text("$schema", kSchemaAddress, "");
  scene_.name = root.text("name", kName, defaultName);
  scene_.description = root.text("description", kDescription, "");
  scene_.duration = root.number("duration", kDuration);
  scene_.sampleRate = root.number("sample_rate", kSampleRate, scene_.sampleRate);
  if (const auto duration = root.find("duration"); duration && ok() && !hasASample(scene_))
    duration->fail(formatNumber(scene_.duration) + " s is less than a sample; expected at least " +
                   formatNumber(1.0 / scene_.sampleRate) + " s");
  seed_ = static_cast<std::uint64_t>(root.number("seed", kSeed, 0.0));
  scene_.gravity = root.vector("gravity", kGravity, scene_.gravity);
  if (const auto air = root.find("air")) readAir(*air);
  if (const auto stepper = root.find("stepper")) readStepper(*stepper);
  if (const auto sound = root.find("sound")) readSound(*sound, scene_);
  if (const auto materials = root.find("materials")) materials_.readMaterials(*materials);
  if (const auto restitutions = root.find("restitutions"); restitutions && ok())
    materials_.readRestitutions(*restitutions, scene_.restitutions);
  if (ok()) readBodies(root);
  if (const auto room = root.find("room"); room && ok())
    readRoom(*room, roomPlanes(), scene_.medium.speedOfSound, scene_.sound);
  if (ok()) readListeners(root);
  if (const auto camera = root.find("camera"); camera && ok())
    scene_.camera = readCamera(*camera, scene_.gravity);
  if (ok()) placeBodies();
  if (const auto mechanics = root.find("mechanics"); mechanics && ok())
    readMechanics(*mechanics, scene_);
  return std::move(scene_);
}

void SceneReader::readAir(const JsonNode& air) {
  if (!air.expectObject("a description of the air",
                        {"density", "speed_of_sound", "temperature", "humidity", "pressure"}))
    return;
  Medium& medium = scene_.medium;
  medium.density = air.number("density", kAirDensity, medium.density);
  medium.speedOfSound = air.number("speed_of_sound", kSpeedOfSound, medium.speedOfSound);
  medium.temperature = air.number("temperature", kAirTemperature, medium.temperature);
  medium.humidity = air.number("humidity", kAirHumidity, medium.humidity);
  medium.pressure = air.number("pressure", kAirPressure, medium.pressure);
}

void SceneReader::readStepper(const JsonNode& stepper) {
  if (!stepper.expectObject("a stepper", {"type", "step", "rest_speed", "tuned"})) return;
  StepperSettings& settings = scene_.stepper;
  if (const auto type = stepper.find("type")) {
    const bool native = type->choice("a type of stepper", {"native", "bullet"}) == 0;
    settings.type = native ? StepperType::native : StepperType::bullet;
  }
  settings.step = stepper.number("step", kStep, settings.step);
  settings.restSpeed = stepper.number("rest_speed", kRestSpeed, settings.restSpeed);
  settings.tuned = stepper.boolean("tuned", settings.tuned);
  const auto step = stepper.find("step");
  if (step && settings.type == StepperType::native) {
    step->fail("the native stepper has no step; expected none, or \"type\": \"bullet\"");
  }
  const auto tuned = stepper.find("tuned");
  if (tuned && settings.type == StepperType::native) {
    tuned->fail("the native stepper has nothing to tune; expected none, or \"type\": \"bullet\"");
  }
}

void SceneReader::readBodies(const JsonNode& root) {
  const auto bodies = root.require("bodies", "an array of bodies");
  if (!bodies) return;
  if (!bodies->isArray()) {
    bodies->failAs("a list of bodies", "an array");
    return;
  }
  const std::vector<JsonNode> entries = bodies->elements("a list of bodies", 0, kMaxEntries);
  reserveNames(entries, bodyNames_);
  for (const JsonNode& entry : entries) {
    if (!ok()) return;
    readBody(entry);
  }
  if (ok() && sphereCount_ == 0 && !anySolidMoves_ && !hasJello_) {
    bodies->fail(
        "empty scene: nothing in it can move; expected at least one sphere, solid or jello");
  }
}

void SceneReader::reserveNames(const std::vector<JsonNode>& entries, Names& names) {
  for (const JsonNode& entry : entries) {
    if (!ok()) return;
    const auto name = entry.find("name");
    if (!name) continue;
    const std::string text = name->text(kName);
    if (!names.reserve(text))
      name->fail("the name " + inQuotes(text) + " is taken; expected another");
  }
}

std::string SceneReader::entryName(const JsonNode& entry, const std::string& stem, Names& names) {
  const auto name = entry.find("name");
  return name ? name->text(kName) : names.next(stem);
}

void SceneReader::readBody(const JsonNode& entry) {
  if (!entry.isObject()) {
    entry.failAs("a body", "an object");
    return;
  }
  const auto type = entry.require(
      "type", R"(one of "sphere", "plane", "box", "spheres", "block", "solid", "jello")");
  if (!type) return;
  const std::size_t choice = type->choice(
      "a type of body", {"sphere", "plane", "box", "spheres", "block", "solid", "jello"});
  if (!ok()) return;
  using Read = void (SceneReader::*)(const JsonNode&);
  constexpr std::array<Read, 7> kReaders = {&SceneReader::readSphere,   &SceneReader::readPlane,
                                            &SceneReader::readBox,      &SceneReader::readGroup,
                                            &SceneReader::readBlock,    &SceneReader::readSolid,
                                            &SceneReader::readJelloBody};
  (this->*kReaders.at(choice))(entry);
}

void SceneReader::readSphere(const JsonNode& entry) {
  if (!entry.expectObject(
          "a sphere", {"type", "name", "radius", "material", "position", "velocity", "spin", "mass",
                       "modes", "friction", "roughness", "normal_map"})) {
    return;
  }
  if (!countSpheres(entry, 1)) return;
  const std::string name = entryName(entry, "sphere", bodyNames_);
  SphereShape sphere;
  sphere.radius = entry.number("radius", kRadius);
  SceneBody body = materials_.readBodyMaterial(entry, name).body(name);
  sphere.position = entry.vector("position", kPlace);
  sphere.velocity = entry.vector("velocity", kVelocity, Vec3::Zero());
  sphere.spin = readSpin(entry);
  sphere.mass = entry.number("mass", kMass, sphereMass(body.material.density, sphere.radius));
  body.shape = sphere;
  body.ringing = readRinging(entry, folder_);
  addBody(entry, std::move(body));
}

void SceneReader::readPlane(const JsonNode& entry) {
  if (!entry.expectObject("a plane",
                          {"type", "name", "normal", "point", "offset", "material", "velocity",
                           "oscillation", "friction", "roughness", "normal_map"})) {
    return;
  }
  const std::string name = entryName(entry, "plane", bodyNames_);
  const Vec3 direction = entry.vector("normal", kNormal);
  const double largest = direction.cwiseAbs().maxCoeff();
  if (ok() && largest == 0.0) {
    entry.find("normal")->fail("the normal has no direction; expected one component not 0");
  }
  const auto point = entry.find("point");
  const auto offset = entry.find("offset");
  if (point.has_value() == offset.has_value()) {
    entry.fail(point ? "the plane has a point and an offset; expected one of the two"
                     : "the plane has no place; expected \"point\" or \"offset\"");
  }
  SurfaceMaterial made = materials_.readBodyMaterial(entry, name);
  if (!ok()) return;
  PlaneShape plane;
  plane.normal = (direction / largest).normalized();  // the first division avoids underflow
  plane.offset = point ? plane.normal.dot(point->vector(kPlace)) : offset->number(kPlace);
  readMotion(entry, plane);
  addPlane(entry, name, std::move(made), plane);
}

void SceneReader::readBox(const JsonNode& entry) {
  if (!entry.expectObject("a box", {"type", "name", "min", "max", "material", "friction",
                                    "roughness", "normal_map"}))
    return;
  const std::string name = entryName(entry, "box", bodyNames_);
  Vec3 min = Vec3::Zero();
  Vec3 max = Vec3::Zero();
  if (!readCorners(entry, min, max)) return;
  const SurfaceMaterial wall = materials_.readBodyMaterial(entry, name);
  if (!ok()) return;
  addPlane(entry, name + ".left", wall, {Vec3::UnitX(), min.x()});
  addPlane(entry, name + ".right", wall, {-Vec3::UnitX(), -max.x()});
  addPlane(entry, name + ".bottom", wall, {Vec3::UnitY(), min.y()});
  addPlane(entry, name + ".top", wall, {-Vec3::UnitY(), -max.y()});
  addPlane(entry, name + ".back", wall, {Vec3::UnitZ(), min.z()});
  addPlane(entry, name + ".front", wall, {-Vec3::UnitZ(), -max.z()});
}

void SceneReader::readBlock(const JsonNode& entry) {
  if (!entry.expectObject("a block", {"type", "name", "min", "max", "rotation", "material",
                                      "velocity", "friction", "roughness", "normal_map"})) {
    return;
  }
  const std::string name = entryName(entry, "block", bodyNames_);
  Vec3 min = Vec3::Zero();
  Vec3 max = Vec3::Zero();
  if (!readCorners(entry, min, max)) return;
  BlockShape block;
  block.centre = 0.5 * (min + max);
  block.halfExtents = 0.5 * (max - min);
  block.orientation = readRotation(entry);
  block.velocity = entry.vector("velocity", kVelocity, Vec3::Zero());
  SurfaceMaterial made = materials_.readBodyMaterial(entry, name);
  if (!ok()) return;
  if (++blockCount_ > SceneLimits::kBlocks) {
    entry.fail("the scene has more than " + std::to_string(SceneLimits::kBlocks) +
               " blocks; expected at most that many");
  }
  SceneBody body = std::move(made).body(name);
  body.shape = block;
  addBody(entry, std::move(body));
}

void SceneReader::readSolid(const JsonNode& entry) {
  if (!SolidReader::expectSolid(entry)) return;
  const std::string name = entryName(entry, "solid", bodyNames_);
  SurfaceMaterial made = materials_.readBodyMaterial(entry, name);
  if (!ok()) return;
  const SolidShape solid = solids_.read(entry, made.material.density);
  if (++solidCount_ > SceneLimits::kSolids) {
    entry.fail("the scene has more than " + std::to_string(SceneLimits::kSolids) +
               " solids; expected at most that many");
  }
  anySolidMoves_ = anySolidMoves_ || solid.canMove();
  SceneBody body = std::move(made).body(name);
  body.shape = solid;
  body.ringing = readRinging(entry, folder_);
  addBody(entry, std::move(body));
}

void SceneReader::readJelloBody(const JsonNode& entry) {
  if (!expectJello(entry)) return;
  const std::string name = entryName(entry, "jello", bodyNames_);
  auto jello = std::make_shared<JelloShape>(readJello(entry));
  if (!ok()) return;
  if (hasJello_) {
    entry.fail("the scene has a jello already; expected one");
    return;
  }
  hasJello_ = true;
  SceneBody body;
  body.name = name;
  body.material = jelloMaterial(jello->lattice);
  body.shape = std::move(jello);
  addBody(entry, std::move(body));
}

void SceneReader::readGroup(const JsonNode& entry) {
  if (!entry.expectObject("a group of spheres", {"type", "name", "count", "radius", "material",
                                                 "min", "max", "speed", "friction"})) {
    return;
  }
  const std::string name = entryName(entry, "spheres", bodyNames_);
  const auto count = static_cast<std::size_t>(entry.number("count", kCount));
  const auto radius = entry.require("radius", kRadius.describe() + ", or [min, max] of such");
  const Interval radii = radius ? radius->interval(kRadius) : Interval{};
  const std::vector<SurfaceMaterial> materials = materials_.readGroupMaterials(entry, name);
  const auto speed = entry.find("speed");
  const Interval speeds = speed ? speed->interval(kSpeed) : Interval{};
  Vec3 min = Vec3::Zero();
  Vec3 max = Vec3::Zero();
  if (!readCorners(entry, min, max) || !countSpheres(*entry.find("count"), count)) return;

  PendingGroup group{
      scene_.bodies.size(), count, min, max, entry, GroupRandom(seed_, groups_.size())};
  for (std::size_t member = 0; member < count; ++member) {
    SphereShape sphere;
    sphere.radius = group.random.within(radii);
    const SurfaceMaterial& picked = materials[group.random.index(materials.size())];
    sphere.mass = sphereMass(picked.material.density, sphere.radius);
    // In one expression, each compiler would draw them in its own order.
    const Vec3 direction = group.random.direction();
    sphere.velocity = group.random.within(speeds) * direction;
    addBody(entry, {name + '.' + std::to_string(member + 1), picked.material, sphere,
                    picked.surface, picked.contact});
  }
  groups_.push_back(std::move(group));
}

void SceneReader::readListeners(const JsonNode& root) {
  const auto listeners = root.require("listeners", "an array of at least one listener");
  if (!listeners) return;
  const std::vector<JsonNode> entries =
      listeners->elements("a list of listeners", 1, SceneLimits::kListeners);
  Names names;
  for (const JsonNode& entry : entries) {
    if (!expectListener(entry)) return;
  }
  reserveNames(entries, names);
  for (const JsonNode& entry : entries) {
    if (!ok()) return;
    addListener(entry, names);
  }
}

void SceneReader::addListener(const JsonNode& entry, Names& names) {
  ListenerEntry read = readListener(entry, folder_);
  read.listener.name = entryName(entry, "listener", names);
  const std::size_t index = scene_.listeners.size();
  scene_.listeners.push_back(std::move(read.listener));
  if (!read.sofa.empty()) scene_.headFiles.push_back({index, std::move(read.sofa)});
  if (!read.poses.empty()) scene_.paths.push_back({index, std::move(read.poses)});
}

std::vector<RoomPlane> SceneReader::roomPlanes() const {
  std::vector<RoomPlane> planes;
  for (std::size_t index = 0; index < planes_.size(); ++index) {
    const SceneBody& body = scene_.bodies[planes_[index]];
    const auto& shape = std::get<PlaneShape>(body.shape);
    const PlaneOrigin& origin = origins_[index];
    planes.push_back({.name = body.name,
                      .entry = origin.entry,
                      .surface = defaultSurface(origin.builtIn),
                      .material = body.material.name,
                      .normal = shape.normal,
                      .offset = shape.offset});
  }
  return planes;
}

bool SceneReader::readCorners(const JsonNode& entry, Vec3& min, Vec3& max) {
  min = entry.vector("min", kPlace);
  max = entry.vector("max", kPlace);
  if (!ok()) return false;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    if (min[axis] < max[axis]) continue;
    entry.find("max")->fail(formatNumber(max[axis]) + " is not above the minimum " +
                            formatNumber(min[axis]) + " along " + "xyz"[axis] +
                            "; expected max > min on every axis");
    return false;
  }
  return true;
}

bool SceneReader::countSpheres(const JsonNode& node, std::size_t count) {
  sphereCount_ += count;
  if (ok() && sphereCount_ > SceneLimits::kSpheres) {
    node.fail("the scene has more than " + std::to_string(SceneLimits::kSpheres) +
              " spheres; expected at most that many");
  }
  return ok();
}

void SceneReader::addPlane(const JsonNode& entry, std::string name, SurfaceMaterial made,
                           const PlaneShape& plane) {
  planes_.push_back(scene_.bodies.size());
  // The walls of a box are named BOX.left, and so on.
  const bool isBoxWall = entry.find("min").has_value();
  origins_.push_back({isBoxWall ? name.substr(0, name.rfind('.')) : name, made.builtIn});
  if (planes_.size() > SceneLimits::kPlanes) {
    entry.fail("the scene has more than " + std::to_string(SceneLimits::kPlanes) +
               " planes; expected at most that many, six for each box");
  }
  SceneBody body = std::move(made).body(std::move(name));
  body.shape = plane;
  addBody(entry, std::move(body));
}

void SceneReader::addBody(const JsonNode& entry, SceneBody body) {
  if (!ok()) return;
  if (body.normalMap && body.normalMap->byCoordinates && !isUnwrapped(body)) {
    entry.find("normal_map")
        ->fail(
            "has no \"size\", and the body no mesh with texture coordinates; expected width and "
            "height of the whole picture (metres)");
    return;
  }
  if (!finalNames_.insert(body.name).second) {
    entry.fail("the name " + inQuotes(body.name) + " is taken; expected names that differ");
    return;
  }
  entries_.push_back(entry);
  body.pointer = entry.pointer();
  scene_.bodies.push_back(std::move(body));
}

void SceneReader::placeBodies() {
  BodyPlacement placement(scene_, std::move(entries_), std::move(groups_));
  placement.checkOverlaps();
  if (ok()) placement.placeGroups();
}

// ---------------------------------------------------------------------------------------------

/// Returns the stem of the file's name if that is valid as the name of a scene, else "scene".
std::string defaultSceneName(std::string_view document) {
  std::string stem = std::filesystem::path(document).stem().string();
  return kName.contains(stem) ? stem : "scene";
}

}  // namespace

bool isOverlap(const Error& error) {
  return error.message.find(kAtTheStart) != std::string::npos;
}

Result<Scene> parseScene(std::string_view text, std::string_view name, const FileAccess& access) {
  FirstError error(name);
  if (text.size() > SceneLimits::kFileSize) {
    error.record({}, "larger than " + std::to_string(SceneLimits::kFileSize >> 20U) +
                         " MiB; expected a scene of at most that size");
    return error.error();
  }
  const std::optional<nlohmann::json> document = parseJson(text, error);
  if (!document) return error.error();
  SceneFolder folder{std::filesystem::path(name).parent_path(), access.confined};
  if (access.folder) folder.path = *access.folder;
  SceneReader reader(error, folder);
  Scene scene = reader.read(JsonNode(*document, "", error), defaultSceneName(name));
  if (error) return error.error();
  scene.files = std::move(*folder.named);
  return scene;
}

}  // namespace carom::scenes
