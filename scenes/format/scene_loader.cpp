#include "scenes/format/scene_loader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <numbers>
#include <numeric>
#include <optional>
#include <random>
#include <set>
#include <string>
#include <system_error>
#include <unordered_map>
#include <utility>
#include <vector>

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include "modal/json/json_reader.h"
#include "native/jello/jello_skin.h"
#include "scenes/format/jello_reader.h"
#include "scenes/format/mechanics_reader.h"
#include "scenes/format/ringing_reader.h"
#include "scenes/format/scene_ranges.h"
#include "scenes/format/solid_reader.h"
#include "scenes/format/sound_reader.h"
#include "scenes/format/surface_reader.h"

namespace carom::scenes {

using namespace modal;
using namespace native;

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
constexpr NumberRange kStep{.noun = "a step", .min = 1e-5, .max = 0.1, .unit = "seconds"};
constexpr NumberRange kRestSpeed{.noun = "a rest speed", .min = 0.0, .max = 1e4, .unit = "m/s"};
constexpr NumberRange kDensity{.noun = "a density", .min = 1e-3, .max = 1e5, .unit = "kg/m^3"};
constexpr NumberRange kYoungsModulus{
    .noun = "a Young's modulus", .min = 1.0, .max = 1e13, .unit = "pascals"};
constexpr NumberRange kPoissonsRatio{
    .noun = "a Poisson's ratio", .min = 0.0, .max = 0.5, .belowMax = true};
constexpr NumberRange kRestitution{.noun = "a restitution", .min = 0.0, .max = 1.0};
constexpr NumberRange kDampingAlpha{
    .noun = "a damping in proportion to mass", .min = 0.0, .max = 1e6, .unit = "1/s"};
constexpr NumberRange kDampingBeta{
    .noun = "a damping in proportion to stiffness", .min = 0.0, .max = 1.0, .unit = "s"};
constexpr NumberRange kSpeed{.noun = "a speed", .min = 0.0, .max = 1e4, .unit = "m/s"};
constexpr NumberRange kNormal{.noun = "a component of a normal", .min = -1e6, .max = 1e6};
constexpr NumberRange kCount{.noun = "a count of spheres",
                             .min = 1.0,
                             .max = static_cast<double>(SceneLimits::kSpheres),
                             .whole = true};

constexpr TextRange kName{.noun = "a name", .minLength = 1, .maxLength = 100};
constexpr TextRange kMaterialName{
    .noun = "the name of a material", .minLength = 1, .maxLength = 100};
constexpr TextRange kDescription{
    .noun = "a description", .minLength = 0, .maxLength = 10000, .multiline = true};
constexpr TextRange kSchemaAddress{
    .noun = "the address of a schema", .minLength = 0, .maxLength = 1000};

constexpr std::size_t kMaxEntries =
    SceneLimits::kSpheres + SceneLimits::kPlanes + SceneLimits::kBlocks + SceneLimits::kSolids;
constexpr std::size_t kMaxMaterials = 1000;
constexpr std::size_t kMaxRestitutions = 1000;

constexpr double kOverlapTolerance = 1e-9;  // share of the radius, for rounding in the file
constexpr double kPlacingClearance = 1e-3;  // share of the radius, gap between spheres of groups
constexpr int kTriesPerSphere = 2000;
constexpr std::uint64_t kMaxPlacingWork = 200'000'000;  // distances computed; some seconds

// ---------------------------------------------------------------------------------------------

/// The random numbers of one group of spheres. The standard fixes the bits of the engine, but not
/// those of its distributions, so these are our own.
class GroupRandom {
 public:
  GroupRandom(std::uint64_t seed, std::uint64_t group) : engine_(mixed(mixed(seed) + group)) {}

  /// Uniform in [0, 1), with 53 bits.
  double unit() { return static_cast<double>(engine_() >> 11U) * 0x1p-53; }

  double within(const Interval& interval) {
    const double value = interval.min + (interval.max - interval.min) * unit();
    return std::min(value, interval.max);  // rounding can reach past it
  }

  /// Uniform in [0, count), count < 2^32.
  std::size_t index(std::size_t count) { return ((engine_() >> 32U) * count) >> 32U; }

  /// Uniform on the unit sphere, by + - * sqrt only: Marsaglia 1972, "Choosing a point from the
  /// surface of a sphere".
  Vec3 direction() {
    for (;;) {
      const double first = 2.0 * unit() - 1.0;
      const double second = 2.0 * unit() - 1.0;
      const double square = first * first + second * second;
      if (square >= 1.0) continue;
      const double scale = 2.0 * std::sqrt(1.0 - square);
      return {first * scale, second * scale, 1.0 - 2.0 * square};
    }
  }

