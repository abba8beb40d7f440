#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "carom/audio/result.h"

namespace carom::lab {

/// The hash SHA-256 (FIPS 180-4) of what is added, in hexadecimal digits, by the processor's own
/// instructions where it has them. [one thread]
class FileHash {
 public:
  FileHash();

  void add(std::span<const std::byte> bytes);
  void add(std::string_view text);
  /// Returns the hash; nothing can be added after.
  std::string digits();

 private:
  struct Free {
    void operator()(void* context) const;
  };
  std::unique_ptr<void, Free> context_;
};

std::string sha256(std::string_view text);
std::string sha256(std::span<const std::byte> bytes);
/// Returns the hash of a file of any size. The error is the second half of a sentence.
Result<std::string> sha256OfFile(const std::filesystem::path& file);

}  // namespace carom::lab
