#include "modal/file_bytes.h"

#include <cstdint>
#include <fstream>
#include <system_error>

namespace carom {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kMaxFileSize = 1U << 30;  // bytes
constexpr std::size_t kMaxShown = 120;             // characters

}  // namespace

Result<std::vector<std::byte>> bytesOfFile(const fs::path& path) {
  std::error_code code;
  const fs::file_status status = fs::status(path, code);
  if (!fs::exists(status)) return Error{"there is no such file"};
  if (fs::is_directory(status)) return Error{"it is a folder; expected a file"};
  if (!fs::is_regular_file(status)) return Error{"it is not a regular file"};
  const std::uintmax_t size = fs::file_size(path, code);
  if (code || size > kMaxFileSize) return Error{"it is larger than 1 GiB"};
  std::ifstream stream(path, std::ios::binary);
  std::vector<std::byte> bytes(static_cast<std::size_t>(size));
  // Bytes may be looked at as characters.
  if (!stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size)))
    return Error{"it may not be read"};
  return bytes;
}

std::string printable(std::string_view text) {
  std::string result;
  for (const char letter : text.substr(0, kMaxShown))
    result += letter >= ' ' && letter <= '~' ? letter : '?';
  return result;
}

}  // namespace carom