 private:
  /// The finaliser of SplitMix64 (Steele, Lea, Flood 2014): neighbouring seeds become unrelated.
  static std::uint64_t mixed(std::uint64_t bits) {
    bits += 0x9e3779b97f4a7c15U;
    bits = (bits ^ (bits >> 30U)) * 0xbf58476d1ce4e5b9U;
    bits = (bits ^ (bits >> 27U)) * 0x94d049bb133111ebU;
    return bits ^ (bits >> 31U);
  }

  std::mt19937_64 engine_;
};

/// A spatial index of spheres of very different radii: a hash of cubic cells with one cell size for
/// each power of two of the diameter. A query visits a few cells for each size in use, as long as
/// no sphere in the grid is much smaller than the query's; otherwise it visits all of the small
/// ones, which work() shows.
class SphereGrid {
 public:
  struct Ball {
    Vec3 centre = Vec3::Zero();
    double radius = 0.0;
    std::size_t body = 0;
  };

  void insert(const Ball& ball) {
    const int exponent = cellExponent(ball.radius);
    const Cell cell = cellOf(ball.centre, std::ldexp(1.0, exponent));
    cells_[hash(exponent, cell)].push_back(balls_.size());
    levels_[exponent].push_back(balls_.size());
    balls_.push_back(ball);
  }

  /// Returns a ball whose surface is nearer than `gap` (m; negative: an overlap deeper than that),
  /// or nullptr.
  const Ball* nearerThan(double gap, const Vec3& centre, double radius) {
    for (const auto& [exponent, members] : levels_) {
      const Query query{centre, radius, gap};
      const Ball* found = nearestInLevel(query, exponent, members);
      if (found != nullptr) return found;
    }
    return nullptr;
  }

  /// Distances computed and cells visited so far.
  std::uint64_t work() const { return work_; }

 private:
  using Cell = std::array<std::int64_t, 3>;
  struct Query {
    Vec3 centre;
    double radius;
    double gap;
  };

  /// Returns the exponent of the smallest power of two above the diameter.
  static int cellExponent(double radius) {
    int exponent = 0;
    std::frexp(2.0 * radius, &exponent);
    return exponent;
  }

  static Cell cellOf(const Vec3& point, double size) {
    Cell cell{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      cell[axis] =
          static_cast<std::int64_t>(std::floor(point[static_cast<Eigen::Index>(axis)] / size));
    }
    return cell;
  }

  /// Hashes a cell. A collision of two cells only costs time.
  static std::uint64_t hash(int exponent, const Cell& cell) {
    auto bits = static_cast<std::uint64_t>(static_cast<std::int64_t>(exponent));
    for (const std::int64_t coordinate : cell) {
      bits = (bits ^ static_cast<std::uint64_t>(coordinate)) * 0x9e3779b97f4a7c15U;
      bits ^= bits >> 29U;
    }
    return bits;
  }

  const Ball* nearestInLevel(const Query& query, int exponent,
                             const std::vector<std::size_t>& members) {
    const double size = std::ldexp(1.0, exponent);
    const double reach = (query.radius + 0.5 * size + std::max(query.gap, 0.0)) * (1.0 + 1e-6);
    const Cell low = cellOf(query.centre - Vec3::Constant(reach), size);
    const Cell high = cellOf(query.centre + Vec3::Constant(reach), size);
    double cells = 1.0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      cells *= static_cast<double>(high[axis] - low[axis] + 1);
    }
    if (cells > static_cast<double>(members.size())) return firstNear(query, members);
    return firstNearInCells(query, exponent, low, high);
  }

  const Ball* firstNearInCells(const Query& query, int exponent, const Cell& low,
                               const Cell& high) {
    for (std::int64_t x = low[0]; x <= high[0]; ++x) {
      for (std::int64_t y = low[1]; y <= high[1]; ++y) {
        for (std::int64_t z = low[2]; z <= high[2]; ++z) {
          ++work_;
          const auto cell = cells_.find(hash(exponent, {x, y, z}));
          if (cell == cells_.end()) continue;
          const Ball* found = firstNear(query, cell->second);
          if (found != nullptr) return found;
        }
      }
    }
    return nullptr;
  }

  const Ball* firstNear(const Query& query, const std::vector<std::size_t>& candidates) {
    for (const std::size_t candidate : candidates) {
      ++work_;
      const Ball& ball = balls_[candidate];
      const double nearest = ball.radius + query.radius + query.gap;
      if ((ball.centre - query.centre).squaredNorm() < nearest * nearest) return &ball;
    }
    return nullptr;
  }

