#include "scenes/values/camera_reader.h"

#include <cstddef>
#include <optional>
#include <string_view>

#include <nlohmann/json.hpp>

#include "audio/io/byte_file.h"
#include "scenes/values/aim.h"
#include "scenes/values/scene_ranges.h"

namespace carom::scenes {

using modal::formatNumber;
using modal::JsonNode;
using modal::NumberRange;

namespace {

constexpr NumberRange kKeyTime{
    .noun = "the time of a key frame", .min = 0.0, .max = 3600.0, .unit = "seconds"};
constexpr NumberRange kFieldOfView{
    .noun = "a field of view", .min = 1.0, .max = 150.0, .unit = "degrees"};

/// Up is away from gravity until a key frame says otherwise.
Aim aimIn(const Vec3& gravity) {
  Aim aim;
  if (!gravity.isZero(0.0)) aim.up = -gravity;
  return aim;
}

}  // namespace

std::vector<CameraKey> readCamera(const JsonNode& node, const Vec3& gravity) {
  std::vector<CameraKey> keys;
  Aim aim = aimIn(gravity);
  double fieldOfView = CameraKey().fieldOfView;
  for (const JsonNode& entry : node.elements("a list of key frames", 1, kMaxCameraKeys)) {
    if (!entry.expectObject("a key frame",
                            {"time", "position", "looks_at", "forward", "up", "field_of_view"}))
      break;
    CameraKey key;
    key.time = entry.number("time", kKeyTime);
    key.position = entry.vector("position", kPlace);
    readAim(entry, aim);
    key.orientation = orientationOf(aim, key.position, entry);
    key.hasTarget = aim.target.has_value();
    key.target = aim.target.value_or(key.target);
    key.up = aim.up;
    fieldOfView = entry.number("field_of_view", kFieldOfView, fieldOfView);
    key.fieldOfView = fieldOfView;
    if (!entry.failed() && !keys.empty() && !(key.time > keys.back().time))
      entry.find("time")->fail(formatNumber(key.time) +
                               " s is not after the key frame before, at " +
                               formatNumber(keys.back().time) + " s; expected times that ascend");
    if (entry.failed()) break;
    keys.push_back(key);
  }
  return keys;
}

Result<std::vector<CameraKey>> loadCamera(const std::filesystem::path& file, const Vec3& gravity) {
  const Result<std::vector<std::byte>> bytes = audio::readBytes(file);
  if (!bytes) return Error{file.string() + ": " + bytes.error().message};
  const std::string_view text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
  modal::FirstError error(file.string());
  const std::optional<nlohmann::json> document = modal::parseJson(text, error);
  if (!document) return error.error();
  std::vector<CameraKey> keys = readCamera(JsonNode(*document, "", error), gravity);
  if (error) return error.error();
  return keys;
}

}  // namespace carom::scenes
