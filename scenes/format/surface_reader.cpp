#include "scenes/format/surface_reader.h"

#include <cstddef>
#include <string>

#include "audio/io/byte_file.h"
#include "scenes/values/scene_ranges.h"

namespace carom::scenes {

using namespace modal;

namespace {

// scene.schema.json and docs/scenes.md repeat these; a test compares the schema.

constexpr NumberRange kRmsHeight{.noun = "an rms height", .min = 0.0, .max = 1.0, .unit = "metres"};
constexpr NumberRange kCorrelationLength{
    .noun = "a correlation length", .min = 1e-9, .max = 10.0, .unit = "metres"};
constexpr NumberRange kHurst{.noun = "a Hurst exponent", .min = 0.0, .max = 1.0, .aboveMin = true};
constexpr NumberRange kSide{
    .noun = "a side of a normal map", .min = 1e-6, .max = 1e4, .unit = "metres"};
constexpr NumberRange kStrength{.noun = "a strength", .min = 0.0, .max = 100.0};

Vec2 readSize(const JsonNode& node) {
  Vec2 size = Vec2::Ones();
  const auto sides = node.elements("a size of a normal map", 2, 2);
  for (std::size_t axis = 0; axis < sides.size(); ++axis)
    size[static_cast<Eigen::Index>(axis)] = sides[axis].number(kSide);
  return size;
}

}  // namespace

Roughness readRoughness(const JsonNode& node, const Roughness& absent) {
  const auto found = node.find("roughness");
  if (!found || !found->expectObject("a roughness", {"rms_height", "correlation_length", "hurst"}))
    return absent;
  Roughness roughness;
  roughness.rmsHeight = found->number("rms_height", kRmsHeight);
  roughness.correlationLength = found->number("correlation_length", kCorrelationLength);
  roughness.hurst = found->number("hurst", kHurst, roughness.hurst);
  if (!found->failed() && roughness.rmsHeight > roughness.correlationLength)
    found->fail("the rms height is above the correlation length; expected at most that");
  return roughness;
}

std::optional<NormalMapFile> readNormalMapEntry(const JsonNode& entry, const SceneFolder& folder) {
  const auto node = entry.find("normal_map");
  if (!node || !node->expectObject("a normal map", {"file", "size", "green", "strength"}))
    return std::nullopt;
  const auto file = node->require("file", "the name of a PNG file");
  if (!file) return std::nullopt;
  NormalMapFile map;
  map.file = folder.fileOf(*file);
  if (const auto size = node->find("size"))
    map.settings.size = readSize(*size);
  else
    map.byCoordinates = true;
  if (const auto green = node->find("green"))
    map.settings.greenIsDown = green->choice("where green points", {"up", "down"}) == 1;
  map.settings.strength = node->number("strength", kStrength, map.settings.strength);
  if (!node->failed() && !audio::isRegularFile(map.file))
    file->fail("there is no file " + inQuotes(map.file.string()) +
               "; expected a PNG file, its name relative to the scene's folder");
  return map;
}

}  // namespace carom::scenes