  std::vector<Ball> balls_;
  std::map<int, std::vector<std::size_t>> levels_;
  std::unordered_map<std::uint64_t, std::vector<std::size_t>> cells_;
  std::uint64_t work_ = 0;
};

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

/// A group of spheres whose positions are still to be found.
struct PendingGroup {
  std::size_t firstBody = 0;
  std::size_t count = 0;
  Vec3 min = Vec3::Zero();  // m, lower corner of the box that the spheres lie in
  Vec3 max = Vec3::Zero();  // m, upper corner
  JsonNode node;
  GroupRandom random;
};

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
  SceneReader(FirstError& error, std::filesystem::path folder)
      : error_(error), folder_(std::move(folder)), solids_(folder_) {}

  Scene read(const JsonNode& root, std::string_view defaultName);

 private:
  /// The properties of a body's surface: its material, the material's index in the restitutions,
  /// its contact properties and its normal map.
  struct SurfaceMaterial {
    Material material;
    SurfaceId surface = 0;
    ContactTraits contact = {};
    std::optional<NormalMapFile> normalMap = std::nullopt;

    SceneBody body(std::string name) &&;
  };
  /// The origin of a plane: its entry in the file, and the kind of its material.
  struct PlaneOrigin {
    std::string entry;       // name of the plane itself, or of its box
    bool isBuiltIn = false;  // its material is a built-in one, given by name
  };

  void readAir(const JsonNode& air);
  void readStepper(const JsonNode& stepper);
  void readMaterials(const JsonNode& materials);
  SurfaceMaterial readMaterialObject(const JsonNode& node, std::string name);
  SurfaceMaterial namedMaterial(const JsonNode& node);
  SurfaceMaterial covering(const JsonNode& node, const std::string& inlineName);
  SurfaceMaterial coveringOf(const JsonNode& entry, const std::string& name);
  std::vector<std::string_view> knownMaterials() const;
  bool checkKnown(const JsonNode& node, const std::string& name, const std::string& otherwise);
  void readRestitutions(const JsonNode& restitutions);
  void readRestitution(const JsonNode& entry);
  SurfaceId surfaceOf(const std::string& material);
  SurfaceId surfaceOf(const JsonNode& material) const;

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
  std::vector<SurfaceMaterial> groupMaterials(const JsonNode& entry, const std::string& name);
  void readListeners(const JsonNode& root);
  void addListener(const JsonNode& entry, Names& names);
  std::vector<RoomPlane> roomPlanes() const;

  bool readCorners(const JsonNode& entry, Vec3& min, Vec3& max);
  bool countSpheres(const JsonNode& node, std::size_t count);
  void addPlane(const JsonNode& entry, std::string name, SurfaceMaterial covering,
                const PlaneShape& plane);
  void addBody(const JsonNode& entry, SceneBody body);

  void checkOverlaps();
  void checkJello();
  void checkWalls(std::size_t body, const SphereShape& sphere);
  void placeGroups();
  void placeGroup(PendingGroup& group);
  bool placeSphere(PendingGroup& group, std::size_t body);
  bool isFree(const Vec3& centre, double radius);
  bool isInJello(const Vec3& centre, double radius);
  double gapToWall(std::size_t body, const Vec3& centre, double radius) const;
  SphereShape& sphere(std::size_t body) { return std::get<SphereShape>(scene_.bodies[body].shape); }
  std::uint64_t placingWork() const { return grid_.work() + wallWork_; }
  bool ok() const { return !error_; }

  FirstError& error_;
  std::filesystem::path folder_;
  SolidReader solids_;
  Scene scene_;
  std::uint64_t seed_ = 0;
  std::map<std::string, SurfaceMaterial, std::less<>> ownMaterials_;  // their `surface` is not set
  std::map<std::string, SurfaceId, std::less<>> surfaces_;  // of the materials in "restitutions"
  Names bodyNames_;
  std::set<std::string> finalNames_;
  std::vector<std::string> places_;  // JSON pointers, by body
  std::vector<PendingGroup> groups_;
  std::vector<std::size_t> fixedSpheres_;
  std::vector<std::size_t> planes_;   // indices of bodies
  std::vector<PlaneOrigin> origins_;  // by index in planes_
  std::vector<std::size_t> walls_;    // indices of bodies: planes and blocks
  SphereGrid grid_;
  std::size_t sphereCount_ = 0;
  std::size_t blockCount_ = 0;
  std::size_t solidCount_ = 0;
  bool anySolidMoves_ = false;
  std::shared_ptr<const JelloShape> jello_;
  std::optional<JelloSkin> skin_;                  // the surface of the jello
  std::array<std::vector<double>, 3> skinPlaces_;  // m, coordinates of the jello's points, by axis
  Eigen::AlignedBox3d skinBox_;                    // m, bounding box of these points
  std::uint64_t wallWork_ = 0;
};

