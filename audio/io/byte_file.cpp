#include "audio/io/byte_file.h"

#include <cstdint>
#include <fstream>
#include <string>
#include <system_error>
#include <variant>

#include "audio/io/partial_file.h"

namespace carom::audio {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kMaxFileSize = 1U << 30;  // bytes

}  // namespace

Result<std::vector<std::byte>> readBytes(const fs::path& path) {
  std::error_code code;
  const fs::file_status status = fs::status(path, code);
  if (!fs::exists(status)) return Error{"there is no such file"};
  if (fs::is_directory(status)) return Error{"it is a folder; expected a file"};
  if (!fs::is_regular_file(status)) return Error{"it is not a regular file"};
  const std::uintmax_t size = fs::file_size(path, code);
  if (code || size > kMaxFileSize) return Error{"it is larger than 1 GiB"};
  std::ifstream stream(path, std::ios::binary);
  std::vector<std::byte> bytes(static_cast<std::size_t>(size));
  // The cast is allowed: char may alias the bytes.
  if (!stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size)))
    return Error{"it may not be read"};
  return bytes;
}

bool isRegularFile(const fs::path& path) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored);
}

std::error_code makeFolder(const fs::path& folder) {
  std::error_code failed;
  fs::create_directories(folder, failed);
  return failed;
}

bool isBelow(const std::filesystem::path& file, const std::filesystem::path& folder) {
  namespace fs = std::filesystem;
  std::error_code failed;
  const auto wholePath = [&failed](const fs::path& path) {
    const fs::path absolute = fs::absolute(path, failed);
    return failed ? fs::path() : fs::weakly_canonical(absolute, failed);
  };
  const fs::path root = wholePath(folder.empty() ? "." : folder);
  if (failed) return false;
  const fs::path target = wholePath(file);
  if (failed) return false;
  const fs::path way = target.lexically_relative(root);
  return !way.empty() && *way.begin() != "..";
}

Status writeBytes(const fs::path& path, std::span<const std::byte> bytes, Sync sync) {
  const auto refuse = [&path](const std::string& why) { return Error{path.string() + ": " + why}; };
  if (const Status valid = checkWritable(path); !valid)
    return refuse("cannot be written: " + valid.error().message);
  PartialFile partial(path);
  std::ofstream stream(partial.path(), std::ios::binary | std::ios::trunc);
  stream.write(reinterpret_cast<const char*>(bytes.data()), std::ssize(bytes));
  stream.close();
  if (!stream) return refuse("cannot be written; is there room, and may this folder be written?");
  if (const std::error_code failed = partial.giveName(sync); failed)
    return refuse("cannot be given its name: " + failed.message());
  return std::monostate{};
}

}  // namespace carom::audio
