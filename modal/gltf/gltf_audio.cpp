#include "carom/modal/gltf_audio.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include "audio/io/byte_file.h"
#include "audio/model/positive.h"
#include "modal/gltf/gltf_builder.h"
#include "modal/gltf/gltf_document.h"

namespace carom {

using namespace audio;
using namespace modal;

namespace fs = std::filesystem;

namespace {

constexpr const char* kExtension = "KHR_audio_rigid_bodies";

// ---- Checks against the draft.

/// Largest error of the length of a unit quaternion in a file of floats.
constexpr double kUnit = 1e-3;

bool isFraction(double value, double lowest, double highest) {
  return value > lowest && value < highest;
}
bool allFinite(const std::vector<float>& values) {
  return std::ranges::all_of(values, [](float value) { return std::isfinite(value); });
}
bool allFinite(const std::vector<Eigen::Vector3f>& values) {
  return std::ranges::all_of(values,
                             [](const Eigen::Vector3f& value) { return value.allFinite(); });
}

Status validate(const GltfMassProperties& properties) {
  if (!isPositive(properties.mass)) return Error{"/massProperties/mass: must be positive (kg)"};
  if (!properties.centreOfMass.allFinite())
    return Error{"/massProperties/centerOfMass: must be finite"};
  if (!properties.inertiaDiagonal.allFinite() || properties.inertiaDiagonal.minCoeff() < 0.0)
    return Error{"/massProperties/inertiaDiagonal: must be at least 0 (kg m^2)"};
  if (!(std::abs(properties.inertiaOrientation.norm() - 1.0) <= kUnit))
    return Error{"/massProperties/inertiaOrientation: must be a quaternion of length 1"};
  return std::monostate{};
}

Status validateModes(const GltfModalModel& model) {
  const auto positive = [](float value) { return std::isfinite(value) && value > 0.0F; };
  const auto notNegative = [](float value) { return std::isfinite(value) && value >= 0.0F; };
  if (model.frequencies.empty()) return Error{"/frequencies: must be of one mode or more"};
  if (!std::ranges::all_of(model.frequencies, positive))
    return Error{"/frequencies: must be positive and finite (Hz)"};
  if (model.decayRates.size() != model.frequencies.size())
    return Error{"/decayRates: must be as many as frequencies"};
  if (!std::ranges::all_of(model.decayRates, notNegative))
    return Error{"/decayRates: must be at least 0 and finite (1/s)"};
  if (!model.volumes.empty() && model.volumes.size() != model.frequencies.size())
    return Error{"/extras/carom/volumes: must be as many as frequencies"};
  if (!std::ranges::all_of(model.volumes, [](double value) { return std::isfinite(value); }))
    return Error{"/extras/carom/volumes: must be finite"};
  return std::monostate{};
}

Status validatePoints(const GltfModalModel& model) {
  const std::size_t points = model.positions.size();
  if (points == 0) return Error{"/positions: must be of one point or more"};
  if (!allFinite(model.positions)) return Error{"/positions: must be finite"};
  if (model.shapes.size() != model.frequencies.size() * points)
    return Error{"/shapes: must be as many as frequencies times positions"};
  if (!allFinite(model.shapes)) return Error{"/shapes: must be finite"};
  if (model.indices.size() % 3 != 0) return Error{"/indices: must be three for each triangle"};
  const auto there = [points](std::uint32_t index) { return index < points; };
  if (!std::ranges::all_of(model.indices, there))
    return Error{"/indices: must each be less than the number of positions"};
  return std::monostate{};
}

Status validate(const GltfModalModel& model, std::size_t materials) {
  if (Status valid = validateModes(model); !valid) return valid;
  if (Status valid = validatePoints(model); !valid) return valid;
  if (model.material && *model.material >= materials)
    return Error{"/material: must be the index of an acoustic material, and there are " +
                 std::to_string(materials)};
  if (!model.massProperties) return std::monostate{};
  return validate(*model.massProperties);
}

Status validate(const GltfAcousticMaterial& material) {
  const auto notNegative = [](double value) { return std::isfinite(value) && value >= 0.0; };
  if (!isPositive(material.density.value_or(1.0)))
    return Error{"/density: must be positive (kg/m^3)"};
  if (!isPositive(material.youngsModulus.value_or(1.0)))
    return Error{"/youngsModulus: must be positive (Pa)"};
  if (!isFraction(material.poissonRatio.value_or(0.0), -1.0, 0.5))
    return Error{"/poissonRatio: must be above -1 and below 0.5"};
  if (!notNegative(material.alpha.value_or(0.0))) return Error{"/alpha: must be at least 0 (1/s)"};
  if (!notNegative(material.beta.value_or(0.0))) return Error{"/beta: must be at least 0 (s)"};
  const double restitution = material.restitution.value_or(0.0);
  if (!(restitution >= 0.0 && restitution <= 1.0))
    return Error{"/extras/carom/restitution: must be from 0 to 1"};
  return std::monostate{};
}

Status validate(const GltfAcousticSurface& surface, std::size_t materials) {
  if (!isPositive(surface.roughness)) return Error{"/roughness: must be positive (m)"};
  if (!isPositive(surface.correlationLength))
    return Error{"/correlationLength: must be positive (m)"};
  if (!(surface.spectralSlope <= 0.0) || std::isinf(surface.spectralSlope))
    return Error{"/spectralSlope: must be at most 0"};
  if (!isPositive(surface.shortWavelength.value_or(1.0)))
    return Error{"/shortWavelength: must be positive (m)"};
  if (!(surface.waviness >= 0.0) || std::isinf(surface.waviness))
    return Error{"/waviness: must be at least 0 (m)"};
  if (!isPositive(surface.wavinessLength)) return Error{"/wavinessLength: must be positive (m)"};
  if (surface.profile.size() == 1) return Error{"/profile: must be of two heights or more"};
  if (!allFinite(surface.profile)) return Error{"/profile: must be finite (m)"};
  if (!surface.profile.empty() && !isPositive(surface.sampleSpacing))
    return Error{"/sampleSpacing: must be positive (m) where there is a profile"};
  if (!std::isfinite(surface.normalScale)) return Error{"/normalTexture/scale: must be finite"};
  if (surface.material && *surface.material >= materials)
    return Error{"/material: must be the index of an acoustic material, and there are " +
                 std::to_string(materials)};
  return std::monostate{};
}

Status validate(const GltfAudioNode& node, const GltfAudio& audio) {
  if (node.modalModel && *node.modalModel >= audio.models.size())
    return Error{"modalModel must be the index of one, and there are " +
                 std::to_string(audio.models.size())};
  if (node.acousticSurface && *node.acousticSurface >= audio.surfaces.size())
    return Error{"acousticSurface must be the index of one, and there are " +
                 std::to_string(audio.surfaces.size())};
  if (!(node.gain >= 0.0) || std::isinf(node.gain)) return Error{"gain must be at least 0"};
  if (!node.globalTransform.allFinite()) return Error{"its transform must be finite"};
  return std::monostate{};
}

// ---- Reading.

GltfMassProperties readMassProperties(const JsonNode& object) {
  GltfMassProperties properties;
  properties.mass = object.member("mass").number();
  object.numbers("centerOfMass", {properties.centreOfMass.data(), 3});
  object.numbers("inertiaDiagonal", {properties.inertiaDiagonal.data(), 3});
  // The order is x, y, z, w, in glTF as in Eigen's memory.
  object.numbers("inertiaOrientation", {properties.inertiaOrientation.coeffs().data(), 4});
  return properties;
}

void readExtras(const JsonNode& extras, GltfModalModel& model) {
  for (const JsonNode& volume : extras.member("volumes").elements())
    model.volumes.push_back(volume.number());
  if (!extras.has("leftOut")) return;
  const JsonNode counts = extras.member("leftOut");
  const auto count = [&counts](const std::string& key) {
    constexpr std::size_t kMost = std::numeric_limits<std::uint32_t>::max();
    return static_cast<std::uint32_t>(std::min(counts.index(key, 0), kMost));
  };
  model.leftOut = ModesLeftOut{count("rigid"), count("below"), count("above"), count("overdamped")};
}

GltfModalModel readModel(GltfDocument& document, const JsonNode& object) {
  GltfModalModel model;
  model.name = object.text("name");
  model.frequencies = document.scalars(object.member("frequencies"));
  model.decayRates = document.scalars(object.member("decayRates"));
  model.positions = document.vectors(object.member("positions"));
  model.shapes = document.vectors(object.member("shapes"));
  if (object.has("indices")) model.indices = document.indices(object.member("indices"));
  model.material = object.optionalIndex("material");
  if (object.has("massProperties"))
    model.massProperties = readMassProperties(object.member("massProperties"));
  if (object.has("extras") && object.member("extras").has("carom"))
    readExtras(object.member("extras").member("carom"), model);
  return model;
}

GltfAcousticMaterial readMaterial(const JsonNode& object) {
  GltfAcousticMaterial material;
  material.name = object.text("name");
  material.density = object.optionalNumber("density");
  material.youngsModulus = object.optionalNumber("youngsModulus");
  material.poissonRatio = object.optionalNumber("poissonRatio");
  material.alpha = object.optionalNumber("alpha");
  material.beta = object.optionalNumber("beta");
  if (object.has("extras") && object.member("extras").has("carom"))
    material.restitution = object.member("extras").member("carom").optionalNumber("restitution");
  return material;
}

GltfAcousticSurface readSurface(GltfDocument& document, const JsonNode& object) {
  GltfAcousticSurface surface;
  surface.name = object.text("name");
  surface.roughness = object.number("roughness", surface.roughness);
  surface.correlationLength = object.number("correlationLength", surface.correlationLength);
  surface.spectralSlope = object.number("spectralSlope", surface.spectralSlope);
  surface.shortWavelength = object.optionalNumber("shortWavelength");
  surface.wavinessLength = object.number("wavinessLength", surface.wavinessLength);
  surface.waviness = object.number("waviness", surface.waviness);
  if (object.has("waviness") && surface.waviness > 0.0 && !object.has("wavinessLength"))
    object.member("wavinessLength").fail("is missing; waviness needs it");
  if (object.has("profile")) surface.profile = document.scalars(object.member("profile"));
  surface.sampleSpacing = object.number("sampleSpacing", 0.0);
  if (object.has("normalTexture")) {
    const JsonNode texture = object.member("normalTexture");
    surface.normalTexture = texture.member("index").index();
    surface.normalTexCoord = texture.index("texCoord", 0);
    surface.normalScale = texture.number("scale", 1.0);
  }
  surface.material = object.optionalIndex("material");
  return surface;
}

/// Returns the transform from a node's frame to that of its parent.
Eigen::Matrix4d readTransform(const JsonNode& node) {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  node.numbers("matrix", {matrix.data(), 16});  // column by column, in glTF and in Eigen
  Vec3 translation = Vec3::Zero();
  Vec3 scale = Vec3::Ones();
  Quat rotation = Quat::Identity();
  node.numbers("translation", {translation.data(), 3});
  node.numbers("scale", {scale.data(), 3});
  node.numbers("rotation", {rotation.coeffs().data(), 4});
  if (node.has("matrix")) return matrix;
  if (!(std::abs(rotation.norm() - 1.0) <= kUnit))
    node.member("rotation").fail("must be a quaternion of length 1");
  matrix.topLeftCorner<3, 3>() = rotation.normalized().toRotationMatrix() * scale.asDiagonal();
  matrix.topRightCorner<3, 1>() = translation;
  return matrix;
}

/// Returns the transforms of all nodes to the frame of the scene. Nodes without a parent are
/// reached first, and parents before their children; nodes in a ring are never reached.
std::vector<Eigen::Matrix4d> globalTransforms(const std::vector<JsonNode>& nodes) {
  std::vector<std::vector<std::size_t>> children(nodes.size());
  std::vector<bool> hasParent(nodes.size(), false);
  for (std::size_t node = 0; node < nodes.size(); ++node) {
    for (const JsonNode& child : nodes[node].member("children").elements()) {
      const std::size_t index = child.index();
      if (index >= nodes.size() || hasParent[index])
        child.fail("must be the index of a node that has no other parent");
      else
        children[node].push_back(index), hasParent[index] = true;
    }
  }
  std::vector<Eigen::Matrix4d> transforms(nodes.size());
  std::vector<std::size_t> reached;
  for (std::size_t node = 0; node < nodes.size(); ++node)
    if (!hasParent[node]) reached.push_back(node), transforms[node] = readTransform(nodes[node]);
  for (std::size_t next = 0; next < reached.size(); ++next) {
    for (const std::size_t child : children[reached[next]]) {
      transforms[child] = transforms[reached[next]] * readTransform(nodes[child]);
      reached.push_back(child);
    }
  }
  if (reached.size() < nodes.size())
    nodes.front().fail("or another node is a descendant of itself; expected trees");
  return transforms;
}

void readNodes(GltfDocument& document, GltfAudio& audio) {
  const std::vector<JsonNode> nodes = document.root().member("nodes").elements();
  const std::vector<Eigen::Matrix4d> transforms = globalTransforms(nodes);
  for (std::size_t index = 0; index < nodes.size(); ++index) {
    const JsonNode extensions = nodes[index].member("extensions");
    if (!extensions.has(kExtension)) continue;
    const JsonNode object = extensions.member(kExtension);
    GltfAudioNode node;
    node.name = nodes[index].text("name");
    node.modalModel = object.optionalIndex("modalModel");
    node.acousticSurface = object.optionalIndex("acousticSurface");
    node.gain = object.number("gain", 1.0);
    node.globalTransform = transforms[index];
    if (const Status valid = validate(node, audio); !valid) object.fail(valid.error().message);
    audio.nodes.push_back(std::move(node));
  }
}

GltfAudio readExtension(GltfDocument& document, const JsonNode& extension) {
  GltfAudio audio;
  for (const JsonNode& object : extension.member("acousticMaterials").elements())
    audio.materials.push_back(readMaterial(object));
  for (const JsonNode& object : extension.member("acousticSurfaces").elements())
    audio.surfaces.push_back(readSurface(document, object));
  for (const JsonNode& object : extension.member("modalModels").elements())
    audio.models.push_back(readModel(document, object));
  if (!document.error()) readNodes(document, audio);
  return audio;
}

// ---- Writing.

Json arrayOf(std::span<const double> values) {
  Json array = Json::array();
  for (const double value : values)
    array.push_back(value);
  return array;
}

void putName(Json& json, const std::string& name) {
  if (!name.empty()) json["name"] = name;
}
template <class Value>
void putIf(Json& json, const char* key, const std::optional<Value>& value) {
  if (value) json[key] = *value;
}

Json massPropertiesJson(const GltfMassProperties& properties) {
  return {{"mass", properties.mass},
          {"centerOfMass", arrayOf({properties.centreOfMass.data(), 3})},
          {"inertiaDiagonal", arrayOf({properties.inertiaDiagonal.data(), 3})},
          {"inertiaOrientation", arrayOf({properties.inertiaOrientation.coeffs().data(), 4})}};
}

Json modelJson(const GltfModalModel& model, GltfBuilder& builder) {
  Json json = Json::object();
  putName(json, model.name);
  json["frequencies"] = builder.scalars(model.frequencies);
  json["decayRates"] = builder.scalars(model.decayRates);
  json["positions"] = builder.vectors(model.positions);
  json["shapes"] = builder.vectors(model.shapes);
  if (!model.indices.empty()) json["indices"] = builder.indices(model.indices);
  putIf(json, "material", model.material);
  if (model.massProperties) json["massProperties"] = massPropertiesJson(*model.massProperties);
  Json extras = Json::object();
  if (!model.volumes.empty()) extras["volumes"] = arrayOf(model.volumes);
  if (model.leftOut)
    extras["leftOut"] = {{"rigid", model.leftOut->rigid},
                         {"below", model.leftOut->below},
                         {"above", model.leftOut->above},
                         {"overdamped", model.leftOut->overdamped}};
  if (!extras.empty()) json["extras"]["carom"] = extras;
  return json;
}

Json materialJson(const GltfAcousticMaterial& material) {
  Json json = Json::object();
  putName(json, material.name);
  putIf(json, "density", material.density);
  putIf(json, "youngsModulus", material.youngsModulus);
  putIf(json, "poissonRatio", material.poissonRatio);
  putIf(json, "alpha", material.alpha);
  putIf(json, "beta", material.beta);
  if (material.restitution) json["extras"]["carom"]["restitution"] = *material.restitution;
  return json;
}

Json surfaceJson(const GltfAcousticSurface& surface, GltfBuilder& builder) {
  Json json = Json::object();
  putName(json, surface.name);
  json["roughness"] = surface.roughness;
  json["correlationLength"] = surface.correlationLength;
  json["spectralSlope"] = surface.spectralSlope;
  putIf(json, "shortWavelength", surface.shortWavelength);
  json["waviness"] = surface.waviness;
  json["wavinessLength"] = surface.wavinessLength;
  if (!surface.profile.empty()) {
    json["profile"] = builder.scalars(surface.profile);
    json["sampleSpacing"] = surface.sampleSpacing;
  }
  putIf(json, "material", surface.material);
  return json;
}

Json nodeJson(const GltfAudioNode& node) {
  Json json = Json::object();
  putName(json, node.name);
  if (!node.globalTransform.isIdentity(0.0))
    json["matrix"] = arrayOf({node.globalTransform.data(), 16});
  Json& part = json["extensions"][kExtension] = Json::object();
  putIf(part, "modalModel", node.modalModel);
  putIf(part, "acousticSurface", node.acousticSurface);
  part["gain"] = node.gain;
  return json;
}

/// Puts an array unless it is empty: glTF has no empty arrays.
void putArray(Json& json, const char* key, Json&& array) {
  if (!array.empty()) json[key] = std::move(array);
}

Json documentJson(const GltfAudio& audio, GltfBuilder& builder) {
  Json models = Json::array();
  Json materials = Json::array();
  Json surfaces = Json::array();
  Json nodes = Json::array();
  Json roots = Json::array();
  for (const GltfModalModel& model : audio.models)
    models.push_back(modelJson(model, builder));
  for (const GltfAcousticMaterial& material : audio.materials)
    materials.push_back(materialJson(material));
  for (const GltfAcousticSurface& surface : audio.surfaces)
    surfaces.push_back(surfaceJson(surface, builder));
  for (const GltfAudioNode& node : audio.nodes) {
    roots.push_back(nodes.size());
    nodes.push_back(nodeJson(node));
  }
  Json json = {{"asset", nullptr}, {"extensionsUsed", Json::array({kExtension})}};
  Json& extension = json["extensions"][kExtension] = Json::object();
  putArray(extension, "acousticMaterials", std::move(materials));
  putArray(extension, "acousticSurfaces", std::move(surfaces));
  putArray(extension, "modalModels", std::move(models));
  if (!nodes.empty()) {
    json["scene"] = 0;
    json["scenes"] = Json::array({{{"nodes", roots}}});
  }
  putArray(json, "nodes", std::move(nodes));
  return json;
}

}  // namespace

Status validate(const GltfAudio& audio) {
  const auto at = [](const char* array, std::size_t index, const std::string& why) {
    return '/' + std::string(array) + '/' + std::to_string(index) + why;
  };
  for (std::size_t index = 0; index < audio.materials.size(); ++index)
    if (const Status valid = validate(audio.materials[index]); !valid)
      return Error{at("acousticMaterials", index, valid.error().message)};
  for (std::size_t index = 0; index < audio.surfaces.size(); ++index)
    if (const Status valid = validate(audio.surfaces[index], audio.materials.size()); !valid)
      return Error{at("acousticSurfaces", index, valid.error().message)};
  for (std::size_t index = 0; index < audio.models.size(); ++index)
    if (const Status valid = validate(audio.models[index], audio.materials.size()); !valid)
      return Error{at("modalModels", index, valid.error().message)};
  for (const GltfAudioNode& node : audio.nodes)
    if (const Status valid = validate(node, audio); !valid)
      return Error{"node '" + node.name + "': " + valid.error().message};
  return std::monostate{};
}

Result<GltfAudio> parseGltfAudio(std::span<const std::byte> bytes, std::string_view name,
                                 const fs::path& folder) {
  const auto refuse = [name](const std::string& why) {
    return Error{std::string(name) + ": " + why};
  };
  Result<GltfDocument> document = GltfDocument::parse(bytes, name, folder);
  if (!document) return document.error();
  const JsonNode extensions = document->root().member("extensions");
  if (!extensions.has(kExtension))
    return refuse(
        "has no /extensions/KHR_audio_rigid_bodies; expected a glTF file with modal "
        "models, acoustic materials or surfaces");
  GltfAudio audio = readExtension(*document, extensions.member(kExtension));
  if (document->error()) return document->error().error();
  if (const Status valid = validate(audio); !valid)
    return refuse("/extensions/" + std::string(kExtension) + valid.error().message);
  return audio;
}

Result<GltfAudio> readGltfAudio(const fs::path& path) {
  const Result<std::vector<std::byte>> bytes = readBytes(path);
  if (!bytes) return Error{path.string() + ": " + bytes.error().message};
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  return parseGltfAudio(*bytes, path.string(), folder);
}

Status writeGltfAudio(const fs::path& path, const GltfAudio& audio) {
  const auto refuse = [&path](const std::string& why) { return Error{path.string() + ": " + why}; };
  const bool binary = path.extension() == ".glb";
  if (!binary && path.extension() != ".gltf")
    return refuse("must end in .gltf or .glb, to say which of the two to write");
  if (const Status valid = validate(audio); !valid)
    return refuse("cannot be written: " + valid.error().message);
  GltfBuilder builder;
  Json json = documentJson(audio, builder);
  return writeBytes(path, binary ? builder.glb(std::move(json)) : builder.gltf(std::move(json)));
}

}  // namespace carom