Scene SceneReader::read(const JsonNode& root, std::string_view defaultName) {
  if (!root.expectObject("a scene", {"$schema", "name", "description", "duration", "sample_rate",
                                     "seed", "gravity", "air", "stepper", "mechanics", "sound",
                                     "materials", "restitutions", "bodies", "room", "listeners"})) {
    return {};
  }
  root.text("$schema", kSchemaAddress, "");
  scene_.name = root.text("name", kName, defaultName);
  scene_.description = root.text("description", kDescription, "");
  scene_.duration = root.number("duration", kDuration);
  scene_.sampleRate = root.number("sample_rate", kSampleRate, scene_.sampleRate);
  seed_ = static_cast<std::uint64_t>(root.number("seed", kSeed, 0.0));
  scene_.gravity = root.vector("gravity", kGravity, scene_.gravity);
  if (const auto air = root.find("air")) readAir(*air);
  if (const auto stepper = root.find("stepper")) readStepper(*stepper);
  if (const auto sound = root.find("sound")) readSound(*sound, scene_.sound);
  if (const auto materials = root.find("materials")) readMaterials(*materials);
  if (const auto restitutions = root.find("restitutions"); restitutions && ok())
    readRestitutions(*restitutions);
  if (ok()) readBodies(root);
  if (const auto room = root.find("room"); room && ok())
    readRoom(*room, roomPlanes(), scene_.medium.speedOfSound, scene_.sound);
  if (ok()) readListeners(root);
  if (ok()) checkOverlaps();
  if (ok()) placeGroups();
  if (const auto mechanics = root.find("mechanics"); mechanics && ok())
    readMechanics(*mechanics, scene_);
  return std::move(scene_);
}

