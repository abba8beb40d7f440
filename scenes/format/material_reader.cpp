#include "scenes/format/material_reader.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <iterator>

#include <nlohmann/json.hpp>

#include "audio/io/byte_file.h"
#include "scenes/format/dry_friction.h"
#include "scenes/format/mechanics_reader.h"
#include "scenes/format/surface_reader.h"
#include "scenes/values/scene_ranges.h"

namespace carom::scenes {

using namespace modal;

namespace {

// scene.schema.json and docs/scenes.md repeat these; a test compares the schema.

constexpr NumberRange kDensity{.noun = "a density", .min = 1e-3, .max = 1e5, .unit = "kg/m^3"};
constexpr NumberRange kYoungsModulus{
    .noun = "a Young's modulus", .min = 1.0, .max = 1e13, .unit = "pascals"};
constexpr NumberRange kPoissonsRatio{
    .noun = "a Poisson's ratio", .min = 0.0, .max = 0.5, .belowMax = true};
constexpr NumberRange kRestitution{.noun = "a restitution", .min = 0.0, .max = 1.0};
constexpr NumberRange kDampingAlpha{
    .noun = "a damping in proportion to mass", .min = 0.0, .max = 1e6, .unit = "1/s"};
constexpr NumberRange kLossFactor{.noun = "a loss factor", .min = 0.0, .max = 2.0};
constexpr NumberRange kLossExponent{.noun = "an exponent", .min = -2.0, .max = 2.0};
constexpr NumberRange kExpansion{.noun = "a thermal expansion (1/K)", .min = 0.0, .max = 0.01};
constexpr NumberRange kConductivity{
    .noun = "a thermal conductivity (W/(m K))", .min = 0.0, .max = 1e5};
constexpr NumberRange kHeatCapacity{.noun = "a heat capacity (J/(kg K))", .min = 0.0, .max = 1e5};
constexpr NumberRange kDampingBeta{
    .noun = "a damping in proportion to stiffness", .min = 0.0, .max = 1.0, .unit = "s"};

constexpr TextRange kMaterialName{
    .noun = "the name of a material", .minLength = 1, .maxLength = 100};

constexpr std::size_t kMaxMaterials = 1000;
constexpr std::size_t kMaxRestitutions = 1000;
constexpr std::size_t kLongestCircle = 400;  // characters in a message

}  // namespace

SceneBody SurfaceMaterial::body(std::string name) && {
  SceneBody made;
  made.name = std::move(name);
  made.material = std::move(material);
  made.surface = surface;
  made.contact = contact;
  made.normalMap = std::move(normalMap);
  return made;
}

void MaterialReader::readMaterials(const JsonNode& materials) {
  if (!materials.isObject()) {
    materials.failAs("a set of materials", "an object of named materials");
    return;
  }
  const auto members = materials.members();
  if (members.size() > kMaxMaterials) {
    materials.fail("too many materials; expected at most " + std::to_string(kMaxMaterials));
  }
  for (const auto& [name, node] : members) {
    if (node.failed()) return;
    if (!kName.contains(name)) {
      node.fail("the key is not a name; expected " + kName.describe());
    } else if (findMaterial(name) != nullptr) {
      node.fail(inQuotes(name) + " is a built-in material; expected another name");
    } else {
      ownNodes_.emplace(name, node);
    }
  }
  for (const auto& [name, node] : ownNodes_) {
    if (node.failed()) return;
    readOwnMaterial(name);
  }
}

/// Reads an own material after the one that it is like.
void MaterialReader::readOwnMaterial(const std::string& name) {
  if (ownMaterials_.contains(name)) return;
  const JsonNode& node = ownNodes_.at(name);
  chain_.push_back(name);
  if (const auto like = node.find("like"); like && like->isString()) {
    const std::string base = like->text(kName);
    if (ownNodes_.contains(base) && checkEnds(*like, base)) readOwnMaterial(base);
  }
  chain_.pop_back();
  if (!node.failed()) ownMaterials_.emplace(name, readMaterialObject(node, name));
}

/// Refuses materials that are like each other in a circle: `base`, which the last of the chain is
/// like, must not be in it.
bool MaterialReader::checkEnds(const JsonNode& like, const std::string& base) const {
  const auto first = std::ranges::find(chain_, base);
  if (first == chain_.end()) return true;
  std::string circle = inQuotes(base);
  for (auto name = std::next(first); name != chain_.end(); ++name)
    circle += " is like " + inQuotes(*name) + ", which";
  if (circle.size() > kLongestCircle) circle = inQuotes(base) + " over others";
  like.fail(circle + " is like " + inQuotes(base) +
            "; expected materials that lead to one with properties of its own");
  return false;
}

SurfaceMaterial MaterialReader::readMaterialObject(const JsonNode& node, std::string name) const {
  if (!node.expectObject(
          "a material",
          {"like", "density", "youngs_modulus", "poissons_ratio", "restitution", "restitution_law",
           "restitution_speed", "friction", "rolling_friction", "pivoting_friction",
           "damping_alpha", "damping_beta", "loss_factor", "loss_exponent", "thermal_expansion",
           "thermal_conductivity", "heat_capacity", "roughness"})) {
    return {};
  }
  const auto like = node.find("like");
  SurfaceMaterial made = like ? namedMaterial(*like, "") : SurfaceMaterial{};
  Material& material = made.material;
  const auto read = [&node, &like](std::string_view key, const NumberRange& range, double& value) {
    value = like ? node.number(key, range, value) : node.number(key, range);
  };
  material.name = std::move(name);
  read("density", kDensity, material.density);
  read("youngs_modulus", kYoungsModulus, material.youngsModulus);
  read("poissons_ratio", kPoissonsRatio, material.poissonsRatio);
  read("restitution", kRestitution, material.restitution);
  material.dampingAlpha = node.number("damping_alpha", kDampingAlpha, material.dampingAlpha);
  material.dampingBeta = node.number("damping_beta", kDampingBeta, material.dampingBeta);
  material.lossFactor = node.number("loss_factor", kLossFactor, material.lossFactor);
  material.lossExponent = node.number("loss_exponent", kLossExponent, material.lossExponent);
  ThermalProperties& thermal = material.thermal;
  thermal.expansion = node.number("thermal_expansion", kExpansion, thermal.expansion);
  thermal.conductivity = node.number("thermal_conductivity", kConductivity, thermal.conductivity);
  thermal.heatCapacity = node.number("heat_capacity", kHeatCapacity, thermal.heatCapacity);
  material.roughness = readRoughness(node, material.roughness);
  made.contact = readContactTraits(node, made.contact);
  return made;
}

void MaterialReader::readRestitutions(const JsonNode& restitutions, RestitutionTable& table) {
  const auto entries = restitutions.elements("a list of restitutions", 0, kMaxRestitutions);
  for (const JsonNode& entry : entries) {
    if (entry.failed()) return;
    readRestitution(entry, table);
  }
}

void MaterialReader::readRestitution(const JsonNode& entry, RestitutionTable& table) {
  if (!entry.expectObject("a restitution of two materials", {"materials", "restitution"})) return;
  const auto materials = entry.require("materials", "an array of two names of materials");
  const double restitution = entry.number("restitution", kRestitution);
  if (!materials || entry.failed()) return;
  std::array<std::string, 2> names;
  const std::vector<JsonNode> pair = materials->elements("a pair of materials", 2, 2);
  for (std::size_t side = 0; side < pair.size(); ++side) {
    names.at(side) = pair[side].text(kMaterialName);
    if (entry.failed() || !checkKnown(pair[side], names.at(side), "")) return;
  }
  if (entry.failed()) return;
  const SurfaceId surface = assignSurface(names[0]);
  if (!table.set(surface, assignSurface(names[1]), restitution)) {
    materials->fail(inQuotes(names[0]) + " and " + inQuotes(names[1]) +
                    " have a restitution already; expected each pair once, in either order");
  }
}

SurfaceMaterial MaterialReader::readBodyMaterial(const JsonNode& entry,
                                                 const std::string& name) const {
  const auto node = entry.require("material", "a material");
  if (!node || entry.failed()) return {};
  SurfaceMaterial made = readMaterial(*node, name);
  made.material.roughness = readRoughness(entry, made.material.roughness);
  made.contact = readFriction(entry, made.contact);
  made.normalMap = readNormalMapEntry(entry, folder_);
  return made;
}

std::vector<SurfaceMaterial> MaterialReader::readGroupMaterials(const JsonNode& entry,
                                                                const std::string& name) const {
  std::vector<SurfaceMaterial> materials;
  const auto node = entry.require("material", "a material, or an array of materials");
  if (!node) return materials;
  if (!node->isArray()) materials = {readMaterial(*node, name)};
  if (node->isArray()) {
    for (const JsonNode& choice : node->elements("a choice of materials", 1, kMaxMaterials)) {
      const std::string own = name + ".material" + std::to_string(materials.size() + 1);
      materials.push_back(readMaterial(choice, own));
    }
  }
  for (SurfaceMaterial& made : materials)
    made.contact = readFriction(entry, made.contact);
  return materials;
}

/// Reads a material that is given by its name or as an object.
SurfaceMaterial MaterialReader::readMaterial(const JsonNode& node,
                                             const std::string& inlineName) const {
  if (node.isObject()) return readMaterialObject(node, inlineName);
  if (!node.isString()) {
    node.failAs("a material", "the name of one, or an object with its properties");
    return {};
  }
  SurfaceMaterial made = namedMaterial(node, ", or an object with its properties");
  made.surface = findSurface(node);
  return made;
}

SurfaceMaterial MaterialReader::namedMaterial(const JsonNode& node,
                                              const std::string& otherwise) const {
  const std::string name = node.text(kName);
  if (node.failed()) return {};
  if (const Material* builtIn = findMaterial(name))
    return {
        .material = *builtIn, .contact = {.defaultFriction = dryFriction(name)}, .builtIn = name};
  if (const auto own = ownMaterials_.find(name); own != ownMaterials_.end()) return own->second;
  checkKnown(node, name, otherwise);
  return {};
}

bool MaterialReader::checkKnown(const JsonNode& node, const std::string& name,
                                const std::string& otherwise) const {
  if (findMaterial(name) != nullptr || ownNodes_.contains(name)) return true;
  const std::vector<std::string_view> known = knownMaterials();
  node.fail("unknown material " + inQuotes(name) + suggestion(name, known) + "; expected one of " +
            quotedList(known) + otherwise);
  return false;
}

std::vector<std::string_view> MaterialReader::knownMaterials() const {
  std::vector<std::string_view> known;
  for (const auto& [name, own] : ownNodes_)  // before built-in ones: messages do not list all
    known.emplace_back(name);
  for (const Material& builtIn : builtInMaterials())
    known.emplace_back(builtIn.name);
  return known;
}

/// Returns the surface of a material in "restitutions", which gets a new one at its first
/// appearance.
SurfaceId MaterialReader::assignSurface(const std::string& material) {
  return surfaces_.try_emplace(material, static_cast<SurfaceId>(surfaces_.size() + 1))
      .first->second;
}

/// Returns the surface of a body's material: 0 if the material has no name or is not in
/// "restitutions".
SurfaceId MaterialReader::findSurface(const JsonNode& material) const {
  if (!material.isString()) return 0;
  const auto place = surfaces_.find(material.text(kName));
  return place == surfaces_.end() ? 0 : place->second;
}

Result<Material> loadMaterial(const std::filesystem::path& file) {
  const Result<std::vector<std::byte>> bytes = audio::readBytes(file);
  if (!bytes)
    return Error{file.string() + ": " + bytes.error().message + " (of a material, docs/scenes.md)"};
  FirstError error(file.string());
  const auto* text = reinterpret_cast<const char*>(bytes->data());
  const auto document = parseJson({text, bytes->size()}, error);
  if (!document) return error.error();
  const std::string stem = file.stem().string();
  const SurfaceMaterial made = MaterialReader({}).readMaterialObject(
      JsonNode(*document, "", error), kName.contains(stem) ? stem : "material");
  if (error) return error.error();
  return made.material;
}

}  // namespace carom::scenes
