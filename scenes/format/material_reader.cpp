#include "scenes/format/material_reader.h"

#include <array>
#include <cstddef>

#include "scenes/format/mechanics_reader.h"
#include "scenes/format/scene_ranges.h"
#include "scenes/format/surface_reader.h"

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
constexpr NumberRange kDampingBeta{
    .noun = "a damping in proportion to stiffness", .min = 0.0, .max = 1.0, .unit = "s"};

constexpr TextRange kMaterialName{
    .noun = "the name of a material", .minLength = 1, .maxLength = 100};

constexpr std::size_t kMaxMaterials = 1000;
constexpr std::size_t kMaxRestitutions = 1000;

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
      ownMaterials_.emplace(name, readMaterialObject(node, name));
    }
  }
}

SurfaceMaterial MaterialReader::readMaterialObject(const JsonNode& node, std::string name) {
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
  made.normalMap = readNormalMapEntry(entry, folder_);
  return made;
}

std::vector<SurfaceMaterial> MaterialReader::readGroupMaterials(const JsonNode& entry,
                                                                const std::string& name) const {
  std::vector<SurfaceMaterial> materials;
  const auto node = entry.require("material", "a material, or an array of materials");
  if (!node) return materials;
  if (!node->isArray()) return {readMaterial(*node, name)};
  const auto choices = node->elements("a choice of materials", 1, kMaxMaterials);
  for (const JsonNode& choice : choices) {
    const std::string own = name + ".material" + std::to_string(materials.size() + 1);
    materials.push_back(readMaterial(choice, own));
  }
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
  SurfaceMaterial made = namedMaterial(node);
  made.surface = findSurface(node);
  return made;
}

SurfaceMaterial MaterialReader::namedMaterial(const JsonNode& node) const {
  const std::string name = node.text(kName);
  if (node.failed()) return {};
  if (const Material* builtIn = findMaterial(name)) return {.material = *builtIn};
  if (const auto own = ownMaterials_.find(name); own != ownMaterials_.end()) return own->second;
  checkKnown(node, name, ", or an object with its properties");
  return {};
}

bool MaterialReader::checkKnown(const JsonNode& node, const std::string& name,
                                const std::string& otherwise) const {
  if (findMaterial(name) != nullptr || ownMaterials_.contains(name)) return true;
  const std::vector<std::string_view> known = knownMaterials();
  node.fail("unknown material " + inQuotes(name) + suggestion(name, known) + "; expected one of " +
            quotedList(known) + otherwise);
  return false;
}

std::vector<std::string_view> MaterialReader::knownMaterials() const {
  std::vector<std::string_view> known;
  for (const auto& [name, own] : ownMaterials_)  // before built-in ones: messages do not list all
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

}  // namespace carom::scenes