void SceneReader::readAir(const JsonNode& air) {
  if (!air.expectObject("a description of the air", {"density", "speed_of_sound"})) return;
  Medium& medium = scene_.medium;
  medium.density = air.number("density", kAirDensity, medium.density);
  medium.speedOfSound = air.number("speed_of_sound", kSpeedOfSound, medium.speedOfSound);
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

void SceneReader::readMaterials(const JsonNode& materials) {
  if (!materials.isObject()) {
    materials.failAs("a set of materials", "an object of named materials");
    return;
  }
  const auto members = materials.members();
  if (members.size() > kMaxMaterials) {
    materials.fail("too many materials; expected at most " + std::to_string(kMaxMaterials));
  }
  for (const auto& [name, node] : members) {
    if (!ok()) return;
    if (!kName.contains(name)) {
      node.fail("the key is not a name; expected " + kName.describe());
    } else if (findMaterial(name) != nullptr) {
      node.fail(inQuotes(name) + " is a built-in material; expected another name");
    } else {
      ownMaterials_.emplace(name, readMaterialObject(node, name));
    }
  }
}

SceneReader::SurfaceMaterial SceneReader::readMaterialObject(const JsonNode& node,
                                                             std::string name) {
  if (!node.expectObject("a material",
                         {"density", "youngs_modulus", "poissons_ratio", "restitution",
                          "restitution_law", "restitution_speed", "friction", "rolling_friction",
                          "pivoting_friction", "damping_alpha", "damping_beta", "roughness"})) {
    return {};
  }
  return {.material = {.name = std::move(name),
                       .density = node.number("density", kDensity),
                       .youngsModulus = node.number("youngs_modulus", kYoungsModulus),
                       .poissonsRatio = node.number("poissons_ratio", kPoissonsRatio),
                       .restitution = node.number("restitution", kRestitution),
                       .dampingAlpha = node.number("damping_alpha", kDampingAlpha, 0.0),
                       .dampingBeta = node.number("damping_beta", kDampingBeta, 0.0),
                       .roughness = readRoughness(node, {})},
          .contact = readContactTraits(node)};
}

SceneReader::SurfaceMaterial SceneReader::covering(const JsonNode& node,
                                                   const std::string& inlineName) {
  if (node.isObject()) return readMaterialObject(node, inlineName);
  if (!node.isString()) {
    node.failAs("a material", "the name of one, or an object with its properties");
    return {};
  }
  SurfaceMaterial covering = namedMaterial(node);
  covering.surface = surfaceOf(node);
  return covering;
}

/// Reads the material of a body, with the roughness and the normal map of the body itself.
SceneReader::SurfaceMaterial SceneReader::coveringOf(const JsonNode& entry,
                                                     const std::string& name) {
  const auto node = entry.require("material", "a material");
  if (!node || !ok()) return {};
  SurfaceMaterial made = covering(*node, name);
  made.material.roughness = readRoughness(entry, made.material.roughness);
  made.normalMap = readNormalMapEntry(entry, folder_);
  return made;
}

/// Makes a body that has no shape yet.
SceneBody SceneReader::SurfaceMaterial::body(std::string name) && {
  SceneBody made;
  made.name = std::move(name);
  made.material = std::move(material);
  made.surface = surface;
  made.contact = contact;
  made.normalMap = std::move(normalMap);
  return made;
}

SceneReader::SurfaceMaterial SceneReader::namedMaterial(const JsonNode& node) {
  const std::string name = node.text(kName);
  if (!ok()) return {};
  if (const Material* builtIn = findMaterial(name)) return {.material = *builtIn};
  if (const auto own = ownMaterials_.find(name); own != ownMaterials_.end()) return own->second;
  checkKnown(node, name, ", or an object with its properties");
  return {};
}

bool SceneReader::checkKnown(const JsonNode& node, const std::string& name,
                             const std::string& otherwise) {
  if (findMaterial(name) != nullptr || ownMaterials_.contains(name)) return true;
  const std::vector<std::string_view> known = knownMaterials();
  node.fail("unknown material " + inQuotes(name) + suggestion(name, known) + "; expected one of " +
            quotedList(known) + otherwise);
  return false;
}

void SceneReader::readRestitutions(const JsonNode& restitutions) {
  const auto entries = restitutions.elements("a list of restitutions", 0, kMaxRestitutions);
  for (const JsonNode& entry : entries) {
    if (!ok()) return;
    readRestitution(entry);
  }
}

void SceneReader::readRestitution(const JsonNode& entry) {
  if (!entry.expectObject("a restitution of two materials", {"materials", "restitution"})) return;
  const auto materials = entry.require("materials", "an array of two names of materials");
  const double restitution = entry.number("restitution", kRestitution);
  if (!materials || !ok()) return;
  std::array<std::string, 2> names;
  const std::vector<JsonNode> pair = materials->elements("a pair of materials", 2, 2);
  for (std::size_t side = 0; side < pair.size(); ++side) {
    names.at(side) = pair[side].text(kMaterialName);
    if (!ok() || !checkKnown(pair[side], names.at(side), "")) return;
  }
  if (!ok()) return;
  const SurfaceId surface = surfaceOf(names[0]);
  if (!scene_.restitutions.set(surface, surfaceOf(names[1]), restitution)) {
    materials->fail(inQuotes(names[0]) + " and " + inQuotes(names[1]) +
                    " have a restitution already; expected each pair once, in either order");
  }
}

/// Returns the surface of a material in "restitutions",
/// which gets a new one at its first appearance.
SurfaceId SceneReader::surfaceOf(const std::string& material) {
  return surfaces_.try_emplace(material, static_cast<SurfaceId>(surfaces_.size() + 1))
      .first->second;
}

/// Returns the surface of a body's material: 0 if the
/// material has no name or is not in "restitutions".
SurfaceId SceneReader::surfaceOf(const JsonNode& material) const {
  if (!material.isString()) return 0;
  const auto place = surfaces_.find(material.text(kName));
  return place == surfaces_.end() ? 0 : place->second;
}

std::vector<std::string_view> SceneReader::knownMaterials() const {
  std::vector<std::string_view> known;
  for (const auto& [name, own] : ownMaterials_)  // before built-in ones: messages do not list all
    known.emplace_back(name);
  for (const Material& builtIn : builtInMaterials())
    known.emplace_back(builtIn.name);
  return known;
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
  if (ok() && sphereCount_ == 0 && !anySolidMoves_ && jello_ == nullptr) {
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
  if (!entry.expectObject("a sphere", {"type", "name", "radius", "material", "position", "velocity",
                                       "spin", "mass", "modes", "roughness", "normal_map"})) {
    return;
  }
  if (!countSpheres(entry, 1)) return;
  const std::string name = entryName(entry, "sphere", bodyNames_);
  SphereShape sphere;
  sphere.radius = entry.number("radius", kRadius);
  SceneBody body = coveringOf(entry, name).body(name);
  sphere.position = entry.vector("position", kPlace);
  sphere.velocity = entry.vector("velocity", kVelocity, Vec3::Zero());
  sphere.spin = readSpin(entry);
  sphere.mass = entry.number("mass", kMass, sphereMass(body.material.density, sphere.radius));
  body.shape = sphere;
  body.ringing = readRinging(entry, folder_);
  fixedSpheres_.push_back(scene_.bodies.size());
  addBody(entry, std::move(body));
}

void SceneReader::readPlane(const JsonNode& entry) {
  if (!entry.expectObject("a plane", {"type", "name", "normal", "point", "offset", "material",
                                      "velocity", "oscillation", "roughness", "normal_map"})) {
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
  SurfaceMaterial made = coveringOf(entry, name);
  if (!ok()) return;
  PlaneShape plane;
  plane.normal = (direction / largest).normalized();  // the first division avoids underflow
  plane.offset = point ? plane.normal.dot(point->vector(kPlace)) : offset->number(kPlace);
  readMotion(entry, plane);
  addPlane(entry, name, std::move(made), plane);
}

void SceneReader::readBox(const JsonNode& entry) {
  if (!entry.expectObject("a box",
                          {"type", "name", "min", "max", "material", "roughness", "normal_map"}))
    return;
  const std::string name = entryName(entry, "box", bodyNames_);
  Vec3 min = Vec3::Zero();
  Vec3 max = Vec3::Zero();
  if (!readCorners(entry, min, max)) return;
  const SurfaceMaterial wall = coveringOf(entry, name);
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
                                      "velocity", "roughness", "normal_map"})) {
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
  SurfaceMaterial made = coveringOf(entry, name);
  if (!ok()) return;
  if (++blockCount_ > SceneLimits::kBlocks) {
    entry.fail("the scene has more than " + std::to_string(SceneLimits::kBlocks) +
               " blocks; expected at most that many");
  }
  walls_.push_back(scene_.bodies.size());
  SceneBody body = std::move(made).body(name);
  body.shape = block;
  addBody(entry, std::move(body));
}

void SceneReader::readSolid(const JsonNode& entry) {
  if (!SolidReader::expectSolid(entry)) return;
  const std::string name = entryName(entry, "solid", bodyNames_);
  SurfaceMaterial made = coveringOf(entry, name);
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
  if (jello_ != nullptr) {
    entry.fail("the scene has a jello already; expected one");
    return;
  }
  jello_ = jello;
  skin_.emplace(jello->lattice.count);
  for (Eigen::Index axis = 0; axis < 3; ++axis)
    for (const Vec3& point : jello->positions)
      skinPlaces_[static_cast<std::size_t>(axis)].push_back(point[axis]);
  for (const Vec3& point : jello->positions)
    skinBox_.extend(point);
  SceneBody body;
  body.name = name;
  body.material = jelloMaterial(jello->lattice);
  body.shape = std::move(jello);
  addBody(entry, std::move(body));
}

void SceneReader::readGroup(const JsonNode& entry) {
  if (!entry.expectObject("a group of spheres",
                          {"type", "name", "count", "radius", "material", "min", "max", "speed"})) {
    return;
  }
  const std::string name = entryName(entry, "spheres", bodyNames_);
  const auto count = static_cast<std::size_t>(entry.number("count", kCount));
  const auto radius = entry.require("radius", kRadius.describe() + ", or [min, max] of such");
  const Interval radii = radius ? radius->interval(kRadius) : Interval{};
  const std::vector<SurfaceMaterial> materials = groupMaterials(entry, name);
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
    sphere.velocity = group.random.within(speeds) * group.random.direction();
    addBody(entry, {name + '.' + std::to_string(member + 1), picked.material, sphere,
                    picked.surface, picked.contact});
  }
  groups_.push_back(std::move(group));
}

