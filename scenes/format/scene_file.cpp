// The part of scene_loader.h that opens files; a build without files has only texts.

#include <array>
#include <fstream>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "modal/json/json_reader.h"
#include "scenes/format/scene_loader.h"

namespace carom::scenes {
namespace {

/// Reads the file, but at most a little more than SceneLimits::kFileSize,
/// so that parseScene refuses it if it is larger. Returns nullopt with an
/// error if it is no regular file or unreadable.
std::optional<std::string> readText(const std::filesystem::path& file, modal::FirstError& error) {
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

}  // namespace

Result<std::string> readSceneText(const std::filesystem::path& file) {
  modal::FirstError error(file.string());
  std::optional<std::string> text = readText(file, error);
  if (!text) return error.error();
  return *std::move(text);
}

Result<Scene> loadScene(const std::filesystem::path& file, const FileAccess& access) {
  const Result<std::string> text = readSceneText(file);
  if (!text) return text.error();
  return parseScene(*text, file.string(), access);
}

}  // namespace carom::scenes
