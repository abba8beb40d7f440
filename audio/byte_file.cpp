#include "audio/byte_file.h"

#include <fstream>
#include <string>
#include <system_error>
#include <variant>

#include "audio/partial_file.h"

namespace carom {

namespace fs = std::filesystem;

Result<std::vector<std::byte>> readBytes(const fs::path& path) {
  const auto refuse = [&path](const std::string& why) { return Error{path.string() + ": " + why}; };
  std::error_code failed;
  if (!fs::is_regular_file(path, failed)) {
    return refuse(fs::exists(path, failed) ? "is no regular file"
                                           : "does not exist; expected a file to read");
  }
  const std::uintmax_t size = fs::file_size(path, failed);
  std::ifstream stream(path, std::ios::binary);
  if (failed || !stream) return refuse("may not be read");
  std::vector<std::byte> bytes(size);
  stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
  if (!stream) return refuse("cannot be read to its end");
  return bytes;
}

Status writeBytes(const fs::path& path, std::span<const std::byte> bytes) {
  const auto refuse = [&path](const std::string& why) { return Error{path.string() + ": " + why}; };
  if (const std::string why = whyNoFileAt(path); !why.empty())
    return refuse("cannot be written: " + why);
  PartialFile partial(path);
  std::ofstream stream(partial.path(), std::ios::binary | std::ios::trunc);
  stream.write(reinterpret_cast<const char*>(bytes.data()), std::ssize(bytes));
  stream.close();
  if (!stream) return refuse("cannot be written; is there room, and may this folder be written?");
  if (const std::error_code failed = partial.giveName(); failed)
    return refuse("cannot be given its name: " + failed.message());
  return std::monostate{};
}

}  // namespace carom