std::vector<SceneReader::SurfaceMaterial> SceneReader::groupMaterials(const JsonNode& entry,
                                                                      const std::string& name) {
  std::vector<SurfaceMaterial> materials;
  const auto node = entry.require("material", "a material, or an array of materials");
  if (!node) return materials;
  if (!node->isArray()) return {covering(*node, name)};
  const auto choices = node->elements("a choice of materials", 1, kMaxMaterials);
  for (const JsonNode& choice : choices) {
    const std::string own = name + ".material" + std::to_string(materials.size() + 1);
    materials.push_back(covering(choice, own));
  }
  return materials;
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
                      .surface = origin.isBuiltIn ? defaultSurface(body.material.name) : nullptr,
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

void SceneReader::addPlane(const JsonNode& entry, std::string name, SurfaceMaterial covering,
                           const PlaneShape& plane) {
  planes_.push_back(scene_.bodies.size());
  walls_.push_back(scene_.bodies.size());
  const auto material = entry.find("material");
  const bool isNamed =
      material && material->isString() && findMaterial(covering.material.name) != nullptr;
  // The walls of a box are named BOX.left, and so on.
  const bool isWall = entry.find("min").has_value();
  origins_.push_back({isWall ? name.substr(0, name.rfind('.')) : name, isNamed});
  if (planes_.size() > SceneLimits::kPlanes) {
    entry.fail("the scene has more than " + std::to_string(SceneLimits::kPlanes) +
               " planes; expected at most that many, six for each box");
  }
  SceneBody body = std::move(covering).body(std::move(name));
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
  places_.push_back(entry.pointer());
  scene_.bodies.push_back(std::move(body));
}

/// Refuses spheres that overlap at the start. The larger ones come first, so that a query never
/// meets smaller ones (see SphereGrid); none in the grid overlap, so that its cells hold few.
void SceneReader::checkOverlaps() {
  checkJello();
  std::stable_sort(fixedSpheres_.begin(), fixedSpheres_.end(),
                   [this](std::size_t body, std::size_t next) {
                     return sphere(body).radius > sphere(next).radius;
                   });
  for (const std::size_t body : fixedSpheres_) {
    const SphereShape& shape = sphere(body);
    checkWalls(body, shape);
    if (isInJello(shape.position, (1.0 - kOverlapTolerance) * shape.radius))
      error_.record(places_[body], inQuotes(scene_.bodies[body].name) +
                                       " reaches into the jello at the start; expected it outside");
    const double allowed = -kOverlapTolerance * shape.radius;
    const auto* hit = grid_.nearerThan(allowed, shape.position, shape.radius);
    if (hit != nullptr) {
      const auto [first, last] = std::minmax(hit->body, body);
      const double depth = hit->radius + shape.radius - (hit->centre - shape.position).norm();
      error_.record(places_[last], inQuotes(scene_.bodies[last].name) + " overlaps " +
                                       inQuotes(scene_.bodies[first].name) + " by " +
                                       formatNumber(depth) +
                                       " metres at the start; expected spheres that touch at most");
    }
    if (!ok()) return;
    grid_.insert({shape.position, shape.radius, body});
  }
}

/// Refuses a jello that reaches into a wall, which would throw the points beyond it out.
void SceneReader::checkJello() {
  if (jello_ == nullptr) return;
  const double allowed = kOverlapTolerance * jello_->lattice.size.maxCoeff();
  for (const std::size_t wall : planes_) {
    double least = std::numeric_limits<double>::infinity();
    for (const Vec3& point : jello_->positions)
      least = std::min(least, gapToWall(wall, point, 0.0));
    if (least >= -allowed) continue;
    const auto body = std::ranges::find_if(scene_.bodies, [](const SceneBody& candidate) {
      return std::holds_alternative<std::shared_ptr<const JelloShape>>(candidate.shape);
    });
    error_.record(places_[static_cast<std::size_t>(body - scene_.bodies.begin())],
                  inQuotes(body->name) + " reaches " + formatNumber(-least) + " metres into " +
                      inQuotes(scene_.bodies[wall].name) +
                      " at the start; expected it on the side the normal points to");
    return;
  }
}

void SceneReader::checkWalls(std::size_t body, const SphereShape& sphere) {
  for (const std::size_t wall : walls_) {
    const double gap = gapToWall(wall, sphere.position, sphere.radius);
    if (gap >= -kOverlapTolerance * sphere.radius) continue;
    const bool isPlane = std::holds_alternative<PlaneShape>(scene_.bodies[wall].shape);
    std::string fault = inQuotes(scene_.bodies[body].name);
    fault += std::isinf(gap) ? " has its centre inside "
                             : " reaches " + formatNumber(-gap) + " metres into ";
    fault += inQuotes(scene_.bodies[wall].name);
    error_.record(places_[body], fault + " at the start; expected it " +
                                     (isPlane ? "on the side the normal points to" : "outside"));
    return;
  }
}

void SceneReader::placeGroups() {
  for (PendingGroup& group : groups_) {
    if (ok()) placeGroup(group);
  }
}

/// Places the spheres of a group by random sequential placement, the larger ones first because they
/// find room less easily.
void SceneReader::placeGroup(PendingGroup& group) {
  std::vector<std::size_t> order(group.count);
  std::iota(order.begin(), order.end(), group.firstBody);
  std::stable_sort(order.begin(), order.end(), [this](std::size_t body, std::size_t next) {
    return sphere(body).radius > sphere(next).radius;
  });
  for (std::size_t placed = 0; placed < order.size(); ++placed) {
    if (placeSphere(group, order[placed])) continue;
    const std::string effort = placingWork() > kMaxPlacingWork
                                   ? "before the work on all groups grew too large"
                                   : "in " + std::to_string(kTriesPerSphere) + " tries each";
    group.node.fail("only " + std::to_string(placed) + " of " + std::to_string(group.count) +
                    " spheres found a free place between min and max " + effort +
                    "; expected fewer or smaller spheres, or more room");
    return;
  }
}

bool SceneReader::placeSphere(PendingGroup& group, std::size_t body) {
  SphereShape& shape = sphere(body);
  const Vec3 margin = Vec3::Constant(shape.radius * (1.0 + kPlacingClearance));
  const Vec3 low = group.min + margin;
  const Vec3 high = group.max - margin;
  if ((low.array() > high.array()).any()) return false;
  for (int attempt = 0; attempt < kTriesPerSphere; ++attempt) {
    if (placingWork() > kMaxPlacingWork) return false;
    Vec3 centre = Vec3::Zero();
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      centre[axis] = group.random.within({low[axis], high[axis]});
    }
    if (!isFree(centre, shape.radius)) continue;
    shape.position = centre;
    grid_.insert({centre, shape.radius, body});
    return true;
  }
  return false;
}

double SceneReader::gapToWall(std::size_t body, const Vec3& centre, double radius) const {
  const SceneBody& wall = scene_.bodies[body];
  if (const auto* plane = std::get_if<PlaneShape>(&wall.shape))
    return gapAtStart(*plane, centre, radius);
  return gapAtStart(std::get<BlockShape>(wall.shape), centre, radius);
}

bool SceneReader::isFree(const Vec3& centre, double radius) {
  const double clearance = kPlacingClearance * radius;
  for (const std::size_t wall : walls_) {
    ++wallWork_;
    if (gapToWall(wall, centre, radius) < clearance) return false;
  }
  if (isInJello(centre, radius + clearance)) return false;
  return grid_.nearerThan(clearance, centre, radius) == nullptr;
}

bool SceneReader::isInJello(const Vec3& centre, double radius) {
  if (!skin_ || skinBox_.squaredExteriorDistance(centre) > radius * radius) return false;
  wallWork_ += skin_->squares().size();
  const auto& [x, y, z] = skinPlaces_;
  return skin_->meet({x.data(), y.data(), z.data()}, centre, radius).has_value();
}

// ---------------------------------------------------------------------------------------------

/// Reads the file, but at most a little more than SceneLimits::kFileSize,
/// so that parseScene refuses it if it is larger. Returns nullopt with an
/// error if it is no regular file or unreadable.
std::optional<std::string> readText(const std::filesystem::path& file, FirstError& error) {
  std::error_code code;
  const auto status = std::filesystem::status(file, code);
  if (!std::filesystem::exists(status)) {
    error.record({}, "no such file; expected a scene file");
  } else if (!std::filesystem::is_regular_file(status)) {
    error.record({}, std::string(std::filesystem::is_directory(status) ? "a directory"
                                                                       : "not a regular file") +
                         "; expected a scene file");
  }
  if (error) return std::nullopt;
  std::ifstream stream(file, std::ios::binary);
  if (!stream) {
    error.record({}, "the file cannot be opened; expected one that may be read");
    return std::nullopt;
  }
  std::string text;
  std::array<char, 65536> buffer{};
  while (stream && text.size() <= SceneLimits::kFileSize) {
    stream.read(buffer.data(), static_cast<std::streamsize>(buffer.size()));
    text.append(buffer.data(), static_cast<std::size_t>(stream.gcount()));
  }
  if (stream.bad()) error.record({}, "the file cannot be read to its end");
  if (error) return std::nullopt;
  return text;
}

/// Returns the stem of the file's name if that is valid as the name of a scene, else "scene".
std::string defaultSceneName(std::string_view document) {
  std::string stem = std::filesystem::path(document).stem().string();
  return kName.contains(stem) ? stem : "scene";
}

}  // namespace

Result<std::string> readSceneText(const std::filesystem::path& file) {
  FirstError error(file.string());
  std::optional<std::string> text = readText(file, error);
  if (!text) return error.error();
  return *std::move(text);
}

Result<Scene> loadScene(const std::filesystem::path& file) {
  const Result<std::string> text = readSceneText(file);
  if (!text) return text.error();
  return parseScene(*text, file.string());
}

Result<Scene> parseScene(std::string_view text, std::string_view name) {
  FirstError error(name);
  if (text.size() > SceneLimits::kFileSize) {
    error.record({}, "larger than " + std::to_string(SceneLimits::kFileSize >> 20U) +
                         " MiB; expected a scene of at most that size");
    return error.error();
  }
  const std::optional<nlohmann::json> document = parseJson(text, error);
  if (!document) return error.error();
  SceneReader reader(error, std::filesystem::path(name).parent_path());
  Scene scene = reader.read(JsonNode(*document, "", error), defaultSceneName(name));
  if (error) return error.error();
  return scene;
}

}  // namespace carom::scenes
